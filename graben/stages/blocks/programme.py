"""Weight, pressures and digging as a scene's [programme] describes them: the test, and what is reported of it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading import programme as mechanics
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import Dig, blocks_in
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces, settlement_of
from graben.mechanics.blocks.record.history import History
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Load
from graben.stages.blocks.report import energy_error, energy_measure, kinetic_measure, kinetic_share
from graben.stages.shared.measures import Measure


def programme(scene: BlocksScene, model: BlockModel) -> mechanics.Programme:
    """Supports are put on the model, and the test is made. BadInput where a segment is not on the outline."""
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
    loads = Loads(len(b.position))
    for k, load in enumerate(p.loads):
        try:
            unit = pressure_forces(b, np.array(load.start), np.array(load.end))
        except Refused as error:
            faults.append(Fault(file, f"programme.loads.{k}", load.name, f"a segment of the outline ({error})"))
            continue
        loads.add(unit, _course(load))
    digs = [Dig(np.array(dig.polygon), dig.time, dig.relax_over) for dig in p.excavations]
    for k, dig in enumerate(digs):
        if not blocks_in(model, dig.polygon).any():
            expected = "a polygon that holds the middle of a block"
            faults.append(Fault(file, f"programme.excavations.{k}", p.excavations[k].name, expected))
    if faults:
        raise BadInput(faults)
    return mechanics.Programme(
        model,
        loads,
        mechanics.Control(p.calm, p.patience),
        end=p.end,
        save_every=p.save_every,
        tolerance=scene.numerics.consolidation_tolerance,
        digs=digs,
    )


class ProgrammeReport:
    """See `Report`."""

    errors: ClassVar[tuple[str, ...]] = ("energy_error", "kinetic_over_stored_energy", "inertia_over_load")

    def __init__(self, scene: BlocksScene, test: mechanics.Programme) -> None:
        assert scene.programme is not None
        self.programme, self.test, self.model = scene.programme, test, test.model
        self._weight = test.model.weight.copy()  # before anything is taken out

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""
        looks = np.array(self.test.looks).reshape(-1, 3)
        surface = self._surface()
        return {
            "confining_stress": np.array(0.0),
            "load_time": np.array(self.test.load_times[: len(history.time)]),
            "look_load_time": looks[:, 0],
            "look_settlement": looks[:, 1],
            "look_imbalance": looks[:, 2],
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

    def _inertia(self, arrays: dict[str, np.ndarray]) -> float:
        """What supports and weight leave of the change of load: root mean square of the shares, first and last
        states aside; nan where there are no others."""
        times = arrays["load_time"][1:-1]
        if not len(times):
            return math.nan
        load = np.zeros((len(times), 2))
        for force, course in self.test.loads.patterns[: len(self.programme.loads)]:
            load += np.outer([course.at(t) - course.at(0.0) for t in times], force.sum(axis=0))
        loaded = load.any(axis=1)
        if not loaded.any():
            return 0.0
        weight = np.broadcast_to(self._weight.sum(axis=0), load.shape)
        if "block_removed" in arrays:
            there = arrays["block_removed"][1:-1, self.model.bodies.vertex_block] == 0
            weight = there @ self._weight
        total = arrays["boundary_force"][1:-1].sum(axis=1) + weight
        return float(np.sqrt(np.mean((total**2).sum(axis=1)[loaded] / (load**2).sum(axis=1)[loaded])))

    def headline(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Failure load (Pa; null where the end came first), settlement of the loaded ground, error measures."""
        rise = self.test.rise
        reference = arrays["vertex_position"]
        course = next((c for c in map(_course, self.programme.loads) if c.changes), Course([(0.0, 0.0)]))
        last, end = course.at(rise.load_time), rise.load_time
        largest = max(last, course.at(0.0), *(v for t, v in zip(course.times, course.values) if t <= end))
        direction = self.test.loads.direction
        loaded = direction.any(axis=1)
        sunk = -(self.test.carried - reference)[loaded, 1] if loaded.any() else np.zeros(1)
        mean = settlement_of(direction, self.test.carried - reference)
        return {
            "blocks": len(arrays["block_area"]),
            **({"blocks_removed": int(self.model.removed.sum())} if self.programme.excavations else {}),
            "failure_load_pa": float(last) if rise.failed and course.changes else None,
            "failed": rise.failed,
            "largest_load_pa": float(largest),
            "settlement_m": float(mean),
            "settlement_min_m": float(sunk.min()),
            "settlement_max_m": float(sunk.max()),
            "settlement_rate_over_first": float(rise.speed / rise.first_speed) if self.test.looks else 0.0,
            "inertia_over_load": self._inertia(arrays),
            "imbalance": rise.imbalance,
            "steps": self.model.steps_done,
            "steps_waited": rise.waited_in_all,
            "energy_error": energy_error(arrays),
            "kinetic_over_stored_energy": _mean(kinetic_share(arrays)[1:-1]),
        }

    def measures(self, headline: dict[str, Any]) -> list[Measure]:
        """Error measures with their thresholds. A stack that topples 19 % too late has an inertia of 3 % of its load,
        so that one says no more than that a load is surely too high."""
        return [
            energy_measure(headline),
            kinetic_measure(headline),
            Measure(
                "inertia_over_load", headline["inertia_over_load"], 0.02,
                "inertia bears {percent} of the load: a failure load may be far too high; lower programme.calm, or "
                "take more steps (numerics.steps)",
            ),
        ]  # fmt: skip


def _mean(values: np.ndarray) -> float:
    """Mean of the states between the first and the last; nan where there is none."""
    return float(values.mean()) if values.size else math.nan


def _course(load: Load) -> Course:
    """Pressure over the time of loading [Pa]."""
    return Course(load.course) if load.course is not None else Course([(0.0, load.pressure)], load.rate)
