"""Biaxial compression of a rectangle of blocks: consolidate under confinement, then move the top wall down."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.ends import Ends, Walls
from graben.mechanics.blocks.loading.pace import ForceCheck, Pace
from graben.mechanics.blocks.loading.protocol import Moment, State, refuse_unlike
from graben.mechanics.blocks.loading.rest import settle

# Steps between two looks for loose blocks.
_LOOSE_EVERY = 250


def consolidate(
    model: BlockModel,
    lateral: float,
    vertical: float,
    *,
    tolerance: float = 1e-3,
    chunk: int = 250,
    limit: int = 20000,
    ends: Ends | None = None,
) -> float:
    """Press left and right with `lateral`, the top with `vertical` [Pa, tension positive]; bottom on rollers.

    ends : what grips the rock instead of rollers and a wall

    Steps until the unbalanced force falls below `tolerance`; returns the ratio reached. Raises NumericsFailed when
    it does not within `limit` steps. The rising load becomes a pressure of 1 Pa on left and right, for courses.
    """
    (ends or Walls(model.bodies)).grip(model, lateral, vertical)
    advice = "strengthen the joints or lower the confining stress"
    ratios = settle(
        model, tolerance, BlockModel.unbalanced_ratio, limit=limit, where="consolidation", advice=advice, chunk=chunk
    )
    return [*ratios][-1]


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
    *,
    ramp_share: float = 0.01,
    saved: int = 0,
    courses: Courses | None = None,
    stop_loose: bool = False,
    paced: tuple[Pace, ForceCheck] | None = None,
    ends: Ends | None = None,
) -> Iterator[int]:
    """Move the top at `speed` [m/s, negative: down] for `steps` steps; gives the number of each of `states` states
    when the model is there.

    State 0 is the start. The speed rises over the first `ramp_share` of the steps. The pressure on the top is
    dropped: the wall now carries it. saved : states that a model brought back from a snapshot has behind it;
    courses : instead of speed and ramp; stop_loose : stop loose blocks every 250 steps, see
    `BlockModel.calm_loose_blocks`; paced : courses are followed as fast as forces allow, in the model's time;
    ends : as in `consolidate`
    """
    ends = ends or Walls(model.bodies)
    if courses is not None:
        speed = courses.fastest * (1.0 if paced is None else paced[1].fastest)
    if saved == 0:
        model.begin_ledger()
        yield 0
        saved = 1
    if saved == 1:
        ends.take_over(model, speed)
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
                model.add_time((rate - 1.0) * taken * model.dt)
                paced[0].look(model, paced[1], ends.bottom, ends.top)
        yield k


class Biaxial:
    """The test: a `Loading` whose arguments are those of `consolidate` and `compress`.

    pressure : on left and right, and vertical on the top until the wall takes over [Pa, tension positive]
    check : of forces; the loading then follows it, at a pace of its own
    ends : what grips the rock; rollers below and a wall above unless given
    """

    failed = False

    def __init__(
        self,
        model: BlockModel,
        *,
        pressure: float,
        vertical: float,
        speed: float,
        steps: int,
        states: int,
        tolerance: float = 1e-3,
        courses: Courses | None = None,
        stop_loose: bool = False,
        check: ForceCheck | None = None,
        ends: Ends | None = None,
    ) -> None:
        self.ends = ends or Walls(model.bodies)  # refuses any other outline before work begins
        self.model = model
        self.rest: np.ndarray = np.zeros(2)
        self.pace = None if check is None else Pace()
        self._saved = 0
        self._pressures, self._tolerance = (pressure, vertical), tolerance
        self._speed, self._steps, self._states = speed, steps, states
        self._courses, self._stop_loose, self._check = courses, stop_loose, check

    def begin(self) -> Iterator[Moment]:
        """Consolidate."""
        yield Moment(0.0, "consolidation")
        self.model.spare_joints(True)
        ratio = consolidate(self.model, *self._pressures, tolerance=self._tolerance, ends=self.ends)
        self.model.spare_joints(False)
        self.rest = np.array([ratio, self.model.steps_done])

    def run(self) -> Iterator[Moment]:
        """Compress; every moment is a saved state."""
        last = self._states - 1
        moments = compress(
            self.model,
            self._speed,
            self._steps,
            self._states,
            saved=self._saved,
            courses=self._courses,
            stop_loose=self._stop_loose,
            paced=None if self.pace is None or self._check is None else (self.pace, self._check),
            ends=self.ends,
        )
        for k in moments:
            self._saved = k + 1
            yield Moment(k / last, f"state {k} of {last}", save=True)

    def state(self) -> State:
        pace = {} if self.pace is None else {f"pace_{k}": np.array(v) for k, v in asdict(self.pace).items()}
        return {"rest": self.rest, "saved": np.array(self._saved), **pace}

    def bring_back(self, state: State) -> None:
        refuse_unlike(state, self.state())
        if not 1 <= state["saved"] <= self._states:
            raise Refused(f"test.saved: 1 to {self._states}")
        self.rest, self._saved = state["rest"], int(state["saved"])
        if self.pace is not None:
            self.pace = Pace(**{f.name: state[f"pace_{f.name}"].item() for f in fields(Pace)})
