"""Forces of the awake pairs of edges, from rows that hold all that a pair remembers.

Rows go in batches: `_collect` copies what they need into columns, `_press_batch` works out all lanes of these at once
(vector instructions; no lane looks at another), and `_hand_out` takes the results to rows and nodes, in their order.
"""

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


# Rows of a batch, and where the columns of its work space begin. Read: edge e from its node on (position, velocity,
# tangent, length), both rims, edge f, its end, velocity of the end of e, stress and slip of both ends of the contact,
# whether these are whole, their seats, and whether the pair may end early when it is apart.
LANES = 32
_EX, _EY, _EVX, _EVY, _ETX, _ETY, _EL, _RIM = (LANES * k for k in range(8))
_FX, _FY, _FVX, _FVY, _FTX, _FTY = (LANES * k for k in range(8, 14))
_GX, _GY, _GVX, _GVY, _DVX, _DVY = (LANES * k for k in range(14, 20))
_TAU0, _TAU1, _SLIP0, _SLIP1, _WHOLE0, _WHOLE1, _SEAT0, _SEAT1, _PLAIN = (LANES * k for k in range(20, 29))
# Written: forces on the start and the end of e and f; what became of the pair, overlap, both gaps, work lost, and what
# became of both ends.
_PX, _PY, _QX, _QY, _RX, _RY, _SX, _SY = (LANES * k for k in range(8))
_FATE, _OVERLAP, _GAP0, _GAP1, _WORK, _END0, _END1 = (LANES * k for k in range(29, 36))
# Sums over all batches: friction work and largest overlap.
_LOST, _DEEPEST = 36 * LANES, 36 * LANES + 1
WORK_SPACE = 36 * LANES + 2

# Fates of a pair: no contact, in front of each other with a gap, overlap.
_AWAY, _APART, _TOUCHES = 0.0, 1.0, 2.0


