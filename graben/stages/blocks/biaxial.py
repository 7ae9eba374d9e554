"""Biaxial compression as a scene's [loading] describes it: the test, and what is reported of it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.biaxial import Biaxial, Courses
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.pace import ForceCheck
from graben.mechanics.blocks.record.history import History
from graben.mechanics.blocks.shape.rectangle import rectangle_sides
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Loading
from graben.stages.blocks.confinement import friction_share, lateral_inside
from graben.stages.blocks.ends import ends_of
from graben.stages.blocks.report import energy_error, energy_measure, kinetic_measure, kinetic_share, ratio
from graben.stages.shared.measures import Measure, number


def biaxial(scene: BlocksScene, model: BlockModel, steps: int) -> Biaxial:
    """The test. Refused where the domain is no upright rectangle."""
    loading, numerics = scene.loading, scene.numerics
    _refuse_crushed(scene, model)
    check = _force_check(scene, steps)
    return Biaxial(
        model,
        pressure=-loading.confining_pressure,
        vertical=-loading.confining_pressure * loading.vertical_ratio,
        speed=-loading.speed,
        steps=steps,
        states=loading.states,
        tolerance=numerics.consolidation_tolerance,
        courses=_courses(loading, loading.duration / steps, check is not None),
        stop_loose=numerics.stop_loose_blocks,
        check=check,
        ends=ends_of(scene, model.bodies),
    )


def _refuse_crushed(scene: BlocksScene, model: BlockModel) -> None:
    """BadInput where consolidation alone presses blocks through one another: a run would stop in its first steps."""
    # Contacts with platens have a face, and a stiffness of their own.
    loading, joints = scene.loading, [j for j in model.joints if j.face == 0]
    if model.bodies.rock < 2 or any(j.closure > 0.0 for j in joints):
        return
    stiffness, sides = max(j.normal_stiffness for j in joints), max(1.0, loading.vertical_ratio)
    most = stiffness * model.deepest / sides
    if loading.confining_pressure > most:
        expected = (
            f"at most {most:.4g} Pa: it closes joints of {stiffness:.4g} Pa/m by "
            f"{loading.confining_pressure * sides / stiffness:.3g} m, between blocks of {model.block_size:.3g} m"
        )
        value = f"{loading.confining_pressure:.4g} Pa"
        raise BadInput(Fault(str(scene.source.path), "loading.confining_pressure", value, expected))


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


class BiaxialReport:
    """See `Report`."""

    errors: ClassVar[tuple[str, ...]] = (
        "energy_error",
        "kinetic_over_stored_energy",
        "lateral_over_applied_stress",
        "bottom_over_top_reaction",
    )

    def __init__(self, scene: BlocksScene, test: Biaxial) -> None:
        self.scene, self.test, self.model = scene, test, test.model

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""
        loading = self.scene.loading
        arrays = {"confining_stress": np.array(-loading.confining_pressure)}
        if loading.confining_course is not None:
            course = Course(loading.confining_course)
            arrays["confining_stress_then"] = np.array([-course.at(t) for t in history.time])
        inside = lateral_inside(history)
        applied = arrays.get("confining_stress_then", np.full(len(inside), arrays["confining_stress"]))
        arrays["lateral_over_applied_stress"] = inside / applied
        if self._gripped:
            arrays["friction_over_confinement"] = friction_share(history, applied)
        return arrays

    @property
    def _gripped(self) -> bool:
        """Whether anything but smooth walls may bear on the rock."""
        return self.scene.loading.platens is not None or bool(self.scene.loading.supports)

    def _reactions(self, arrays: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertical forces (states,) that the bottom and the sides bear, and that the top brings [N/m]."""
        sides, push = rectangle_sides(self.model.bodies.outline), arrays["wall_reaction"][:, :, 1]
        return push[:, sides.bottom], push[:, sides.left] + push[:, sides.right], -push[:, sides.top]

    def _of_friction(self, arrays: dict[str, np.ndarray], upto: slice) -> dict[str, float | None]:
        """Means of what friction and supports add, where there may be any."""
        if not self._gripped:
            return {}
        _, side, top = self._reactions(arrays)
        return {
            "friction_over_confinement": number(arrays["friction_over_confinement"][upto].mean()),
            "side_over_top_reaction": number(ratio(side, top)[upto].mean()),
        }

    def _moved(self, displacement: np.ndarray) -> float:
        """What the top of the rock has moved along y [m].

        Its speed rises over the first steps, so speed times time is too much. displacement : (rock vertices, 2)
        """
        bodies = self.model.bodies
        top = bodies.vertex_side[bodies.vertex_block < bodies.rock, rectangle_sides(bodies.outline).top]
        return float(displacement[top, 1].mean())

    def _paced(self) -> dict[str, float]:
        """Steps of loading, and the force check along them."""
        pace = self.test.pace
        if pace is None:
            return {}
        mean = pace.summed / max(pace.looks, 1)
        steps = self.model.steps_done - int(self.test.rest[1])
        return {"loading_steps": steps, "force_check_worst": pace.worst, "force_check_mean": mean}

    def headline(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Peak of the top wall's mean stress (Pa, compression negative), nominal strain there, error measures."""
        size = np.ptp(self.model.bodies.outline, axis=0)
        bottom, side, top = self._reactions(arrays)
        vertical = -top / size[0]
        peak = int(np.argmin(vertical))
        after = slice(1, peak + 1) if peak > 0 else slice(None)
        flown = self.model.flown_at[np.isfinite(self.model.flown_at)] - (self.model.time - arrays["time"][-1])
        below = bottom + side if self._gripped else bottom
        return {
            "blocks": len(arrays["block_area"]),
            "confining_stress_pa": float(arrays["confining_stress"]),
            "peak_wall_stress_pa": number(vertical[peak]),
            "strain_at_peak": number(self._moved(arrays["displacement"][peak]) / size[1]),
            "steps": self.model.steps_done,
            "loose_blocks": int(arrays["loose_blocks"].max()),
            "flown_blocks": len(flown),
            "flown_blocks_before_peak": int((flown < arrays["time"][peak]).sum()),
            "energy_error": energy_error(arrays),
            "kinetic_over_stored_energy": number(kinetic_share(arrays)[after].mean()),
            "lateral_over_applied_stress": number(arrays["lateral_over_applied_stress"][after].mean()),
            **self._paced(),
            "bottom_over_top_reaction": number(ratio(below, top)[after].mean()),
            **self._of_friction(arrays, after),
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
                "lateral_over_applied_stress", headline["lateral_over_applied_stress"], math.inf,
                "the lateral stress inside is {value} times the applied one: inertia or damping bears the rest, and "
                "the peak is not that of the rock; take more steps (numerics.steps) or a finer fidelity",
                least=0.7,
            ),
            Measure(
                "bottom_over_top_reaction", headline["bottom_over_top_reaction"], 1.1,
                "the bottom bears {value} of what the top does: the test is too fast for its steps; take more of "
                "them (numerics.steps) or a finer fidelity",
                least=0.9,
            ),
            Measure(
                "flown_blocks_before_peak", headline["flown_blocks_before_peak"] / headline["blocks"], 0.01,
                "{percent} of the blocks lost touch, flew off under the confining pressure and were stopped before "
                "the peak: the peak is not that of the whole",
            ),
        ]  # fmt: skip
