"""Biaxial compression of a rectangle of blocks: consolidation, then the top moves down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.compression import Courses, compress, consolidate, rectangle_sides
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.pace import ForceCheck, Pace
from graben.mechanics.blocks.record.history import History, mean_stress
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Loading
from graben.stages.blocks.checkpoint import refuse_unlike
from graben.stages.shared.measures import Measure, number
from graben.stages.shared.record import Progress


class Biaxial:
    """The test that a scene's [loading] describes."""

    ERRORS = (
        "energy_error",
        "kinetic_over_stored_energy",
        "lateral_over_applied_stress",
        "bottom_over_top_reaction",
    )

    def __init__(self, scene: BlocksScene, model: BlockModel, steps: int) -> None:
        rectangle_sides(model.bodies.outline)  # refuses any other outline before work begins
        self.scene, self.model, self.steps = scene, model, steps
        self.rest = np.zeros(2)  # unbalanced force ratio of consolidation, its steps
        self.check = _force_check(scene, steps)
        self.pace = None if self.check is None else Pace()
        self.courses = _courses(scene.loading, scene.loading.duration / steps, self.check is not None)

    def begin(self, progress: Progress) -> None:
        """Consolidate."""
        progress(0.0, "consolidation")
        pressure = self.scene.loading.confining_pressure
        ratio = consolidate(
            self.model,
            -pressure,
            -pressure * self.scene.loading.vertical_ratio,
            tolerance=self.scene.numerics.consolidation_tolerance,
        )
        self.rest = np.array([ratio, self.model.steps_done])

    def go_on(self, history: History, save: Callable[[], None], progress: Progress) -> None:
        """Compress from the last saved state to the end."""
        states = self.scene.loading.states

        def saved(k: int, _: BlockModel) -> None:
            save()
            progress(k / (states - 1), f"state {k} of {states - 1}")

        speed, behind = -self.scene.loading.speed, len(history.time)
        loose = self.scene.numerics.stop_loose_blocks
        compress(
            self.model,
            speed,
            self.steps,
            states,
            saved,
            saved=behind,
            courses=self.courses,
            stop_loose=loose,
            paced=None if self.pace is None or self.check is None else (self.pace, self.check),
        )

    def state(self) -> dict[str, np.ndarray]:
        """What a checkpoint must hold beside the model."""
        pace = {} if self.pace is None else {f"pace_{k}": np.array(v) for k, v in asdict(self.pace).items()}
        return {"rest": self.rest, **pace}

    def bring_back(self, state: dict[str, np.ndarray]) -> None:
        refuse_unlike(state, self.state())
        self.rest = state["rest"]
        if self.pace is not None:
            self.pace = Pace(**{f.name: state[f"pace_{f.name}"].item() for f in fields(Pace)})

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""
        loading = self.scene.loading
        arrays = {"confining_stress": np.array(-loading.confining_pressure)}
        if loading.confining_course is not None:
            course = Course(loading.confining_course)
            arrays["confining_stress_then"] = np.array([-course.at(t) for t in history.time])
        return arrays

    def _strain(self, time: float, height: float) -> float:
        """Nominal strain, compression negative."""
        loading = self.scene.loading
        if loading.speed_course is None:
            return float(-loading.speed * time / height)
        return float(-Course(loading.speed_course).integral(time) / height)

    def _paced(self) -> dict[str, float]:
        """Steps of loading, and the force check along them."""
        if self.pace is None:
            return {}
        mean = self.pace.summed / max(self.pace.looks, 1)
        steps = self.model.steps_done - int(self.rest[1])
        return {"loading_steps": steps, "force_check_worst": self.pace.worst, "force_check_mean": mean}

    def headline(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Peak of the top wall's mean stress (Pa, compression negative), nominal strain there, error measures."""
        sides = rectangle_sides(self.model.bodies.outline)
        push = arrays["wall_reaction"]
        low, size = self.model.bodies.outline.min(axis=0), np.ptp(self.model.bodies.outline, axis=0)
        bottom, top = push[:, sides.bottom, 1], -push[:, sides.top, 1]
        vertical = -top / size[0]
        peak = int(np.argmin(vertical))
        bodies, area, stress = self.model.bodies, self.model.zone_area, arrays["zone_stress"]
        middle = arrays["vertex_position"][bodies.zone_vertex].mean(axis=1)
        inside = np.hypot(*(middle - (low + size / 2.0)).T) < 0.4 * size.min()
        if "block_stress" in arrays:
            stress = arrays["block_stress"][:, bodies.zone_block]
        lateral = mean_stress(stress, area, inside if inside.any() else area > 0.0)[:, 0]
        after = slice(1, peak + 1) if peak > 0 else slice(None)
        applied = arrays.get("confining_stress_then", np.full(len(lateral), arrays["confining_stress"]))
        return {
            "blocks": len(arrays["block_area"]),
            "confining_stress_pa": float(arrays["confining_stress"]),
            "peak_wall_stress_pa": number(vertical[peak]),
            "strain_at_peak": number(self._strain(float(arrays["time"][peak]), size[1])),
            "steps": self.model.steps_done,
            "loose_blocks": int(arrays["loose_blocks"].max()),
            "energy_error": energy_error(arrays),
            "kinetic_over_stored_energy": number(kinetic_share(arrays)[after].mean()),
            "lateral_over_applied_stress": number((lateral / applied)[after].mean()),
            **self._paced(),
            "bottom_over_top_reaction": number(ratio(bottom, top)[after].mean()),
        }

    def measures(self, headline: dict[str, Any]) -> list[Measure]:
        """Error measures with their thresholds; lateral stress within a third of the applied goes with peaks that
        are a tenth too high at most."""
        return [
            energy_measure(headline),
            kinetic_measure(headline),
            Measure(
                "lateral_over_applied_stress", headline["lateral_over_applied_stress"], 1.3,
                "the lateral stress inside is {value} times the applied one: inertia confines the blocks and "
                "the peak is too high; take more steps (numerics.steps), a finer fidelity, or numerics.force_check",
            ),
            Measure(
                "bottom_over_top_reaction", headline["bottom_over_top_reaction"], 1.1,
                "the bottom bears {value} of what the top does: the test is too fast for its steps; take more of "
                "them (numerics.steps) or a finer fidelity",
                least=0.9,
            ),
        ]  # fmt: skip


def _force_check(scene: BlocksScene, steps: int) -> ForceCheck | None:
    n = scene.numerics
    if n.force_check is None:
        return None
    return ForceCheck(n.force_check, steps / (n.most_steps or 8 * steps), steps / (n.least_steps or steps))


def _courses(loading: Loading, dt: float, always: bool) -> Courses | None:
    """Courses over steps of dt; None where speed and pressure are steady, unless they are wanted always."""
    if loading.speed_course is None and loading.confining_course is None and not always:
        return None
    down = loading.speed_course or [(0.0, 0.0), (0.01 * loading.duration, loading.speed)]
    pressure = loading.confining_course
    return Courses(
        Course([(time, -speed) for time, speed in down]).in_steps(dt),
        None if pressure is None else Course(pressure).in_steps(dt),
    )


def energy_measure(headline: dict[str, Any]) -> Measure:
    """The run stops at numerics.energy_limit; half of its default is told."""
    return Measure(
        "energy_error", headline["energy_error"], 0.025,
        "the energy ledger is off by {percent} of the work done; take more steps (numerics.steps)",
    )  # fmt: skip


def kinetic_measure(headline: dict[str, Any]) -> Measure:
    """Quasi-static tests keep a few percent of the energy in motion."""
    return Measure(
        "kinetic_over_stored_energy", headline["kinetic_over_stored_energy"], 0.05,
        "kinetic energy is {percent} of the stored one (5 % is the most of a quasi-static test): the load comes too "
        "fast; take more steps (numerics.steps) or a finer fidelity",
    )  # fmt: skip


def ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """part / whole, 0 where both are."""
    return np.divide(part, np.where((part == 0.0) & (whole == 0.0), 1.0, whole))


def energy_error(arrays: dict[str, np.ndarray]) -> float:
    """Largest error of the ledger over the work done and the energy stored."""
    stored = arrays["energy_strain"] + arrays["energy_joint"]
    work = abs(arrays["energy_boundary"]) + abs(arrays["energy_external"]) + stored
    return float(ratio(np.abs(arrays["energy_error"]), work).max())


def kinetic_share(arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Kinetic over stored energy per state; what flies loose counts in neither."""
    moving = arrays["energy_kinetic"] - arrays["energy_kinetic_loose"]
    return ratio(moving, arrays["energy_strain"] + arrays["energy_joint"])
