"""Forces of the awake pairs of edges, from rows that hold all that a pair remembers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.contact.joints import (
    BROKEN,
    FACING_FULL,
    FACING_NONE,
    OPEN,
    SLIP,
    STICK,
    bearing,
    closure_stress,
)
from graben.mechanics.blocks.contact.nodes import LENGTH, RIM, TX, TY, VX, VY, X, Y
from graben.mechanics.cache_lines import ask_for
from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span

# Rows between the one in work and the one whose data are asked for.
_AHEAD = 6

# Columns of Rows.edge and of Rows.mark.
E, F, E_END, F_END, PAIR, FAR, EDGE_COLUMNS = 0, 1, 2, 3, 4, 5, 8
LIVE, INTACT, MARK_COLUMNS = 2, 3, 4


class Rows(NamedTuple):
    """Awake pairs in the order of work, so that memory is read in order; their memory lives here while stepping.

    edge : (n, 8) uint32, the two edges, the nodes where they end, the pair, and the row of Motion.far or -1
    hold : (n, 4) shear stress at both ends [Pa], slip at both ends [m]; mark : (n, 4) int8, state of both ends,
    whether live, whether intact at the start; seat : (n, 2) as of Pairs, or (0, 2)
    """

    edge: np.ndarray
    hold: np.ndarray
    mark: np.ndarray
    seat: np.ndarray


def empty_rows(n: int, seated: bool = False) -> Rows:
    """Rows for up to n pairs, with seats or without."""
    return Rows(
        np.zeros((n, EDGE_COLUMNS), dtype=np.uint32),
        np.zeros((n, 4)),
        np.zeros((n, MARK_COLUMNS), dtype=np.int8),
        np.zeros((n if seated else 0, 2)),
    )


@kernel(error_model="numpy")
def fill_row(rows, r, pairs, c, follow, far_row):
    """Row r becomes pair c."""
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    e = pairs.first[c]
    f = pairs.second[c]
    edge[r, E] = e
    edge[r, F] = f
    edge[r, E_END] = follow[e]
    edge[r, F_END] = follow[f]
    edge[r, PAIR] = c
    edge[r, FAR] = far_row
    for k in range(2):
        hold[r, k] = pairs.shear[c, k]
        hold[r, 2 + k] = pairs.slip[c, k]
        mark[r, k] = pairs.flag[c, k]
        if rows.seat.shape[0] > 0:
            rows.seat[r, k] = pairs.seat[c, k]
    mark[r, LIVE] = pairs.live[c]
    mark[r, INTACT] = pairs.intact[c]


@kernel(error_model="numpy")
def settle_rows(rows, begin, end, pairs):
    """What rows begin to end remember goes back to their pairs."""
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    shear, slip, flag, live = pairs.shear, pairs.slip, pairs.flag, pairs.live
    for r in span(begin, end):
        c = edge[r, PAIR]
        for k in range(2):
            shear[c, k] = hold[r, k]
            slip[c, k] = hold[r, 2 + k]
            flag[c, k] = mark[r, k]
        live[c] = mark[r, LIVE]


@kernel(error_model="numpy")
def forget(shear, flag, intact, c):
    """An open contact remembers no stress; what slid stays, and so does the mark of a broken joint."""
    for k in range(2):
        shear[c, k] = 0.0
        if flag[c, k] != BROKEN:
            if intact[c] == 1 and flag[c, k] != OPEN:
                flag[c, k] = BROKEN
            else:
                flag[c, k] = OPEN


@kernel(error_model="numpy", forceinline=True)
def _end_law(tau, slip, mark, whole, gap, gain, kn, compliance, strengths, tensile, dilation, limit, closure):
    """One end of a contact: new shear stress, slip and state, normal stress, and work lost (per area).

    gap [m]; gain : what sliding in this step adds to the shear stress [Pa]; whole : intact and not broken
    strengths : friction, cohesion; and residual ones, friction below 0 if the joint does not weaken
    """
    friction, cohesion, residual_friction, residual_cohesion = strengths
    weakens = residual_friction >= 0.0
    opened = dilation * min(abs(slip), limit)
    closed = opened - gap
    sigma = kn * closed
    if closure > 0.0 and closed > 0.0:
        sigma = closure_stress(closed, kn, closure)[0]
    tension = tensile if whole else 0.0
    if sigma <= -tension:
        # What the joint stored is lost with it.
        lost = tau * tau * compliance
        if tension > 0.0:
            lost += sigma * sigma / kn
        if mark != BROKEN:
            mark = BROKEN if whole and (tension > 0.0 or weakens) else OPEN
        return 0.0, slip, mark, 0.0, 0.5 * lost
    if weakens and not whole:
        friction = residual_friction
        cohesion = residual_cohesion
    tau += gain
    strength = max(cohesion + sigma * friction, 0.0)
    work = 0.0
    if weakens and whole and abs(tau) > strength:
        # It breaks: strength falls at once, and with it what it stored.
        strength = max(residual_cohesion + sigma * residual_friction, 0.0)
        work = 0.5 * compliance * (abs(tau) - strength) ** 2
        mark = BROKEN
    # No branch on sliding: nobody could foretell it.
    limited = min(max(tau, -strength), strength)
    slid = (tau - limited) * compliance
    slip += slid
    work += limited * slid - sigma * (dilation * min(abs(slip), limit) - opened)
    if mark != BROKEN:
        mark = STICK if tau == limited else SLIP
    return limited, slip, mark, sigma, work


@kernel(error_model="numpy")
def contact_forces(rows, begin, stop, node, table, joint, deepest, dt, fn, node_end, far, sums):
    """Stress update and forces of the awake pairs; returns the pair that overlaps too much, or -1.

    rows begin to stop : all of set `joint` of table; node : node table
    fn : (nodes, 2) forces, added to [N/m]; those on the second edge, if it lies at or beyond node_end, go to their
    row of far (rows, 4) instead
    deepest : overlap above which a touching pair stops the run, and others are no contact [m]
    sums : [friction work, largest overlap], added to; the work that dilation gives back is not friction
    """
    # Taken out of the tuple once: inside the loop each look-up would count references.
    edge, hold, mark, seat = rows.edge, rows.hold, rows.mark, rows.seat
    seated = seat.shape[0] > 0
    seat0 = 0.0
    seat1 = 0.0
    whole_at_start = mark[:, INTACT]
    kn, ks = table[joint, 0], table[joint, 1]
    strengths = (table[joint, 2], table[joint, 3], table[joint, 7], table[joint, 8])
    tensile, dilation, limit, closure = table[joint, 4], table[joint, 5], table[joint, 6], table[joint, 9]
    compliance = 1.0 / ks
    ksdt = ks * dt
    friction_work = 0.0
    largest = sums[1]
    last = np.uint64(max(stop, 1) - 1)
    for m in span(begin, stop):
        # Edges face each other in no order of memory: ask early for what is due some rows later.
        r = min(m + np.uint64(_AHEAD), last)
        ask_for(node, edge[r, E])
        ask_for(node, edge[r, F])
        ask_for(node, edge[r, F_END])
        e = edge[m, E]
        f = edge[m, F]
        # Difference of the unit tangents: along the common tangent, of length sqrt(2 + 2 facing). All lengths
        # along it, and heights above it, are stretched by that.
        tx = node[e, TX] - node[f, TX]
        ty = node[e, TY] - node[f, TY]
        square = tx * tx + ty * ty
        facing = 0.5 * square - 1.0
        if facing <= FACING_NONE:
            if mark[m, LIVE] == 1:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 0
            continue
        e2 = edge[m, E_END]
        f2 = edge[m, F_END]
        ox = node[e, X]
        oy = node[e, Y]
        # Along the tangent: edge e runs from 0 to se, edge f from s1 (its end) to s0 (its start).
        se = node[e, LENGTH] * (node[e, TX] * tx + node[e, TY] * ty)
        s0 = (node[f, X] - ox) * tx + (node[f, Y] - oy) * ty
        s1 = (node[f2, X] - ox) * tx + (node[f2, Y] - oy) * ty
        low = max(0.0, s1)
        high = min(se, s0)
        rim = node[e, RIM] + node[f, RIM]
        # They are stretched by at least sqrt(3).
        if high - low <= 1.7 * rim:
            if mark[m, LIVE] == 1:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 0
            continue
        # Heights along the normal n = (ty, -tx), which points out of edge e.
        he = node[e, LENGTH] * (node[e, TX] * ty - node[e, TY] * tx)
        h0 = (node[f, X] - ox) * ty - (node[f, Y] - oy) * tx
        h1 = (node[f2, X] - ox) * ty - (node[f2, Y] - oy) * tx
        slip0 = hold[m, 2]
        slip1 = hold[m, 3]
        if seated:
            seat0 = seat[m, 0]
            seat1 = seat[m, 1]
        elif min(h0, h1) > max(0.0, he) and mark[m, INTACT] == 0 and slip0 == 0.0 and slip1 == 0.0:
            # Pairs apart that never slid end here, before any root or division.
            if mark[m, LIVE] == 0 or mark[m, 0] != OPEN or mark[m, 1] != OPEN:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 1
            continue
        # One division serves all three inverse lengths.
        sf = s0 - s1
        stretch = np.sqrt(square)
        share = 1.0 / (se * sf * square)
        de = sf * square * share
        df = se * square * share
        scale = se * sf * share * stretch
        alpha0 = low * de
        alpha1 = high * de
        beta0 = (s0 - low) * df
        beta1 = (s0 - high) * df
        gap0 = scale * (h0 + (h1 - h0) * beta0 - he * alpha0)
        gap1 = scale * (h0 + (h1 - h0) * beta1 - he * alpha1)
        overlap = -0.5 * (gap0 + gap1)
        if overlap > deepest:
            if mark[m, LIVE] == 1:
                sums[0] += friction_work
                sums[1] = overlap
                return edge[m, PAIR]
            continue
        area = 0.5 * bearing(scale * (high - low), gap0, gap1, rim)
        if facing < FACING_FULL:
            area *= (facing - FACING_NONE) / (FACING_FULL - FACING_NONE)
        tx *= scale
        ty *= scale
        de *= stretch
        df *= stretch
        # Sliding speeds along the tangent, at both ends.
        ve = node[e, VX] * tx + node[e, VY] * ty
        ve2 = node[e2, VX] * tx + node[e2, VY] * ty
        vf = node[f, VX] * tx + node[f, VY] * ty
        vf2 = node[f2, VX] * tx + node[f2, VY] * ty
        gain0 = ksdt * (vf + beta0 * (vf2 - vf) - ve - alpha0 * (ve2 - ve))
        gain1 = ksdt * (vf + beta1 * (vf2 - vf) - ve - alpha1 * (ve2 - ve))
        intact = mark[m, INTACT] == 1
        mark0 = mark[m, 0]
        mark1 = mark[m, 1]
        whole0 = intact and mark0 != BROKEN
        whole1 = intact and mark1 != BROKEN
        tau0, slip0, mark0, sigma0, work0 = _end_law(
            hold[m, 0], slip0, mark0, whole0, gap0 - seat0, gain0,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        tau1, slip1, mark1, sigma1, work1 = _end_law(
            hold[m, 1], slip1, mark1, whole1, gap1 - seat1, gain1,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        hold[m, 0] = tau0
        hold[m, 1] = tau1
        hold[m, 2] = slip0
        hold[m, 3] = slip1
        mark[m, 0] = mark0
        mark[m, 1] = mark1
        mark[m, LIVE] = 1
        friction_work += (work0 + work1) * area
        largest = max(largest, -gap0, -gap1)
        # Traction on edge e: -sigma n + tau t, at a point midway between the edges. Seen from a point of
        # edge e this adds a couple, carried by opposite normal forces at the ends of that edge.
        tau0 *= area
        tau1 *= area
        sigma0 *= area
        sigma1 *= area
        couple = 0.5 * (gap0 * tau0 + gap1 * tau1)
        tau = tau0 + tau1
        sigma = sigma0 + sigma1
        # Along t and along n: at the end of edge e, at its start, at the end of edge f, at its start.
        at = alpha0 * tau0 + alpha1 * tau1
        an = -alpha0 * sigma0 - alpha1 * sigma1 - couple * de
        bt = tau - at
        bn = -sigma - an
        ct = -beta0 * tau0 - beta1 * tau1
        cn = beta0 * sigma0 + beta1 * sigma1 + couple * df
        gt = -tau - ct
        gn = sigma - cn
        fn[e, 0] += bt * tx + bn * ty
        fn[e, 1] += bt * ty - bn * tx
        fn[e2, 0] += at * tx + an * ty
        fn[e2, 1] += at * ty - an * tx
        if f < node_end:
            fn[f, 0] += gt * tx + gn * ty
            fn[f, 1] += gt * ty - gn * tx
            fn[f2, 0] += ct * tx + cn * ty
            fn[f2, 1] += ct * ty - cn * tx
        else:
            row = edge[m, FAR]
            far[row, 0] = gt * tx + gn * ty
            far[row, 1] = gt * ty - gn * tx
            far[row, 2] = ct * tx + cn * ty
            far[row, 3] = ct * ty - cn * tx
    sums[0] += friction_work
    sums[1] = largest
    return -1
