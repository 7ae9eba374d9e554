"""Coulomb joints between blocks: contact of two nearly antiparallel edges over the interval that they share.

On the common tangent the edges overlap over a length L. At each end of it the overlap gives the normal stress
(total, so it never drifts) and the sliding gives the shear stress (incremental, kept per end); each end acts on
L / 2.
Area contact: sigma = kn (overlap + dilation), |tau| <= cohesion + sigma tan(phi).

Equal and opposite forces act at one point midway between the edges, so forces and moments balance to round-off.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.contact.nodes import LENGTH, RIM, TX, TY, X, Y
from graben.mechanics.compiled import kernel

# Edges count as facing each other up to 60 degrees, fully up to 45: forces fade in between.
FACING_NONE, FACING_FULL = 0.5, 0.7

# A chamfer bears on no more than this share of its length less than the interval that it shares with another edge:
# chamfers begin where their neighbour's contact ends, and would all touch by their rims, for next to no force.
RIM_SHARE = 0.1

STICK, SLIP, OPEN, BROKEN = 0, 1, 2, 3


class Joint(NamedTuple):
    """Properties of one set of joints (stresses in Pa, stiffness in Pa/m, angles as tangents, lengths in m).

    dilation_limit: net slip after which a joint dilates no more (infinite: never stops).
    tension holds for joints intact at the start, until broken in tension. residual_friction, residual_cohesion: of
    joints that are not intact (broken in tension or by slip, or met on the way); below 0: as for intact ones.
    closure: largest closure of a joint that stiffens hyperbolically from normal_stiffness on (Barton and Bandis),
    sigma = kn u / (1 - u / closure), up to STIFFENING times as stiff; 0: linear.
    face: the edge whose direction the contact takes, 1: the first, 2: the second, of lower and higher number; 0: both
    alike, as between two blocks. On a platen blocks that turn must not be pushed along.
    """

    normal_stiffness: float
    shear_stiffness: float
    friction: float
    cohesion: float
    tension: float
    dilation: float
    dilation_limit: float
    residual_friction: float = -1.0
    residual_cohesion: float = -1.0
    closure: float = 0.0
    face: int = 0

    @property
    def weakens(self) -> bool:
        """Whether slip breaks it for good."""
        return self.residual_friction >= 0.0 or self.residual_cohesion >= 0.0

    def weaker(self, factor: float) -> Joint:
        """The same with its strength over a factor; a joint never dilates more than it rubs.

        Residual values below 0, which stand for the others, stay below 0.
        """
        friction = self.friction / factor
        return self._replace(
            friction=friction,
            cohesion=self.cohesion / factor,
            tension=self.tension / factor,
            dilation=min(self.dilation, friction),
            residual_friction=self.residual_friction / factor,
            residual_cohesion=self.residual_cohesion / factor,
        )

    @property
    def stiffest(self) -> float:
        """Largest normal stiffness that it can have [Pa/m]."""
        return self.normal_stiffness * (STIFFENING if self.closure > 0.0 else 1.0)


# A closing joint is at most this much stiffer than at first; it is linear from there on.
STIFFENING = 10.0
_BEND = 1.0 - STIFFENING**-0.5


def joint_table(joints: Sequence[Joint]) -> np.ndarray:
    """Sets of joints as rows (sets, 11), in the order of `Joint`; residual values filled in."""
    rows = []
    for j in joints:
        residual = [max(j.residual_friction, -1.0), max(j.residual_cohesion, -1.0)]
        if j.weakens:
            whole = (j.friction, j.cohesion)
            residual = [r if r >= 0.0 else w for r, w in zip(residual, whole, strict=True)]
        rows.append([*j[:7], *residual, j.closure, j.face])
    return np.array(rows, dtype=float)


@kernel(error_model="numpy")
def closure_stress(u, kn, closure):
    """Stress [Pa] at a closure u > 0 [m] of a joint that stiffens, and the energy stored [J/m2]."""
    bend = _BEND * closure
    v = min(u, bend)
    stress = kn * v / (1.0 - v / closure)
    energy = kn * closure * (-v - closure * np.log(1.0 - v / closure))
    beyond = u - v
    return (
        stress + STIFFENING * kn * beyond,
        energy + (stress + 0.5 * STIFFENING * kn * beyond) * beyond,
    )


class Pairs(NamedTuple):
    """Candidate contacts, sorted by key = edge * edges + other edge, edge < other edge.

    key, first, second : (n,); shear : (n, 2) stress at both ends [Pa] on the first edge;
    slip : (n, 2) net plastic sliding [m]; flag : (n, 2) STICK, SLIP, OPEN, BROKEN; live : (n,) 1 once touching;
    intact : (n,) 1 while the joint of the first state holds; joint : (n,) set of joints.
    seat : (n, 2) closure [m] that both ends have where edges just meet, from in-situ stress; (0, 2): none anywhere.
    """

    key: np.ndarray
    first: np.ndarray
    second: np.ndarray
    shear: np.ndarray
    slip: np.ndarray
    flag: np.ndarray
    live: np.ndarray
    intact: np.ndarray
    joint: np.ndarray
    seat: np.ndarray = np.empty((0, 2))


@kernel(error_model="numpy")
def bearing(length, gap0, gap1, rim):
    """Length over which two edges bear that share an interval `length`: all of it, unless one is a chamfer.

    A plain edge keeps the half length of each end whole, as the reference model does. A chamfer stands for a
    rounded corner: its rim does not bear, nor does what lies beyond the point where the gap opens.
    """
    if rim == 0.0:
        return length
    share = 1.0 if gap0 * gap1 >= 0.0 else abs(min(gap0, gap1)) / abs(gap1 - gap0)
    return share * max(0.0, length - rim)


@kernel(error_model="numpy")
def _hand_to_nodes(fn, i, j, share, forcex, forcey, qx, qy):
    """A force at a share of the edge from node i to node j, and a couple: q at i, -q at j."""
    fn[i, 0] += (1.0 - share) * forcex + qx
    fn[i, 1] += (1.0 - share) * forcey + qy
    fn[j, 0] += share * forcex - qx
    fn[j, 1] += share * forcey - qy


@kernel(error_model="numpy")
def contact_state(pairs, follow, node, table, deepest, out, ints, fn):
    """State of all touching candidates, for output. Returns (their number, stored joint energy [J/m]).

    out : (n, 13) middle x, y [m]; force on the first edge x, y [N/m]; mean normal (tension positive) and shear
    stress [Pa]; length [m]; mean net slip [m]; mean opening [m]; unit tangent x, y; first moment of the force along
    the tangent about the middle x, y [N]: both ends carry their own force.
    ints : (n, 2) pair and state flag; fn : (nodes, 2) the same forces on the contact nodes, added to [N/m].
    """
    count = 0
    stored = 0.0
    for c in range(pairs.key.shape[0]):
        if pairs.live[c] == 0:
            continue
        e = pairs.first[c]
        f = pairs.second[c]
        j = pairs.joint[c]
        kn = table[j, 0]
        facing = -(node[e, TX] * node[f, TX] + node[e, TY] * node[f, TY])
        if facing <= FACING_NONE:
            continue
        f2 = follow[f]
        scale = 1.0 / np.sqrt(2.0 + 2.0 * facing)
        tx = (node[e, TX] - node[f, TX]) * scale
        ty = (node[e, TY] - node[f, TY]) * scale
        if table[j, 10] == 1.0:
            tx, ty = node[e, TX], node[e, TY]
        elif table[j, 10] == 2.0:
            tx, ty = -node[f, TX], -node[f, TY]
        ox = node[e, X]
        oy = node[e, Y]
        se = node[e, LENGTH] * (node[e, TX] * tx + node[e, TY] * ty)
        s0 = (node[f, X] - ox) * tx + (node[f, Y] - oy) * ty
        s1 = (node[f2, X] - ox) * tx + (node[f2, Y] - oy) * ty
        low = max(0.0, s1)
        high = min(se, s0)
        rim = node[e, RIM] + node[f, RIM]
        if high - low <= rim:
            continue
        rise = node[e, LENGTH] * (node[e, TX] * ty - node[e, TY] * tx) / se
        h0 = (node[f, X] - ox) * ty - (node[f, Y] - oy) * tx
        h1 = (node[f2, X] - ox) * ty - (node[f2, Y] - oy) * tx
        area = 0.5 * (high - low)
        if facing < FACING_FULL:
            area *= (facing - FACING_NONE) / (FACING_FULL - FACING_NONE)
        gap0 = h1 + (h0 - h1) * (low - s1) / (s0 - s1) - rise * low
        gap1 = h1 + (h0 - h1) * (high - s1) / (s0 - s1) - rise * high
        gaps = 0.5 * (gap0 + gap1)
        if -gaps > deepest:
            continue
        area *= bearing(high - low, gap0, gap1, rim) / (high - low)
        normal = 0.0
        shear = 0.0
        height = 0.0
        momentx = 0.0
        momenty = 0.0
        middle = 0.5 * (low + high)
        worst = STICK
        closed = 0
        for k in range(2):
            s = low if k == 0 else high
            front = h1 + (h0 - h1) * (s - s1) / (s0 - s1)
            gap = front - rise * s
            height += 0.25 * (front + rise * s)
            flag = pairs.flag[c, k]
            if flag == OPEN:
                continue
            closed_by = table[j, 5] * min(abs(pairs.slip[c, k]), table[j, 6]) - gap
            if pairs.seat.shape[0] > 0:
                closed_by += pairs.seat[c, k]
            sigma = kn * closed_by
            energy = 0.5 * sigma * closed_by
            if table[j, 9] > 0.0 and closed_by > 0.0:
                sigma, energy = closure_stress(closed_by, kn, table[j, 9])
            if flag == BROKEN and sigma <= 0.0:
                continue
            closed += 1
            normal -= 0.5 * sigma
            shear += 0.5 * pairs.shear[c, k]
            tau = pairs.shear[c, k]
            forcex = (tau * tx - sigma * ty) * area
            forcey = (tau * ty + sigma * tx) * area
            momentx += forcex * (s - middle)
            momenty += forcey * (s - middle)
            couple = 0.5 * gap * tau * area
            qe, qf = couple / se, couple / (s0 - s1)
            _hand_to_nodes(fn, e, follow[e], s / se, forcex, forcey, qe * ty, -qe * tx)
            _hand_to_nodes(fn, f, f2, (s0 - s) / (s0 - s1), -forcex, -forcey, -qf * ty, qf * tx)
            stored += area * (energy + 0.5 * pairs.shear[c, k] * pairs.shear[c, k] / table[j, 1])
            if flag == SLIP and worst == STICK:
                worst = SLIP
            if flag == BROKEN:
                worst = BROKEN
        out[count, 0] = ox + middle * tx + height * ty
        out[count, 1] = oy + middle * ty - height * tx
        out[count, 2] = 2.0 * area * (shear * tx + normal * ty)
        out[count, 3] = 2.0 * area * (shear * ty - normal * tx)
        out[count, 4] = normal
        out[count, 5] = shear
        out[count, 6] = 2.0 * area
        out[count, 7] = 0.5 * (pairs.slip[c, 0] + pairs.slip[c, 1])
        out[count, 8] = gaps
        out[count, 9] = tx
        out[count, 10] = ty
        out[count, 11] = momentx
        out[count, 12] = momenty
        ints[count, 0] = c
        ints[count, 1] = worst if closed > 0 else OPEN
        count += 1
    return count, stored
