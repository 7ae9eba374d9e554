"""Loading of blocks: biaxial compression or a programme of supports and pressures, and the numerics of both."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Any, Literal

from pydantic import model_validator

from graben.schemas.quantities import (
    Acceleration,
    Angle,
    Frequency,
    Integer,
    JointStiffness,
    Length,
    Number,
    Pressure,
    PressureRate,
    PressureSlope,
    Speed,
    Switch,
    Time,
    key,
    knob_key,
)
from graben.schemas.scene import Model, Name

_knob = partial(knob_key, "blocks")


Point = tuple[Length, Length]
SpeedCourse = list[tuple[Time, Speed]]
PressureCourse = list[tuple[Time, Pressure]]

_SLOPE_SUPPORTS: Any = [
    {"name": "left", "start": ["0 m", "0 m"], "end": ["0 m", "20 m"], "fix": "x"},
    {"name": "right", "start": ["80 m", "0 m"], "end": ["80 m", "50 m"], "fix": "x"},
    {"name": "base", "start": ["0 m", "0 m"], "end": ["80 m", "0 m"], "fix": "y"},
]
_SLOPE_LOADS: Any = [{"name": "backslope", "start": ["55 m", "50 m"], "end": ["60 m", "50 m"], "rate": "0.25 MPa/s"}]


class Support(Model):
    """No displacement along a segment of the outline."""

    name: Name = key("support", "name, for messages")
    start: Point = key(..., "one end of the segment")
    end: Point = key(..., "the other end")
    fix: Literal["x", "y", "both"] = key("both", "displacement held at zero: x or y (a roller), or both")


class Platens(Model):
    """Platens as bodies that touch the rock through contacts without cohesion or tension; they do not turn."""

    friction: Angle = key("0 deg", "friction angle between platen and rock", ge=0, lt=1.57)
    normal_stiffness: JointStiffness | None = key(
        None, "normal stiffness of the contact; left out: that of [joints]", gt=0
    )
    shear_stiffness: JointStiffness | None = key(
        None, "shear stiffness of the contact; left out: that of [joints]", gt=0
    )
    sides: Switch = key(
        False,
        "also at the left and right side, where they pass the confining pressure on; left out: it acts on the rock",
    )
    side_friction: Angle | None = key(None, "sides: friction angle there; left out: friction", ge=0, lt=1.57)
    young: Pressure | None = key(
        None,
        "Young's modulus of platens that deform, held at their outer faces; left out: rigid below and above, and "
        "of the rock's modulus at the sides",
        gt=0,
    )
    poisson: Number | None = key(None, "their Poisson's ratio; left out: 0.3", gt=-1, lt=0.5)
    thickness: Length | None = key(None, "thickness; left out: a tenth of the smaller side of the domain", gt=0)
    overhang: Length | None = key(
        None,
        "reach beyond the rock at both ends, which bulges; left out: a quarter of the smaller side of the domain",
        gt=0,
    )

    @model_validator(mode="after")
    def _used(self) -> Platens:
        faults = []
        if self.side_friction is not None and not self.sides:
            faults.append("sides = true, because of side_friction")
        if self.poisson is not None and self.young is None:
            faults.append("young, because of poisson")
        if faults:
            raise ValueError("; ".join(faults))
        return self


class Loading(Model):
    """Confinement first, then the top moves down."""

    confining_pressure: Pressure = key("0.5 MPa", "normal pressure on the left and right sides", gt=0)
    vertical_ratio: Number = key(0.5, "vertical over confining pressure during consolidation", ge=1e-6, le=1e6)
    speed: Speed = key("5 mm/s", "speed of the top, downwards", gt=0)
    speed_course: SpeedCourse | None = key(
        None,
        "speed of the top over time instead of speed: points [time, speed], straight between them, negative upwards; "
        "two points at one time make a jump",
        min_length=1,
        max_length=100_000,
    )
    confining_course: PressureCourse | None = key(
        None,
        "confining pressure over time: points [time, pressure], straight between them; begins with "
        "confining_pressure at 0 s",
        min_length=1,
        max_length=100_000,
    )
    duration: Time = key("100 s", "time of loading", gt=0)
    states: Integer = key(51, "saved states, the first before loading", ge=2, le=1_000_000)
    supports: list[Support] = key(
        [],
        "what holds the rock instead of rollers below, on segments of its outline (repeatable): parts of the bottom "
        "along y at least; x holds top or bottom against slip, y a side against settling; the top moves all the same",
        max_length=10_000,
    )
    platens: Platens | None = key(
        None, "platens as bodies; left out: smooth walls, glued to top and bottom, which hold the rock"
    )

    @property
    def largest_travel(self) -> float:
        """Farthest that the top gets from where it was [m]."""
        if self.speed_course is None:
            return self.speed * self.duration
        course = [(0.0, self.speed_course[0][1]), *self.speed_course, (self.duration, self.speed_course[-1][1])]
        travel, farthest = 0.0, 0.0
        for (t0, v0), (t1, v1) in pairwise(course):
            if t0 >= min(t1, self.duration):
                continue
            if t1 > self.duration:
                t1, v1 = self.duration, v0 + (v1 - v0) * (self.duration - t0) / (t1 - t0)
            # Where the speed turns, the travel is at its extreme.
            turn = t0 - v0 * (t1 - t0) / (v1 - v0) if v0 * v1 < 0.0 else t1
            farthest = max(farthest, abs(travel + 0.5 * v0 * (turn - t0)) if v0 * v1 < 0.0 else 0.0)
            travel += 0.5 * (v0 + v1) * (t1 - t0)
            farthest = max(farthest, abs(travel))
        return farthest

    @model_validator(mode="after")
    def _courses(self) -> Loading:
        faults = []
        if self.speed_course is not None:
            if "speed" in self.model_fields_set:
                faults.append("either speed or speed_course")
            faults += _course_faults("speed_course", self.speed_course)
            if not any(speed for _, speed in self.speed_course):
                faults.append("speed_course with a speed other than 0")
        if self.confining_course is not None:
            faults += _course_faults("confining_course", self.confining_course)
            if self.confining_course[0] != (0.0, self.confining_pressure):
                faults.append("confining_course that begins at 0 s with confining_pressure")
            if any(pressure <= 0.0 for _, pressure in self.confining_course):
                faults.append("confining_course of positive pressures")
        if self.supports and self.platens is not None:
            faults.append("either supports or platens, which hold the rock below")
        if faults:
            raise ValueError("; ".join(faults))
        return self


class Load(Model):
    """Pressure on a part of the outline, dead: it keeps the direction and length of the undeformed outline."""

    name: Name = key("load", "name, for messages")
    start: Point = key(..., "one end of the loaded segment")
    end: Point = key(..., "the other end")
    pressure: Pressure = key("0 Pa", "pressure from the start, applied with gravity; pushes into the body")
    rate: PressureRate = key("0 Pa/s", "rise of the pressure after gravity", ge=0)
    course: PressureCourse | None = key(
        None,
        "pressure over the time of loading instead of pressure and rate: points [time, pressure], straight between "
        "them; the first one is applied with gravity",
        min_length=1,
        max_length=100_000,
    )

    @property
    def changes(self) -> bool:
        """Whether it ever leaves its first pressure."""
        if self.course is not None:
            return any(pressure != self.course[0][1] for _, pressure in self.course)
        return self.rate != 0.0

    @model_validator(mode="after")
    def _one_of_both(self) -> Load:
        faults = []
        if self.course is not None:
            if self.model_fields_set & {"pressure", "rate"}:
                faults.append("either course, or pressure and rate")
            faults += _course_faults("course", self.course)
        if faults:
            raise ValueError("; ".join(faults))
        return self


class Excavation(Model):
    """Blocks taken out of the body while it is loaded."""

    name: Name = key("excavation", "name, for messages")
    polygon: list[Point] = key(
        ..., "corner points: blocks whose middle lies in it then go", min_length=3, max_length=100_000
    )
    time: Time = key("0 s", "time of loading at which they go", ge=0)
    relax_over: Time = key(
        "0 s", "time of loading over which the forces that they bore fade away; 0 s: they are gone at once", ge=0
    )


class InSitu(Model):
    """Stress from the start, in blocks and joints; tension is positive, and szz is that of plane strain."""

    sxx: Pressure = key("0 Pa", "horizontal stress at the level")
    syy: Pressure = key("0 Pa", "vertical stress at the level")
    sxy: Pressure = key("0 Pa", "shear stress at the level")
    sxx_rise: PressureSlope = key("0 Pa/m", "rise of the horizontal stress per metre upwards")
    syy_rise: PressureSlope = key("0 Pa/m", "rise of the vertical stress per metre upwards")
    sxy_rise: PressureSlope = key("0 Pa/m", "rise of the shear stress per metre upwards")
    level: Length | None = key(None, "height at which the stresses hold; left out: the top of the domain")
    k0: Number | None = key(
        None,
        "horizontal over vertical stress; the vertical one is then the weight of the rock below the level, plus syy "
        "at the level",
        ge=0,
        le=1e3,
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> InSitu:
        both = self.model_fields_set & {"sxx", "sxx_rise", "syy_rise", "sxy", "sxy_rise"}
        if self.k0 is not None and both:
            raise ValueError(f"either k0 or {', '.join(sorted(both))}")
        return self


class Programme(Model):
    """Weight and steady pressures until rest, then pressures that rise until the rock fails; instead of [loading]."""

    horizontal: Acceleration = key("0 m/s^2", "gravity along x")
    vertical: Acceleration = key("-9.81 m/s^2", "gravity along y (upwards positive)")
    supports: list[Support] = key(
        _SLOPE_SUPPORTS, "a support along a segment of the outline (repeatable)", max_length=10_000
    )
    loads: list[Load] = key(_SLOPE_LOADS, "a pressure on a segment of the outline (repeatable)", max_length=10_000)
    excavations: list[Excavation] = key([], "blocks taken out at a time (repeatable)", max_length=10_000)
    end: Time = key("100 s", "time of even rise after which the run ends without failure", gt=0)
    save_every: Time = key("4 s", "time of rise between saved states", gt=0)
    frame: Number = _knob(
        "programme.frame",
        "stiffness of the frame that holds the loads, over that of the body: past the failure they fall with it; 0: "
        "dead loads, which run away with what fails",
        ge=0,
        le=1e3,
    )
    beyond: Number = _knob(
        "programme.beyond",
        "the test ends when the loaded ground has gone so much further than at the largest load, over its way there",
        ge=0.01,
        le=100,
    )
    falling: Switch = key(False, "blocks may fall: the run goes on, and does not count it as failure")
    bracket: Number | None = key(
        None,
        "width of a bracket, over the failure load: loads are held, and tried again with less where the body fails; "
        "left out: they rise evenly, as if a stiff frame held them",
        ge=1e-3,
        le=1,
    )
    strength_reduction: Switch = key(
        False, "strength falls instead of loads rising, until the body fails: the factor of safety, by a bracket"
    )

    @model_validator(mode="after")
    def _something_holds(self) -> Programme:
        faults = [] if self.supports else ["at least one support"]
        if self.excavations and (self.strength_reduction or self.bracket is not None):
            faults.append("no excavations with a bracket or strength_reduction")
        if self.strength_reduction and any(load.changes for load in self.loads):
            faults.append("loads that do not change with strength_reduction")
        if faults:
            raise ValueError("; ".join(faults))
        return self


class Numerics(Model):
    """Knobs that trade accuracy for time; left out, fidelity sets them."""

    steps: Integer | None = _knob(
        "numerics.steps",
        "steps of loading (of a programme's end): fewer means heavier scaled masses, so more inertia",
        gt=100,
        le=10**12,
    )
    force_check: Number | None = _knob(
        "numerics.force_check",
        "loading slows down and speeds up so that lateral stress inside over applied, and bottom over top reaction, "
        "stay this close to 1; left out: the same speed throughout",
        ge=1e-6,
        lt=1,
    )
    least_steps: Integer | None = key(
        None, "force_check: no faster than so many steps for the whole loading; left out: steps", gt=100, le=10**12
    )
    most_steps: Integer | None = key(
        None,
        "force_check: no slower than so many steps for the whole loading; left out: 8 times steps",
        gt=100,
        le=10**12,
    )
    damping: Literal["adaptive", "local", "viscous"] = key(
        "adaptive",
        "adaptive: a global drag that follows the rate of kinetic energy; local: against each unbalanced force (0.8 "
        "gives strengths of 9 to 16 MPa where 6.6 is right); viscous: a drag of fixed coefficient",
    )
    damping_ratio: Number = key(
        0.5, "adaptive: power of the damping over the rate of kinetic energy", ge=1e-9, le=1e3
    )
    damping_share: Number | None = key(
        None, "local: share of the unbalanced force taken off against the velocity", ge=1e-9, lt=1
    )
    damping_coefficient: Frequency | None = key(
        None, "viscous: drag over (scaled) mass and velocity, at most one over the time step", ge=0
    )
    consolidation_tolerance: Number = _knob(
        "numerics.consolidation_tolerance", "unbalanced over mean zone force that ends consolidation", ge=1e-12, le=1
    )
    energy_limit: Number = key(0.05, "largest error of the energy ledger over the work done", ge=1e-12, le=1e3)
    stop_loose_blocks: Switch = key(
        False,
        "[loading]: blocks that no other touches are stopped every 250 steps; without weight they would fly for ever",
    )
    threads: Integer = key(
        1, "threads that share a run out, with bitwise the same result; pays from 2000 blocks on", ge=1, le=1024
    )

    @model_validator(mode="after")
    def _one_damping(self) -> Numerics:
        kinds = {"damping_ratio": "adaptive", "damping_share": "local", "damping_coefficient": "viscous"}
        faults = [
            f'damping = "{kind}" for {name} (found "{self.damping}")'
            for name, kind in kinds.items()
            if name in self.model_fields_set and getattr(self, name) is not None and kind != self.damping
        ]
        for name, kind in kinds.items():
            if self.damping == kind and getattr(self, name) is None:
                faults.append(f'{name}, because damping = "{kind}"')
        limits = {"least_steps": self.least_steps, "most_steps": self.most_steps}
        if self.force_check is None:
            faults += [f"force_check for {name}" for name, value in limits.items() if value is not None]
        elif None not in limits.values() and self.least_steps > self.most_steps:  # type: ignore[operator]
            faults.append(f"least_steps of at most most_steps (found {self.least_steps} and {self.most_steps})")
        if faults:
            raise ValueError("; ".join(faults))
        return self


def _course_faults(name: str, course: list[tuple[float, float]]) -> list[str]:
    times = [time for time, _ in course]
    if times[0] < 0.0 or times != sorted(times):
        return [f"{name} with times from 0 s on that do not fall"]
    return []
