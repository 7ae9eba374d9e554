"""Weight, pressures and digging as a scene's [programme] describes them: the test, and what is reported of it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading import programme as mechanics
from graben.mechanics.blocks.loading.courses import Clock, Course
from graben.mechanics.blocks.loading.excavation import Dig, blocks_in
from graben.mechanics.blocks.loading.failure import static_load
from graben.mechanics.blocks.loading.holds import Holds
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces, settlement_of
from graben.mechanics.blocks.loading.rise import Control
from graben.mechanics.blocks.record.history import History
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Excavation, Load, Programme
from graben.stages.blocks.report import energy_error, energy_measure, kinetic_measure, kinetic_share
from graben.stages.shared.measures import Measure, number


def programme(scene: BlocksScene, model: BlockModel, steps: int) -> mechanics.Programme:
    """Supports are put on the model, and the test is made. BadInput where a segment is not on the outline.

    steps : of the whole rise
    """
    assert scene.programme is not None
    p, b, file = scene.programme, model.bodies, str(scene.source.path)
    faults = []
    for k, support in enumerate(p.supports):
        at = on_segment(b, np.array(support.start), np.array(support.end))
        if not at.any():
            expected = "a segment that holds a part of the outline"
            faults.append(Fault(file, f"programme.supports.{k}", support.name, expected))
        for axis, name in enumerate("xy"):
            if support.fix in (name, "both"):
                model.hold(at, axis)
    loads, clock = Loads(len(b.position)), clock_of(p)
    for k, load in enumerate(p.loads):
        try:
            unit = pressure_forces(b, np.array(load.start), np.array(load.end))
        except Refused as error:
            faults.append(Fault(file, f"programme.loads.{k}", load.name, f"a segment of the outline ({error})"))
            continue
        loads.add(unit, clock.stretched(_course(load)))
    digs = [_dig(dig, clock) for dig in p.excavations]
    for k, dig in enumerate(digs):
        if not blocks_in(model, dig.polygon).any():
            expected = "a polygon that holds the middle of a block"
            faults.append(Fault(file, f"programme.excavations.{k}", p.excavations[k].name, expected))
    if faults:
        raise BadInput(faults)
    control = Control(p.frame, p.beyond)
    options: dict[str, Any] = {
        "end": clock.end,
        "save_every": p.save_every,
        "tolerance": scene.numerics.consolidation_tolerance,
        "may_fall": p.falling,
        **({"set_in": 0} if scene.in_situ is not None else {}),
    }
    if p.bracket is None and not p.strength_reduction:
        return mechanics.Programme(model, loads, control, digs=digs, **options)
    steps = round(steps * clock.end / p.end)
    width = _WIDTH if p.bracket is None else p.bracket
    return Holds(model, loads, control, steps=steps, width=width, weaken=p.strength_reduction, **options)


def _dig(dig: Excavation, clock: Clock) -> Dig:
    time = clock.reading(dig.time)
    return Dig(np.array(dig.polygon), time, clock.reading(dig.time + dig.relax_over) - time)


def clock_of(p: Programme) -> Clock:
    """A load that jumps may bring the body down anywhere in between, so tests go by a clock on which none does."""
    return Clock([_course(load) for load in p.loads], p.end, _JUMP * p.end)


# What a jump of a load takes of the time of even rise.
_JUMP = 0.1

# Width of the bracket of a factor of safety, where the scene says nothing.
_WIDTH = 0.02


_FAILURE = (
    "failure_load_pa",
    "failure_load_low_pa",
    "failure_load_high_pa",
    "failure_settlement_m",
    "inertia_over_load",
    "failure_load_width",
    "overshoot",
)


# What a failure load differs by where a test is repeated with other steps, and inertia has no share in it.
_REPEATS = 0.005


class ProgrammeReport:
    """See `Report`."""

    errors: ClassVar[tuple[str, ...]] = ("energy_error", "kinetic_over_stored_energy", "inertia_over_load")

    def __init__(self, scene: BlocksScene, test: mechanics.Programme) -> None:
        assert scene.programme is not None
        self.programme, self.test, self.model = scene.programme, test, test.model
        self._weight = test.model.weight.copy()  # before anything is taken out
        self._clock = clock_of(scene.programme)

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""
        looks = self.test.look_table()
        surface = self._surface()
        return {
            "confining_stress": np.array(0.0),
            "load_time": self._clock.time(np.array(self.test.load_times[: len(history.time)])),
            "look_load_time": self._clock.time(looks[:, 0]),
            "look_settlement": looks[:, 1],
            "look_imbalance": looks[:, 2],
            "look_load_at_rest": self._clock.time(static_load(looks[:, 0], looks[:, 3], looks[:, 4])),
            "surface_vertex": surface,
            "surface_carried_displacement": (self.test.carried - history.reference)[surface],
        }

    def _surface(self) -> np.ndarray:
        """Vertices of outline edges that no support holds at both ends, along the outline."""
        b = self.model.bodies
        held = np.asarray(self.model.held.any(axis=1))
        edge = np.flatnonzero((b.edge_side >= 0) & ~(held[b.edge_from] & held[b.edge_to]))
        length = np.linalg.norm(np.roll(b.outline, -1, axis=0) - b.outline, axis=1)
        begin = np.concatenate([[0.0], np.cumsum(length)])
        side = b.edge_side[edge]
        found, arc = [], []
        for ends in (b.edge_from[edge], b.edge_to[edge]):
            found.append(ends)
            arc.append(begin[side] + np.linalg.norm(b.position[ends] - b.outline[side], axis=1))
        vertex, where = np.concatenate(found), np.concatenate(arc)
        return vertex[np.lexsort((vertex, where))].astype(np.int32)

    def headline(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Failure load (Pa; null where the end came first), settlement of the loaded ground, error measures."""
        rise, test = self.test.rise, self.test
        reference = arrays["vertex_position"]
        course = next((c for c in map(_course, self.programme.loads) if c.changes), Course([(0.0, 0.0)]))
        course = self._clock.stretched(course)
        looks = test.look_table()
        farthest = float(looks[:, 0].max()) if len(looks) else 0.0
        passed = (v for t, v in zip(course.times, course.values, strict=True) if t <= farthest)
        largest = max(course.at(farthest), course.at(0.0), *passed)
        first, first_fall, tenfold = test.falling.first(), test.first_fall(), test.tenfold_speed()
        direction = self.test.loads.direction
        loaded = direction.any(axis=1)
        sunk = -(self.test.carried - reference)[loaded, 1] if loaded.any() else np.zeros(1)
        mean = settlement_of(direction, self.test.carried - reference)
        return {
            "blocks": len(arrays["block_area"]),
            **({"blocks_removed": int(self.model.removed.sum())} if self.programme.excavations else {}),
            **self._failure(course),
            **self._safety(),
            "failed": rise.failed,
            "at_rest": test.at_rest,
            "load_reached": test.reached,
            "fallen_blocks": len(test.falling.blocks),
            "first_fallen_block": None if first is None else first.block,
            "first_fallen_step": None if first is None else first.out,
            "first_fallen_load_pa": None if first_fall is None else course.at(first_fall),
            "tenfold_speed_load_pa": None if tenfold is None else course.at(tenfold),
            "true_time_s": float(rise.steps * self.model.dt / np.sqrt(np.median(self.model.mass_ratio))),
            "largest_load_pa": float(largest),
            "settlement_m": float(mean),
            "settlement_min_m": float(sunk.min()),
            "settlement_max_m": float(sunk.max()),
            "settlement_rate_over_first": rise.speed,
            "imbalance": rise.imbalance,
            "steps": self.model.steps_done,
            "energy_error": energy_error(arrays),
            "kinetic_over_stored_energy": _mean(kinetic_share(arrays)[1:-1]),
        }

    def _failure(self, course: Course) -> dict[str, float | None]:
        """Failure load with its interval [Pa], settlement there [m], and the share of inertia and damping."""
        found = self.test.failure() if course.changes else None
        if found is None:
            return dict.fromkeys(_FAILURE)
        settlement = self.test.looks[found.look][1]
        load, there = course.at(found.load), course.at(found.load + found.inertia)
        low, high = sorted((course.at(found.low), course.at(found.high)))
        if isinstance(self.test, Holds):
            load = there = 0.5 * (low + high)
        low, high = low - _REPEATS * abs(load), high + _REPEATS * abs(load)
        over = abs(course.at(float(self.test.look_table()[self.test.first_look :, 0].max())) - load)
        size = abs(load) or max(abs(low), abs(high))
        shares = [number(v / size) if size else None for v in (abs(there - load), high - low, over)]
        return dict(zip(_FAILURE, (load, low, high, settlement, *shares), strict=True))

    def _safety(self) -> dict[str, float | None]:
        """Factor of safety with its bracket, where strength was reduced."""
        if not isinstance(self.test, Holds) or not self.test.weaken:
            return {}
        found, test = self.test.failure(), self.test
        names = ("factor_of_safety", "factor_of_safety_low", "factor_of_safety_high")
        if found is not None:
            low, high = (1.0 - _REPEATS) * found.low, (1.0 + _REPEATS) * found.high
            return dict(zip(names, (found.load, low, high), strict=True))
        # Failed with all its strength, or never.
        ends = (None, test.low) if test.rise.failed else (test.low, None)
        return dict(zip(names, (None, *ends), strict=True))

    @property
    def _cure(self) -> str:
        """What makes the interval of the failure load narrower."""
        if not isinstance(self.test, Holds):
            return "take more steps (numerics.steps)"
        if self.test.narrow:
            return "ask for a narrower bracket (programme.bracket)"
        return f"{self.test.tries} tries did not close the bracket, since the body bore some loads and then did not"

    def measures(self, headline: dict[str, Any]) -> list[Measure]:
        """Error measures with their thresholds."""
        undecided = headline["at_rest"] is False and not headline["failed"]
        return [
            energy_measure(headline),
            kinetic_measure(headline),
            Measure(
                "inertia_over_load", headline["inertia_over_load"], 0.05,
                "inertia and damping bear {percent} of the load at failure, and the failure load is without them: "
                "take more steps (numerics.steps)",
            ),
            Measure(
                "failure_load_width", headline["failure_load_width"], 0.1,
                "the interval of the failure load is {percent} of it wide; " + self._cure,
            ),
            Measure(
                "imbalance", headline["imbalance"] if undecided else None, 0.0,
                "under the whole load the body came neither to rest nor to failure: unbalanced forces are {percent} "
                "of those of the zones; more steps (numerics.steps) may tell",
            ),
            Measure(
                "load_reached", None if headline["failed"] else headline["load_reached"], math.inf,
                "the loads came to {percent} of their rise in eight times its steps: the body neither failed nor "
                "bore them all; more steps (numerics.steps) may tell",
                least=1.0 - 1e-6,
            ),
        ]  # fmt: skip


def _mean(values: np.ndarray) -> float:
    """Mean of the states between the first and the last; nan where there is none."""
    return float(values.mean()) if values.size else math.nan


def _course(load: Load) -> Course:
    """Pressure over the time of loading [Pa]."""
    return Course(load.course) if load.course is not None else Course([(0.0, load.pressure)], load.rate)