@kernel(error_model="numpy", forceinline=True)
def _end_law(tau, slip, whole, gap, gain, kn, compliance, strengths, tensile, dilation, limit, closure):
    """One end of a contact: new shear stress, slip, normal stress, work lost (per area), and STICK, SLIP, OPEN or
    BROKEN if it breaks now.

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
        return 0.0, slip, 0.0, 0.5 * lost, 1.0 * OPEN
    if weakens and not whole:
        friction = residual_friction
        cohesion = residual_cohesion
    tau += gain
    strength = max(cohesion + sigma * friction, 0.0)
    work = 0.0
    breaks = weakens and whole and abs(tau) > strength
    if breaks:
        # It breaks: strength falls at once, and with it what it stored.
        strength = max(residual_cohesion + sigma * residual_friction, 0.0)
        work = 0.5 * compliance * (abs(tau) - strength) ** 2
    limited = min(max(tau, -strength), strength)
    slid = (tau - limited) * compliance
    slip += slid
    work += limited * slid - sigma * (dilation * min(abs(slip), limit) - opened)
    state = 1.0 * BROKEN if breaks else (1.0 * STICK if tau == limited else 1.0 * SLIP)
    return limited, slip, sigma, work, state


@kernel(error_model="numpy")
def _collect(w, rows, begin, stop, node):
    """Copy what rows begin to stop and their nodes hold into the lanes of the work space."""
    edge, hold, mark, seat = rows.edge, rows.hold, rows.mark, rows.seat
    seated = seat.shape[0] > 0
    last = np.uint64(max(edge.shape[0], 1) - 1)
    j = np.uint64(0)
    for m in span(begin, stop):
        # Edges face each other in no order of memory: ask early for what is due some rows later.
        r = min(m + np.uint64(_AHEAD), last)
        ask_for(node, edge[r, E])
        ask_for(node, edge[r, F])
        ask_for(node, edge[r, F_END])
        e, f, d, g = edge[m, E], edge[m, F], edge[m, E_END], edge[m, F_END]
        w[j + np.uint64(_EX)] = node[e, X]
        w[j + np.uint64(_EY)] = node[e, Y]
        w[j + np.uint64(_EVX)] = node[e, VX]
        w[j + np.uint64(_EVY)] = node[e, VY]
        w[j + np.uint64(_ETX)] = node[e, TX]
        w[j + np.uint64(_ETY)] = node[e, TY]
        w[j + np.uint64(_EL)] = node[e, LENGTH]
        w[j + np.uint64(_RIM)] = node[e, RIM] + node[f, RIM]
        w[j + np.uint64(_FX)] = node[f, X]
        w[j + np.uint64(_FY)] = node[f, Y]
        w[j + np.uint64(_FVX)] = node[f, VX]
        w[j + np.uint64(_FVY)] = node[f, VY]
        w[j + np.uint64(_FTX)] = node[f, TX]
        w[j + np.uint64(_FTY)] = node[f, TY]
        w[j + np.uint64(_GX)] = node[g, X]
        w[j + np.uint64(_GY)] = node[g, Y]
        w[j + np.uint64(_GVX)] = node[g, VX]
        w[j + np.uint64(_GVY)] = node[g, VY]
        w[j + np.uint64(_DVX)] = node[d, VX]
        w[j + np.uint64(_DVY)] = node[d, VY]
        w[j + np.uint64(_TAU0)] = hold[m, 0]
        w[j + np.uint64(_TAU1)] = hold[m, 1]
        w[j + np.uint64(_SLIP0)] = hold[m, 2]
        w[j + np.uint64(_SLIP1)] = hold[m, 3]
        intact = mark[m, INTACT] == 1
        w[j + np.uint64(_WHOLE0)] = 1.0 if intact and mark[m, 0] != BROKEN else 0.0
        w[j + np.uint64(_WHOLE1)] = 1.0 if intact and mark[m, 1] != BROKEN else 0.0
        w[j + np.uint64(_PLAIN)] = 1.0 if not seated and not intact else 0.0
        if seated:
            w[j + np.uint64(_SEAT0)] = seat[m, 0]
            w[j + np.uint64(_SEAT1)] = seat[m, 1]
        j += np.uint64(1)


@kernel(error_model="numpy")
def _press_batch(w, table, joint, dt):
    """Stress update and forces of all lanes. Lanes without contact hold anything but for their fate."""
    kn, ks, friction, cohesion = table[joint, 0], table[joint, 1], table[joint, 2], table[joint, 3]
    tensile, dilation, limit, closure = table[joint, 4], table[joint, 5], table[joint, 6], table[joint, 9]
    if tensile == 0.0 and closure == 0.0 and table[joint, 7] < 0.0:
        # The same with what these features cost left out by the compiler.
        _press_lanes(w, kn, ks, (friction, cohesion, -1.0, -1.0), 0.0, dilation, limit, 0.0, dt)
    else:
        strengths = (friction, cohesion, table[joint, 7], table[joint, 8])
        _press_lanes(w, kn, ks, strengths, tensile, dilation, limit, closure, dt)


@kernel(error_model="numpy", forceinline=True)
def _press_lanes(w, kn, ks, strengths, tensile, dilation, limit, closure, dt):
    compliance = 1.0 / ks
    ksdt = ks * dt
    for j in range(LANES):
        # Difference of the unit tangents: along the common tangent, of length sqrt(2 + 2 facing). All lengths
        # along it, and heights above it, are stretched by that.
        tx = w[_ETX + j] - w[_FTX + j]
        ty = w[_ETY + j] - w[_FTY + j]
        square = tx * tx + ty * ty
        facing = 0.5 * square - 1.0
        ox, oy = w[_EX + j], w[_EY + j]
        # Along the tangent: edge e runs from 0 to se, edge f from s1 (its end) to s0 (its start).
        se = w[_EL + j] * (w[_ETX + j] * tx + w[_ETY + j] * ty)
        s0 = (w[_FX + j] - ox) * tx + (w[_FY + j] - oy) * ty
        s1 = (w[_GX + j] - ox) * tx + (w[_GY + j] - oy) * ty
        low = max(0.0, s1)
        high = min(se, s0)
        rim = w[_RIM + j]
        # Heights along the normal n = (ty, -tx), which points out of edge e.
        he = w[_EL + j] * (w[_ETX + j] * ty - w[_ETY + j] * tx)
        h0 = (w[_FX + j] - ox) * ty - (w[_FY + j] - oy) * tx
        h1 = (w[_GX + j] - ox) * ty - (w[_GY + j] - oy) * tx
        slip0, slip1 = w[_SLIP0 + j], w[_SLIP1 + j]
        fate = _TOUCHES
        # Pairs apart that never slid.
        if min(h0, h1) > max(0.0, he) and w[_PLAIN + j] != 0.0 and slip0 == 0.0 and slip1 == 0.0:
            fate = _APART
        # They are stretched by at least sqrt(3).
        if facing <= FACING_NONE or high - low <= 1.7 * rim:
            fate = _AWAY
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
        area = 0.5 * bearing(scale * (high - low), gap0, gap1, rim)
        if facing < FACING_FULL:
            area *= (facing - FACING_NONE) / (FACING_FULL - FACING_NONE)
        tx *= scale
        ty *= scale
        de *= stretch
        df *= stretch
        # Sliding speeds along the tangent, at both ends.
        ve = w[_EVX + j] * tx + w[_EVY + j] * ty
        ve2 = w[_DVX + j] * tx + w[_DVY + j] * ty
        vf = w[_FVX + j] * tx + w[_FVY + j] * ty
        vf2 = w[_GVX + j] * tx + w[_GVY + j] * ty
        gain0 = ksdt * (vf + beta0 * (vf2 - vf) - ve - alpha0 * (ve2 - ve))
        gain1 = ksdt * (vf + beta1 * (vf2 - vf) - ve - alpha1 * (ve2 - ve))
        tau0, slip0, sigma0, work0, end0 = _end_law(
            w[_TAU0 + j], slip0, w[_WHOLE0 + j] != 0.0, gap0 - w[_SEAT0 + j], gain0,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        tau1, slip1, sigma1, work1, end1 = _end_law(
            w[_TAU1 + j], slip1, w[_WHOLE1 + j] != 0.0, gap1 - w[_SEAT1 + j], gain1,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        w[_TAU0 + j] = tau0
        w[_TAU1 + j] = tau1
        w[_SLIP0 + j] = slip0
        w[_SLIP1 + j] = slip1
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
        w[_PX + j] = bt * tx + bn * ty
        w[_PY + j] = bt * ty - bn * tx
        w[_QX + j] = at * tx + an * ty
        w[_QY + j] = at * ty - an * tx
        w[_RX + j] = gt * tx + gn * ty
        w[_RY + j] = gt * ty - gn * tx
        w[_SX + j] = ct * tx + cn * ty
        w[_SY + j] = ct * ty - cn * tx
        w[_FATE + j] = fate
        w[_OVERLAP + j] = -0.5 * (gap0 + gap1)
        w[_GAP0 + j] = gap0
        w[_GAP1 + j] = gap1
        w[_WORK + j] = (work0 + work1) * area
        w[_END0 + j] = end0
        w[_END1 + j] = end1


@kernel(error_model="numpy", forceinline=True)
def _mark(mark, end, whole, brittle):
    """New mark of an end from its old one; brittle : whole joints that open are broken for good."""
    if mark == BROKEN or end == BROKEN:
        return BROKEN
    if end == OPEN:
        return BROKEN if whole and brittle else OPEN
    return STICK if end == STICK else SLIP


@kernel(error_model="numpy")
def _hand_out(w, rows, begin, stop, brittle, deepest, fn, node_end, far):
    """Take the results of a batch to rows begin to stop, nodes and the sums over batches; the pair that overlaps too much, or -1."""
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    whole_at_start = mark[:, INTACT]
    lost, largest = w[_LOST], w[_DEEPEST]
    j = -1
    for m in span(begin, stop):
        j += 1
        fate = w[_FATE + j]
        if fate == _AWAY:
            if mark[m, LIVE] == 1:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 0
            continue
        if fate == _APART:
            if mark[m, LIVE] == 0 or mark[m, 0] != OPEN or mark[m, 1] != OPEN:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 1
            continue
        if w[_OVERLAP + j] > deepest:
            if mark[m, LIVE] == 1:
                w[_LOST], w[_DEEPEST] = lost, w[_OVERLAP + j]
                return edge[m, PAIR]
            continue
        hold[m, 0] = w[_TAU0 + j]
        hold[m, 1] = w[_TAU1 + j]
        hold[m, 2] = w[_SLIP0 + j]
        hold[m, 3] = w[_SLIP1 + j]
        mark[m, 0] = _mark(mark[m, 0], w[_END0 + j], w[_WHOLE0 + j] != 0.0, brittle)
        mark[m, 1] = _mark(mark[m, 1], w[_END1 + j], w[_WHOLE1 + j] != 0.0, brittle)
        mark[m, LIVE] = 1
        lost += w[_WORK + j]
        largest = max(largest, -w[_GAP0 + j], -w[_GAP1 + j])
        e, f, d, g = edge[m, E], edge[m, F], edge[m, E_END], edge[m, F_END]
        fn[e, 0] += w[_PX + j]
        fn[e, 1] += w[_PY + j]
        fn[d, 0] += w[_QX + j]
        fn[d, 1] += w[_QY + j]
        if f < node_end:
            fn[f, 0] += w[_RX + j]
            fn[f, 1] += w[_RY + j]
            fn[g, 0] += w[_SX + j]
            fn[g, 1] += w[_SY + j]
        else:
            row = edge[m, FAR]
            far[row, 0] = w[_RX + j]
            far[row, 1] = w[_RY + j]
            far[row, 2] = w[_SX + j]
            far[row, 3] = w[_SY + j]
    w[_LOST], w[_DEEPEST] = lost, largest
    return -1


@kernel(error_model="numpy")
def contact_forces(rows, begin, stop, node, table, joint, deepest, dt, fn, node_end, far, sums):
    """Stress update and forces of the awake pairs; returns the pair that overlaps too much, or -1.

    rows begin to stop : all of set `joint` of table; node : node table
    fn : (nodes, 2) forces, added to [N/m]; those on the second edge, if it lies at or beyond node_end, go to their
    row of far (rows, 4) instead
    deepest : overlap above which a touching pair stops the run, and others are no contact [m]
    sums : [friction work, largest overlap], added to; the work that dilation gives back is not friction
    """
    w = np.zeros(WORK_SPACE)
    w[_DEEPEST] = sums[1]
    bad = -1
    brittle = table[joint, 4] > 0.0 or table[joint, 7] >= 0.0
    for first in range(begin, stop, LANES):
        last = min(first + LANES, stop)
        _collect(w, rows, first, last, node)
        _press_batch(w, table, joint, dt)
        bad = _hand_out(w, rows, first, last, brittle, deepest, fn, node_end, far)
        if bad >= 0:
            break
    sums[0] += w[_LOST]
    sums[1] = w[_DEEPEST]
    return bad
