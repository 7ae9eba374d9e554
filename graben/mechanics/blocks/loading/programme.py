"""Loads on any outline: supports, weight and steady pressures first, then pressures that rise until failure.

Loads are dead: they keep the direction and the length of the outline's first shape. They rise at their rate as long
as the blocks keep up, wait while they do not, and the rock has failed when waiting does not bring it to rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.loads import Loads
from graben.mechanics.blocks.shape.bodies import Bodies

# Rest comes soonest with more damping than a rising load should feel.
_SETTLING_DAMPING = 1.0

# Settlement that runs this many times as fast as at first, while the load waits, is a collapse: no need for patience.
_COLLAPSE = 300.0


def on_segment(bodies: Bodies, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vertices (flags) on the outline that lie on a segment (start, end: (2,) m)."""
    d = np.asarray(end, float) - np.asarray(start, float)
    r = bodies.position - start
    size = float(np.ptp(bodies.outline, axis=0).max())
    along = np.clip((r @ d) / float(d @ d), 0.0, 1.0)
    near = np.linalg.norm(r - along[:, None] * d, axis=1) < 1e-6 * size
    return near & bodies.vertex_side.any(axis=1)


def pressure_forces(bodies: Bodies, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vertex forces (vertices, 2) [N/m] of a pressure of 1 Pa on the part of the outline along a segment.

    Edges that the segment covers in part take their part, with its moment. Refused when it covers none.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    d = end - start
    length = float(np.linalg.norm(d))
    tangent = d / length
    size = float(np.ptp(bodies.outline, axis=0).max())
    on = bodies.edge_side >= 0
    a, b = bodies.edge_from[on], bodies.edge_to[on]
    p, q = bodies.position[a] - start, bodies.position[b] - start
    off = np.maximum(*(np.abs(r[:, 0] * tangent[1] - r[:, 1] * tangent[0]) for r in (p, q)))
    sp, sq = p @ tangent, q @ tangent
    beside = (off < 1e-6 * size) & (np.minimum(sp, sq) < length) & (np.maximum(sp, sq) > 0.0)
    a, b, sp, sq = a[beside], b[beside], sp[beside], sq[beside]
    if len(a) == 0:
        raise Refused("a segment on the outline; no part of the outline lies on it")
    # Covered part of each edge, as fractions of it from its first vertex.
    f0, f1 = np.clip((0.0 - sp) / (sq - sp), 0.0, 1.0), np.clip((length - sp) / (sq - sp), 0.0, 1.0)
    f0, f1 = np.minimum(f0, f1), np.maximum(f0, f1)
    to_b = 0.5 * (f1**2 - f0**2)
    to_a = (f1 - f0) - to_b
    edge = bodies.position[b] - bodies.position[a]
    inward = np.column_stack([-edge[:, 1], edge[:, 0]])
    force = np.zeros_like(bodies.position)
    np.add.at(force, a, to_a[:, None] * inward)
    np.add.at(force, b, to_b[:, None] * inward)
    return force


def imbalance(model: BlockModel) -> float:
    """Mean size of unbalanced forces on free vertices over the mean size of zone forces.

    Unlike the largest unbalanced force it does not hang on one small block.
    """
    scale = float(np.hypot(*model.motion.zone_force.T).mean())
    return float(np.hypot(*model.unbalanced_force().T).mean()) / scale if scale > 0.0 else np.inf


def come_to_rest(
    model: BlockModel,
    tolerance: float,
    tell: Callable[[float, int], None] = lambda ratio, steps: None,
    *,
    chunk: int = 250,
    limit: int = 100_000,
) -> float:
    """Step under the loads as they are until `imbalance` falls below `tolerance`; returns what it reached.

    tell : gets the imbalance and the number of steps after every chunk

    Raises NumericsFailed when it does not within `limit` steps: the body does not stand.
    """
    ratio = np.inf
    damping = model.damping
    model.damp(Damping(ratio=_SETTLING_DAMPING))
    for _ in range(0, limit, chunk):
        model.advance(chunk)
        ratio = imbalance(model)
        tell(ratio, model.steps_done)
        if ratio < tolerance:
            model.damp(damping)
            return ratio
    raise NumericsFailed(
        f"unbalanced force ratio {ratio:.3g} (limit {tolerance:.3g})",
        where="rest under weight and steady pressures",
        step=model.steps_done,
        advice="the body does not stand; strengthen the joints or support it",
    )


@dataclass(frozen=True)
class Control:
    """When rising loads wait, and when waiting means failure.

    calm : the loads rise while `imbalance` is below this
    patience : steps of waiting after which the rock has failed, if its settlement still runs faster than at the start
    of loading; four times as many where it does not (then something else than the loaded ground gives way); at once
    where it runs 300 times as fast
    chunk : steps between two looks
    """

    calm: float
    patience: int
    chunk: int = 100


@dataclass
class Rise:
    """Where a rising load stands.

    load_time : s of rise so far, waiting not counted; since : load time at which rates of loads last changed
    settlement : m, displacement along the loads, weighted by them
    speed, first_speed : of the settlement, now and in the first per cent of the rise [m/s]
    waited, waited_in_all : steps; failed : whether the last wait was in vain
    """

    load_time: float = 0.0
    since: float = 0.0
    settlement: float = 0.0
    speed: float = 0.0
    first_speed: float = 0.0
    imbalance: float = 0.0
    waited: int = 0
    waited_in_all: int = 0
    failed: bool = False


def look_at(
    model: BlockModel,
    rise: Rise,
    control: Control,
    loads: Loads,
    end: float,
    reference: np.ndarray,
    stop: float = np.inf,
) -> None:
    """One chunk of steps; the loads rise in it if the blocks kept up in the last one. Brings `rise` up to date.

    end : load time at which the rise is complete [s]; reference : vertex positions that settlement counts from
    stop : load time that the chunk must not run past; it does not run past points of courses either
    """
    calm, chunk = rise.imbalance < control.calm, control.chunk
    point = loads.next_point(rise.since)
    if calm:
        left = (min(stop, point) - rise.load_time) / model.dt
        chunk = int(min(chunk, max(1.0, np.rint(left))))
    model.raise_load(model.dt if calm else 0.0)
    model.advance(chunk)
    model.raise_load(0.0)
    rise.load_time = rise.since + model.load_factor
    if rise.load_time > point - 0.5 * model.dt:
        rise.since = rise.load_time = point
        loads.begin(model, point)
    settlement = settlement_of(loads.direction, model.motion.x - reference)
    rise.speed = (settlement - rise.settlement) / (chunk * model.dt)
    rise.settlement = settlement
    rise.imbalance = imbalance(model)
    if calm:
        rise.waited = 0
        if rise.load_time <= 0.01 * end or rise.first_speed == 0.0:
            rise.first_speed = settlement / rise.load_time
        return
    rise.waited += chunk
    rise.waited_in_all += chunk
    sinking = rise.speed > rise.first_speed
    collapsing = rise.first_speed > 0.0 and rise.speed > _COLLAPSE * rise.first_speed
    rise.failed = collapsing or rise.waited >= (control.patience if sinking else 4 * control.patience)


def settlement_of(direction: np.ndarray, moved: np.ndarray) -> float:
    """Displacement along the loads [m]; where no load changes, the mean distance that vertices went."""
    whole = float(np.hypot(*direction.T).sum())
    return float((direction * moved).sum() / whole) if whole > 0.0 else float(np.hypot(*moved.T).mean())
