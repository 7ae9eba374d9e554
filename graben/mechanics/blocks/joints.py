"""Coulomb joints between blocks: contact of two nearly antiparallel edges over the interval that they share.

On the common tangent the edges overlap over a length L. At each end of it the overlap gives the normal stress
(total, so it never drifts) and the sliding gives the shear stress (incremental, kept per end); each end acts on L / 2.
Area contact: sigma = kn (overlap + dilation), |tau| <= cohesion + sigma tan(phi).

Equal and opposite forces act at one point midway between the edges, so forces and moments balance to round-off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.compiled import kernel

# Edges count as facing each other up to 60 degrees, fully up to 45: forces fade in between.
FACING_NONE, FACING_FULL = 0.5, 0.7

STICK, SLIP, OPEN, BROKEN = 0, 1, 2, 3


class Joint(NamedTuple):
    """Properties of one set of joints (stresses in Pa, stiffness in Pa/m, angles as tangents, lengths in m).

    tension and cohesion hold for intact joints; once broken in tension a joint has no tension.
    dilation_limit: net slip after which a joint dilates no more (infinite: never stops).
    """

    normal_stiffness: float
    shear_stiffness: float
    friction: float
    cohesion: float
    tension: float
    dilation: float
    dilation_limit: float


class Pairs(NamedTuple):
    """Candidate contacts, sorted by key = edge * edges + other edge, edge < other edge.

    key, first, second : (n,); shear : (n, 2) stress at both ends [Pa] on the first edge;
    slip : (n, 2) net plastic sliding [m]; flag : (n, 2) STICK, SLIP, OPEN, BROKEN; live : (n,) 1 once touching;
    intact : (n,) 1 while the joint of the first state holds.
    """

    key: np.ndarray
    first: np.ndarray
    second: np.ndarray
    shear: np.ndarray
    slip: np.ndarray
    flag: np.ndarray
    live: np.ndarray
    intact: np.ndarray


@kernel
def node_motion(x, v, first, second, weight, follow, xn, vn, tangent):
    """Positions, velocities of the contact nodes and (unit tangent, length) of the edges that start there."""
    for i in range(first.shape[0]):
        a = first[i]
        b = second[i]
        w = weight[i]
        for d in range(2):
            xn[i, d] = x[a, d] + w * (x[b, d] - x[a, d])
            vn[i, d] = v[a, d] + w * (v[b, d] - v[a, d])
    for i in range(first.shape[0]):
        j = follow[i]
        dx = xn[j, 0] - xn[i, 0]
        dy = xn[j, 1] - xn[i, 1]
        length = np.sqrt(dx * dx + dy * dy)
        inverse = 1.0 / length
        tangent[i, 0] = dx * inverse
        tangent[i, 1] = dy * inverse
        tangent[i, 2] = length


@kernel
def scatter_nodes(fn, first, second, weight, force):
    """Hand the forces on contact nodes back to the vertices that they blend."""
    for i in range(first.shape[0]):
        a = first[i]
        b = second[i]
        w = weight[i]
        for d in range(2):
            force[a, d] += (1.0 - w) * fn[i, d]
            force[b, d] += w * fn[i, d]


@kernel
def contact_forces(active, pairs, follow, xn, vn, tangent, joint, deepest, dt, fn, sums):
    """Stress update and forces of the active candidates; returns the pair that overlaps too much, or -1.

    active : (m,) indices into pairs; fn : (nodes, 2) forces, added to [N/m]
    deepest : overlap above which a touching pair stops the run, and others are no contact [m]
    sums : [friction work, stored joint energy, largest overlap], the last two reset here
    """
    kn = joint.normal_stiffness
    ks = joint.shear_stiffness
    stored = 0.0
    friction_work = 0.0
    largest = 0.0
    for m in range(active.shape[0]):
        c = active[m]
        e = pairs.first[c]
        f = pairs.second[c]
        facing = -(tangent[e, 0] * tangent[f, 0] + tangent[e, 1] * tangent[f, 1])
        if facing <= FACING_NONE:
            pairs.shear[c, 0] = 0.0
            pairs.shear[c, 1] = 0.0
            pairs.flag[c, 0] = OPEN
            pairs.flag[c, 1] = OPEN
            pairs.live[c] = 0
            continue
        e2 = follow[e]
        f2 = follow[f]
        scale = 1.0 / np.sqrt(2.0 + 2.0 * facing)
        tx = (tangent[e, 0] - tangent[f, 0]) * scale
        ty = (tangent[e, 1] - tangent[f, 1]) * scale
        ox = xn[e, 0]
        oy = xn[e, 1]
        # Along the tangent: edge e runs from 0 to se, edge f from s1 (its end) to s0 (its start).
        se = tangent[e, 2] * (tangent[e, 0] * tx + tangent[e, 1] * ty)
        s0 = (xn[f, 0] - ox) * tx + (xn[f, 1] - oy) * ty
        s1 = (xn[f2, 0] - ox) * tx + (xn[f2, 1] - oy) * ty
        low = max(0.0, s1)
        high = min(se, s0)
        length = high - low
        if length <= 0.0:
            pairs.shear[c, 0] = 0.0
            pairs.shear[c, 1] = 0.0
            pairs.flag[c, 0] = OPEN
            pairs.flag[c, 1] = OPEN
            pairs.live[c] = 0
            continue
        # Heights along the normal n = (ty, -tx), which points out of edge e.
        he = tangent[e, 2] * (tangent[e, 0] * ty - tangent[e, 1] * tx)
        h0 = (xn[f, 0] - ox) * ty - (xn[f, 1] - oy) * tx
        h1 = (xn[f2, 0] - ox) * ty - (xn[f2, 1] - oy) * tx
        de = 1.0 / se
        df = 1.0 / (s0 - s1)
        gap0 = h1 + (h0 - h1) * (low - s1) * df - he * low * de
        gap1 = h1 + (h0 - h1) * (high - s1) * df - he * high * de
        overlap = -0.5 * (gap0 + gap1)
        if overlap > deepest:
            if pairs.live[c] == 1:
                sums[0] += friction_work
                sums[1] = stored
                sums[2] = overlap
                return c
            continue
        pairs.live[c] = 1
        area = 0.5 * length
        if facing < FACING_FULL:
            area *= (facing - FACING_NONE) / (FACING_FULL - FACING_NONE)
        fex0 = 0.0
        fey0 = 0.0
        fex1 = 0.0
        fey1 = 0.0
        ffx0 = 0.0
        ffy0 = 0.0
        ffx1 = 0.0
        ffy1 = 0.0
        for k in range(2):
            s = low if k == 0 else high
            gap = gap0 if k == 0 else gap1
            slip = pairs.slip[c, k]
            open_by_dilation = joint.dilation * min(abs(slip), joint.dilation_limit)
            sigma = kn * (open_by_dilation - gap)
            tension = joint.tension if pairs.intact[c] == 1 and pairs.flag[c, k] != BROKEN else 0.0
            if sigma <= -tension:
                pairs.shear[c, k] = 0.0
                if pairs.flag[c, k] != BROKEN:
                    pairs.flag[c, k] = BROKEN if pairs.intact[c] == 1 and tension > 0.0 else OPEN
                continue
            alpha = s * de
            beta = (s0 - s) * df
            vx = vn[f, 0] + beta * (vn[f2, 0] - vn[f, 0]) - vn[e, 0] - alpha * (vn[e2, 0] - vn[e, 0])
            vy = vn[f, 1] + beta * (vn[f2, 1] - vn[f, 1]) - vn[e, 1] - alpha * (vn[e2, 1] - vn[e, 1])
            tau = pairs.shear[c, k] + ks * dt * (vx * tx + vy * ty)
            strength = joint.cohesion + sigma * joint.friction
            if strength < 0.0:
                strength = 0.0
            flag = STICK
            if abs(tau) > strength:
                limited = strength if tau > 0.0 else -strength
                slid = (tau - limited) / ks
                friction_work += abs(limited * slid) * area
                tau = limited
                pairs.slip[c, k] = slip + slid
                flag = SLIP
            if pairs.flag[c, k] != BROKEN:
                pairs.flag[c, k] = flag
            pairs.shear[c, k] = tau
            stored += 0.5 * area * (sigma * sigma / kn + tau * tau / ks)
            if -gap > largest:
                largest = -gap
            # Traction on edge e: -sigma n + tau t, at a point midway between the edges. Seen from a point of
            # edge e this adds a couple, carried by opposite normal forces at the ends of that edge.
            forcex = (tau * tx - sigma * ty) * area
            forcey = (tau * ty + sigma * tx) * area
            couple = 0.5 * gap * tau * area
            qe = couple * de
            qf = -couple * df
            fex0 += (1.0 - alpha) * forcex + qe * ty
            fey0 += (1.0 - alpha) * forcey - qe * tx
            fex1 += alpha * forcex - qe * ty
            fey1 += alpha * forcey + qe * tx
            ffx0 -= (1.0 - beta) * forcex - qf * ty
            ffy0 -= (1.0 - beta) * forcey + qf * tx
            ffx1 -= beta * forcex + qf * ty
            ffy1 -= beta * forcey - qf * tx
        fn[e, 0] += fex0
        fn[e, 1] += fey0
        fn[e2, 0] += fex1
        fn[e2, 1] += fey1
        fn[f, 0] += ffx0
        fn[f, 1] += ffy0
        fn[f2, 0] += ffx1
        fn[f2, 1] += ffy1
    sums[0] += friction_work
    sums[1] = stored
    sums[2] = largest
    return -1
