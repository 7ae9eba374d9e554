"""Weight and steady pressures on any outline, then pressures that rise until the rock fails."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading import programme as mechanics
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import blocks_in
from graben.mechanics.blocks.loading.loads import Loads
from graben.mechanics.blocks.record.history import History
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Load, Programme
from graben.stages.blocks.biaxial import energy_error, energy_measure, kinetic_measure, kinetic_share
from graben.stages.blocks.checkpoint import refuse_unlike
from graben.stages.shared.measures import Measure
from graben.stages.shared.record import Progress


class Rising:
    """The test that a scene's [programme] describes. BadInput where a segment is not on the outline."""

    ERRORS = ("energy_error", "kinetic_over_stored_energy", "inertia_over_load")

    def __init__(self, scene: BlocksScene, model: BlockModel, steps: int) -> None:
        assert scene.programme is not None
        self.scene, self.model = scene, model
        self.programme: Programme = scene.programme
        self.control = mechanics.Control(self.programme.calm, self.programme.patience)
        self.rise = mechanics.Rise()
        self.looks: list[tuple[float, float, float]] = []
        self.load_times: list[float] = []
        self.rest = np.zeros(2)
        self.carried = model.bodies.position.copy()
        self.next_save = 0.0
        b, file = model.bodies, str(scene.source.path)
        faults = []
        for k, support in enumerate(self.programme.supports):
            at = mechanics.on_segment(b, np.array(support.start), np.array(support.end))
            if not at.any():
                expected = "a segment that holds a part of the outline"
                faults.append(Fault(file, f"programme.supports.{k}", support.name, expected))
            for axis, name in enumerate("xy"):
                if support.fix in (name, "both"):
                    model.hold(at, axis)
        self.loads = Loads(len(b.position))
        for k, load in enumerate(self.programme.loads):
            try:
                unit = mechanics.pressure_forces(b, np.array(load.start), np.array(load.end))
            except Refused as error:
                faults.append(Fault(file, f"programme.loads.{k}", load.name, f"a segment of the outline ({error})"))
                continue
            self.loads.add(unit, _course(load))
        self.loads.begin(model, 0.0)
        self._weight = model.weight.copy()
        self._digs = sorted(self.programme.excavations, key=lambda dig: dig.time)
        self.dug = 0
        self.released: list[tuple[float, float, np.ndarray]] = []  # from, over, forces
        for k, dig in enumerate(self.programme.excavations):
            if not blocks_in(model, np.array(dig.polygon)).any():
                expected = "a polygon that holds the middle of a block"
                faults.append(Fault(file, f"programme.excavations.{k}", dig.name, expected))
        if faults:
            raise BadInput(faults)

    def begin(self, progress: Progress) -> None:
        """Bring the body to rest under its weight and steady pressures."""
        ratio = mechanics.come_to_rest(
            self.model,
            self.scene.numerics.consolidation_tolerance,
            lambda ratio, steps: progress(0.0, f"coming to rest, {steps} steps, unbalanced force ratio {ratio:.2g}"),
        )
        self.rest = np.array([ratio, self.model.steps_done])
        self.carried = self.model.motion.x.copy()

    def go_on(self, history: History, save: Callable[[], None], progress: Progress) -> None:
        """Raise the pressures from the last saved state to failure or to the end."""
        m, p, rise = self.model, self.programme, self.rise
        if not history.time:
            m.begin_ledger()
            self._save(save)
        if not self.loads.direction.any() and not self._digs:
            return
        end = p.end * (1.0 - 1e-9)
        while rise.load_time < end and not rise.failed:
            if rise.waited == 0:
                self.carried = m.motion.x.copy()
            stop = self._dig(history, save)
            mechanics.look_at(m, rise, self.control, self.loads, p.end, history.reference, stop)
            self.looks.append((rise.load_time, rise.settlement, rise.imbalance))
            if rise.failed or rise.load_time >= min(end, self.next_save):
                self._save(save)
            wait = f", waiting for {rise.waited} steps" if rise.waited else ""
            progress(
                min(1.0, rise.load_time / p.end),
                f"load time {rise.load_time:.4g} s, settlement {rise.settlement:.3g} m{wait}",
            )

    def _dig(self, history: History, save: Callable[[], None]) -> float:
        """Take out the blocks whose time has come, the state before is saved; returns the time of the next ones."""
        m, rise = self.model, self.rise
        while self.dug < len(self._digs):
            dig = self._digs[self.dug]
            if dig.time > rise.load_time + 0.5 * m.dt:
                return dig.time
            if m.time > history.start_time + history.time[-1]:
                self._save(save)
            self.dug += 1
            forces = m.remove(blocks_in(m, np.array(dig.polygon)))
            self.loads.take_off(m.removed[m.bodies.vertex_block])
            if dig.relax_over > 0.0:
                self._release(rise.load_time, dig.relax_over, forces)
            rise.since = rise.load_time
            self.loads.begin(m, rise.since)
            rise.imbalance = mechanics.imbalance(m)
            # What moves now has nothing to do with the speed before.
            rise.first_speed = 0.0
        return np.inf

    def _release(self, start: float, over: float, forces: np.ndarray) -> None:
        """Let forces that stand in for blocks taken out fade away."""
        self.released.append((start, over, forces))
        self.loads.add(forces, Course([(start, 1.0), (start + over, 0.0)]), leading=False)

    def _save(self, save: Callable[[], None]) -> None:
        self.load_times.append(self.rise.load_time)
        while self.next_save <= self.rise.load_time:
            self.next_save += self.programme.save_every
        save()

    def state(self) -> dict[str, np.ndarray]:
        """What a checkpoint must hold beside the model."""
        return {
            "rest": self.rest,
            "looks": np.array(self.looks).reshape(-1, 3),
            "load_times": np.array(self.load_times),
            "carried": self.carried,
            "next_save": np.array(self.next_save),
            "dug": np.array(self.dug),
            "released": np.array([released[:2] for released in self.released]).reshape(-1, 2),
            "released_forces": np.array([forces for _, _, forces in self.released]).reshape(-1, *self.carried.shape),
            **{f"rise_{k}": np.array(v) for k, v in asdict(self.rise).items()},
        }

    def bring_back(self, state: dict[str, np.ndarray]) -> None:
        refuse_unlike(state, self.state(), ("looks", "load_times", "released", "released_forces"))
        if len(state["released"]) != len(state["released_forces"]):
            raise Refused("test.released: as many as released_forces")
        if not 0 <= state["dug"] <= len(self._digs):
            raise Refused(f"test.dug: 0 to {len(self._digs)}")
        self.rest, self.carried = state["rest"], state["carried"]
        self.looks = [tuple(row) for row in state["looks"].tolist()]
        self.load_times = state["load_times"].tolist()
        self.next_save = float(state["next_save"])
        self.dug = int(state["dug"])
        self.loads.take_off(self.model.removed[self.model.bodies.vertex_block])
        for (start, over), forces in zip(state["released"], state["released_forces"]):
            self._release(float(start), float(over), forces)
        self.rise = mechanics.Rise(**{f.name: state[f"rise_{f.name}"].item() for f in fields(mechanics.Rise)})

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""
        looks = np.array(self.looks).reshape(-1, 3)
        surface = self._surface()
        return {
            "confining_stress": np.array(0.0),
            "load_time": np.array(self.load_times[: len(history.time)]),
            "look_load_time": looks[:, 0],
            "look_settlement": looks[:, 1],
            "look_imbalance": looks[:, 2],
            "surface_vertex": surface,
            "surface_carried_displacement": (self.carried - history.reference)[surface],
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
        for force, course in self.loads.patterns[: len(self.programme.loads)]:
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
        reference = arrays["vertex_position"]
        course = next((c for c in map(_course, self.programme.loads) if c.changes), Course([(0.0, 0.0)]))
        last, end = course.at(self.rise.load_time), self.rise.load_time
        largest = max(last, course.at(0.0), *(v for t, v in zip(course.times, course.values) if t <= end))
        direction = self.loads.direction
        loaded = direction.any(axis=1)
        sunk = -(self.carried - reference)[loaded, 1] if loaded.any() else np.zeros(1)
        mean = mechanics.settlement_of(direction, self.carried - reference)
        return {
            "blocks": len(arrays["block_area"]),
            **({"blocks_removed": int(self.model.removed.sum())} if self._digs else {}),
            "failure_load_pa": float(last) if self.rise.failed and course.changes else None,
            "failed": self.rise.failed,
            "largest_load_pa": float(largest),
            "settlement_m": float(mean),
            "settlement_min_m": float(sunk.min()),
            "settlement_max_m": float(sunk.max()),
            "settlement_rate_over_first": float(self.rise.speed / self.rise.first_speed) if self.looks else 0.0,
            "inertia_over_load": self._inertia(arrays),
            "imbalance": self.rise.imbalance,
            "steps": self.model.steps_done,
            "steps_waited": self.rise.waited_in_all,
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
