"""Biaxial compression of a block assembly: consolidate under confinement, then move the top wall down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.pace import ForceCheck, Pace

# Rest comes soonest with more damping than a moving wall should feel.
_CONSOLIDATION_DAMPING = 1.0

# Steps between two looks for loose blocks.
_LOOSE_EVERY = 250


@dataclass(frozen=True)
class Sides:
    """Sides of the outline by their direction: indices of bottom, right, top and left."""

    bottom: int
    right: int
    top: int
    left: int


def rectangle_sides(outline: np.ndarray) -> Sides:
    """Sides of an upright rectangle (4, 2), counter-clockwise; Refused for anything else."""
    d = np.roll(outline, -1, axis=0) - outline
    if len(outline) != 4 or np.any(np.abs(d[:, 0] * d[:, 1]) > 1e-6 * np.abs(d).max() ** 2):
        raise Refused("an upright rectangle as domain of biaxial compression")
    return Sides(int(np.argmax(d[:, 0])), int(np.argmax(d[:, 1])), int(np.argmin(d[:, 0])), int(np.argmin(d[:, 1])))


def consolidate(
    model: BlockModel,
    lateral: float,
    vertical: float,
    *,
    tolerance: float = 1e-3,
    chunk: int = 250,
    limit: int = 20000,
) -> float:
    """Press left and right with `lateral`, the top with `vertical` [Pa, tension positive]; bottom on rollers.

    Steps until the unbalanced force falls below `tolerance`; returns the ratio reached. Raises NumericsFailed when
    it does not within `limit` steps. The rising load becomes a pressure of 1 Pa on left and right, for courses.
    """
    b = model.bodies
    sides = rectangle_sides(b.outline)
    model.hold(b.vertex_side[:, sides.bottom], 1)
    for side in (sides.left, sides.right):
        model.press(b.edge_side == side, lateral)
        model.press(b.edge_side == side, -1.0, rising=True)
    model.press(b.edge_side == sides.top, vertical)
    ratio = np.inf
    damping = model.damping
    model.damp(Damping(ratio=_CONSOLIDATION_DAMPING))
    for _ in range(0, limit, chunk):
        model.advance(chunk)
        ratio = model.unbalanced_ratio()
        if ratio < tolerance:
            model.damp(damping)
            return ratio
    raise NumericsFailed(
        f"unbalanced force ratio {ratio:.3g} (limit {tolerance:.3g})",
        where="consolidation",
        step=model.steps_done,
        advice="strengthen the joints or lower the confining stress",
    )


@dataclass(frozen=True)
class Courses:
    """What the walls do over steps of loading, where it is more than a steady speed.

    speed : of the top [m/s, positive: up]; pressure : on left and right [Pa], or None: as consolidated
    """

    speed: Course
    pressure: Course | None = None

    @property
    def fastest(self) -> float:
        """Largest speed in either direction [m/s]."""
        return float(np.abs(self.speed.values).max())

    def next_point(self, done: float) -> float:
        """Step of the next point after step `done`."""
        points = [c.next_point(done) for c in (self.speed, self.pressure) if c is not None]
        return min(points)

    def drive(self, model: BlockModel, done: float, pace: float, top_speed: float) -> None:
        """Set wall speed (over top_speed) and pressure for steps that follow step `done`, each worth `pace` steps."""
        scale = pace / top_speed
        # The speed in the middle of a step moves the wall by just what the course says.
        slope = self.speed.slope(done) * pace * scale
        model.set_speed(self.speed.at(done) * scale + 0.5 * slope, slope)
        if self.pressure is not None:
            model.set_load(self.pressure.at(done) - self.pressure.values[0], self.pressure.slope(done) * pace)


def compress(
    model: BlockModel,
    speed: float,
    steps: int,
    states: int,
    save: Callable[[int, BlockModel], None],
    *,
    ramp_share: float = 0.01,
    saved: int = 0,
    courses: Courses | None = None,
    stop_loose: bool = False,
    paced: tuple[Pace, ForceCheck] | None = None,
) -> None:
    """Move the top at `speed` [m/s, negative: down] for `steps` steps; call save(k, model) at `states` states.

    State 0 is the start. The speed rises over the first `ramp_share` of the steps. The pressure on the top is
    dropped: the wall now carries it. saved : states that a model brought back from a snapshot has behind it;
    courses : instead of speed and ramp; stop_loose : stop loose blocks every 250 steps, see
    `BlockModel.calm_loose_blocks`; paced : courses are followed as fast as forces allow, in the model's time
    """
    b, sides = model.bodies, rectangle_sides(model.bodies.outline)
    top = b.vertex_side[:, sides.top]
    if courses is not None:
        speed = courses.fastest * (1.0 if paced is None else paced[1].fastest)
    if saved == 0:
        model.begin_ledger()
        save(0, model)
        saved = 1
    if saved == 1:
        model.take_off_steady(top, 1)
        model.hold(top, 1, speed)
        model.set_speed(0.0, 1.0 / max(1.0, ramp_share * steps))
    for k in range(saved, states):
        begin, end = (round(steps * j / (states - 1)) for j in (k - 1, k))
        done = float(begin)
        while done < end:
            left = (end if courses is None else min(end, courses.next_point(done))) - done
            wanted, rate = (round(left), 1.0) if paced is None else paced[0].next_steps(paced[1], left)
            taken = min(wanted, _LOOSE_EVERY) if stop_loose else wanted
            if courses is not None:
                courses.drive(model, done, rate, speed)
            model.advance(taken)
            done = round(done + left) if taken * rate > left - 1e-9 else done + taken * rate
            if stop_loose:
                model.calm_loose_blocks()
            if paced is not None:
                model.time += (rate - 1.0) * taken * model.dt
                paced[0].look(model, paced[1], b.vertex_side[:, sides.bottom], top)
        save(k, model)
