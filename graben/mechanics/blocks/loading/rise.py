"""A load that rises until the body fails, as if a stiff frame held it: past the failure it falls with the body.

A dead load runs away with what fails under it, and inertia then bears a part of it. Here the loaded ground may move
no faster than it moves under an even rise. With s the load in seconds of even rise, P the power of a load that grows
by one a second, and C the largest way per second so far (the secant compliance),

    ds/dt = 1 + G (1 - P / C).

While the body answers as it did, P = C and the load rises at its rate; where it softens, the load rises more slowly;
where it fails, the load falls. Integrated over time the second part is a spring between the ground and a frame that
moves evenly, G times as stiff as the body. The compiled loop applies it in every step, so it feeds no swings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.loads import Loads, settlement_of
from graben.mechanics.blocks.loading.resistance import Resistance
from graben.mechanics.blocks.loading.rest import imbalance

# Share of the whole rise over which a load sets in, and after which its compliance is known.
_SET_IN = 0.02

# A load of so much more than another one is hardly more.
_HARDLY = 1.002

# Under a dead load the ground runs away at so many times the largest way per second so far.
_RUNS = 10.0

# The frame adds at most this share to the squared frequency that the time step bears.
_STABLE = 0.25


@dataclass(frozen=True)
class Control:
    """frame : stiffness of the frame over that of the body; 0: dead loads

    beyond : the test ends when the ground has gone this much further than at the largest load, over its way there
    patience : most steps, over those of an even rise
    """

    frame: float = 10.0
    beyond: float = 1.0
    patience: float = 8.0


@dataclass
class Rise:
    """Where a rising load stands.

    load_time : load, in seconds of even rise; start : load time at which rates of loads last changed
    since : that from which the model's load counts, at which blocks were dug out last; way_since : the way there
    settlement : m, displacement along the loads, weighted by them; imbalance : as of `rest.imbalance`
    way : work per unit of load from start on [J s/m]; resisted : energy that inertia and damping took up [J/m]
    compliance : largest way per second of rise; speed : way per second now, over it
    largest : the largest load since then
    reached, way_there : the load that was hardly surpassed since, and the way there
    steps : taken
    failed : whether the ground went on without more load, or blocks fell; fell : the latter
    """

    load_time: float = 0.0
    start: float = 0.0
    since: float = 0.0
    way_since: float = 0.0
    settlement: float = 0.0
    imbalance: float = 0.0
    way: float = 0.0
    resisted: float = 0.0
    compliance: float = 0.0
    speed: float = 0.0
    largest: float = 0.0
    reached: float = 0.0
    way_there: float = 0.0
    steps: int = 0
    failed: bool = False
    fell: bool = False

    def begin(self, load_time: float) -> None:
        """Rates change: what the body answered before says nothing of what it will."""
        self.start = self.reached = load_time
        self.way = self.way_there = self.compliance = self.speed = 0.0
        self.dig(load_time)

    def dig(self, load_time: float) -> None:
        """The body changes; the loads go on as before."""
        self.load_time = self.since = self.largest = load_time
        self.way_since = self.way


def raise_load(
    model: BlockModel,
    loads: Loads,
    rise: Rise,
    control: Control,
    resistance: Resistance,
    *,
    end: float,
    stop: float,
    reference: np.ndarray,
) -> None:
    """One chunk of steps, which brings `rise` and `resistance` up to date.

    end : load time at which the rise is complete [s]; stop : load time that the chunk must not run past, nor does it
    run past points of courses; reference : positions settlement counts from
    """
    dt, point = model.dt, loads.next_point(rise.since)
    left = max(1.0, np.rint((min(stop, point, end) - rise.load_time) / dt))
    # Looks come close enough that the load changes by a thousandth between two of them.
    chunk = int(min(left, np.clip(1e-3 * rise.load_time / dt, 5, 100)))
    model.raise_load(*_rate(model, rise, control, end))
    gone, seconds = _advance(model, rise, resistance, chunk, loads.direction, reference)
    model.raise_load(0.0)
    rise.load_time = rise.since + model.load_factor
    # The rise is complete at its end: what is held then is what rose last.
    if point < end and rise.load_time > point - 0.5 * dt:
        loads.begin(model, point)
        rise.begin(point)
        return
    on = rise.load_time - rise.since
    rise.largest = max(rise.largest, rise.load_time)
    if rise.load_time - rise.start > _HARDLY * (rise.reached - rise.start):
        rise.reached, rise.way_there = rise.load_time, rise.way
    if on > _SET_IN * end:
        rise.compliance = max(rise.compliance, (rise.way - rise.way_since) / on)
    if rise.compliance > 0.0:
        rise.speed = gone / seconds / rise.compliance
        rise.failed = _went_on(rise, control, end)


def hold_load(
    model: BlockModel,
    rise: Rise,
    control: Control,
    resistance: Resistance,
    *,
    steps: int,
    end: float,
    direction: np.ndarray,
    reference: np.ndarray,
) -> None:
    """A chunk of steps under loads that stay, which brings `rise` and `resistance` up to date; rest as above."""
    gone, seconds = _advance(model, rise, resistance, steps, direction, reference)
    if rise.compliance > 0.0:
        rise.speed = gone / seconds / rise.compliance
        rise.failed = _went_on(rise, control, end)


def _advance(
    model: BlockModel, rise: Rise, resistance: Resistance, steps: int, direction: np.ndarray, reference: np.ndarray
) -> tuple[float, float]:
    """Take steps; returns the way in them, and the seconds."""
    way = model.way
    model.advance(steps)
    resistance.look(model)
    rise.resisted += resistance.work
    rise.steps += steps
    rise.way += model.way - way
    rise.settlement = settlement_of(direction, model.motion.x - reference)
    rise.imbalance = imbalance(model)
    return model.way - way, steps * model.dt


def _went_on(rise: Rise, control: Control, end: float) -> bool:
    """Whether the ground has gone further than it had at the largest load, by the share allowed.

    A dead load only grows: the ground runs away under it. Nobody knows while a load sets in.
    """
    known = rise.largest - rise.since > _SET_IN * end
    runs = control.frame == 0.0 and rise.speed > _RUNS
    return known and (runs or rise.way > (1.0 + control.beyond) * rise.way_there)


def _rate(model: BlockModel, rise: Rise, control: Control, end: float) -> tuple[float, float]:
    """What the load grows by in a step, and by how much less per unit of its way."""
    dt = model.dt
    set_in = (rise.largest - rise.since) / (_SET_IN * end)
    if rise.compliance <= 0.0 or set_in <= 1.0:
        # A load that sets in at once makes the body swing, and so does digging.
        return dt * min(1.0, 0.02 + 2.0 * set_in), 0.0
    mobility = model.mobility()
    frame = control.frame
    if mobility > 0.0:
        frame = min(frame, _STABLE * rise.compliance / (dt**2 * mobility))
    return dt * (1.0 + frame), frame / rise.compliance
