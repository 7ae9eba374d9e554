"""Scene of fem-run: a plane-strain body under gravity and rising pressures. The defaults are Y's slope, 4.5."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from graben.declared.knobs import knob
from graben.schemas.quantities import (
    Acceleration,
    Density,
    Integer,
    Length,
    Number,
    Pressure,
    PressureRate,
    Switch,
    Time,
    key,
    knob_key,
)
from graben.schemas.scene import InputFile, Model, Name, Scene
from graben.schemas.scenes.material import MaterialTable

Point = tuple[Length, Length]
Corner = Annotated[Integer, Field(ge=0, lt=100_000)]

_SLOPE_CORNERS: Any = [
    ["0 m", "0 m"],
    ["30 m", "0 m"],
    ["50 m", "0 m"],
    ["60 m", "0 m"],
    ["80 m", "0 m"],
    ["0 m", "20 m"],
    ["30 m", "20 m"],
    ["50 m", "20 m"],
    ["60 m", "20 m"],
    ["80 m", "20 m"],
    ["40 m", "50 m"],
    ["55 m", "50 m"],
    ["60 m", "50 m"],
    ["80 m", "50 m"],
]
_SLOPE_PATCHES: Any = [
    [0, 1, 6, 5],
    [1, 2, 7, 6],
    [2, 3, 8, 7],
    [3, 4, 9, 8],
    [6, 7, 11, 10],
    [7, 8, 12, 11],
    [8, 9, 13, 12],
]
_SLOPE_OUTLINE: Any = [
    ["0 m", "0 m"],
    ["80 m", "0 m"],
    ["80 m", "50 m"],
    ["40 m", "50 m"],
    ["30 m", "20 m"],
    ["0 m", "20 m"],
]
_knob, _SIZE = partial(knob_key, "fem"), knob("fem", "mesh.size")
_UNDER_LOAD: Any = {"start": ["55 m", "50 m"], "end": ["60 m", "50 m"], "size": "0.4 m", "growth": 0.05}
_SLOPE_SUPPORTS: Any = [
    {"name": "left", "start": ["0 m", "0 m"], "end": ["0 m", "20 m"], "fix": "x"},
    {"name": "right", "start": ["80 m", "0 m"], "end": ["80 m", "50 m"], "fix": "x"},
    {"name": "base", "start": ["0 m", "0 m"], "end": ["80 m", "0 m"], "fix": "y"},
]
_SLOPE_LOADS: Any = [{"name": "backslope", "start": ["55 m", "50 m"], "end": ["60 m", "50 m"], "rate": "0.25 MPa/s"}]
# Y, table 4.2 (damage strains read as percent): a stand-in until a calibrated law takes its place.
_ROCK_MASS: Any = {
    "law": "drucker-prager",
    "parameters": {
        "young_modulus": "1.8 GPa",
        "poisson_ratio": 0.15,
        "friction_angle": "56 deg",
        "dilation_angle": "22 deg",
        "flow_stress_ratio": 0.81,
        "hardening": "barcelona",
        "initial_yield": "52 kPa",
        "peak_yield": "3.1 MPa",
        "strain_at_peak": 0.017,
        "damage": "ductile",
        "initiation_strain_050": 7.8e-5,
        "initiation_strain_060": 3.0e-3,
        "failure_displacement": "0.12 m",
    },
}


class Refine(Model):
    """Smaller elements near a segment."""

    start: Point = key(..., "one end of the segment")
    end: Point = key(..., "the other end (the same point for a spot)")
    size: Length = key(..., "element size at the segment", gt=0)
    growth: Number = key(0.1, "growth of the size per metre of distance", ge=0, le=1e6)


class Mesh(Model):
    """How the body is meshed."""

    method: Literal["mapped", "paved", "file"] = key(
        "mapped",
        "mapped: structured grids in convex quadrilateral patches (best shapes); paved: any simple polygon; "
        "file: quads of a file that meshio reads",
    )
    size: Length = key("1.8 m", "element size away from refinements, at standard fidelity", gt=0)
    refine: list[Refine] = key(
        [_UNDER_LOAD], "a segment with smaller elements near it (repeatable)", max_length=10_000
    )
    corners: list[Point] = key(_SLOPE_CORNERS, "mapped: corner points of the patches", max_length=100_000)
    patches: list[tuple[Corner, Corner, Corner, Corner]] = key(
        _SLOPE_PATCHES, "mapped: four corner numbers (from 0) of each patch, in order around it", max_length=100_000
    )
    outline: list[Point] = key(_SLOPE_OUTLINE, "paved: corner points of the polygon, in order", max_length=100_000)
    file: InputFile | None = key(None, "file: mesh file with 4-node quads (Gmsh, VTU, Abaqus, ...), coordinates in m")
    draft_factor: Number = key(_SIZE.draft.factor, "factor of all sizes at draft fidelity", ge=1, le=1e3)
    reference_factor: Number = key(_SIZE.reference.factor, "factor of all sizes at reference fidelity", ge=1e-3, le=1)

    @model_validator(mode="after")
    def _file_for_method(self) -> Self:
        if self.method == "file" and self.file is None:
            raise ValueError('a mesh file, because method = "file"')
        if self.method == "mapped" and not (self.corners and self.patches):
            raise ValueError('corners and patches, because method = "mapped"')
        if self.method == "paved" and len(self.outline) < 3:
            raise ValueError("an outline of at least three points")
        return self


class Support(Model):
    """Prescribed zero displacement along a segment of the outline."""

    name: Name = key("support", "name, for messages")
    start: Point = key(..., "one end of the segment")
    end: Point = key(..., "the other end")
    fix: Literal["x", "y", "both"] = key("both", "displacement held at zero: x or y (a roller), or both")


class Load(Model):
    """Pressure on a part of the outline: a steady part, and one that rises after gravity."""

    name: Name = key("load", "name, for messages")
    start: Point = key(..., "one end of the loaded segment")
    end: Point = key(..., "the other end")
    pressure: Pressure = key("0 Pa", "pressure from the start, applied with gravity; pushes into the body")
    rate: PressureRate = key("0 Pa/s", "rise of the pressure after gravity")


class Gravity(Model):
    """Weight, applied first, in load steps of its own."""

    density: Density = key("2700 kg/m^3", "bulk density", ge=0)
    horizontal: Acceleration = key("0 m/s^2", "acceleration along x")
    vertical: Acceleration = key("-9.81 m/s^2", "acceleration along y (upwards positive)")


FemField = Literal[
    "displacement", "gravity_displacement", "stress", "strain", "mean_stress", "von_mises_stress", "plastic_strain",
    "damage",
]  # fmt: skip


class Output(Model):
    """What is written."""

    fields: list[FemField] | None = key(
        None,
        "fields of VTU files; the artifact also lacks what no later stage needs; left out: all",
        max_length=50,
    )


class Stepping(Model):
    """Load steps and their equilibrium."""

    goal: Literal["failure", "end"] = key(
        "failure",
        "failure: the load at which no equilibrium is found is the result; end: not reaching the end is an error",
    )
    end: Time = key("100 s", "length of the load history after gravity", gt=0)
    first: Time = key("1 s", "first step", gt=0)
    largest: Time = _knob("stepping.largest", "largest step", gt=0)
    smallest: Time = _knob(
        "stepping.smallest", "a step that fails is halved; failure is declared below this length", gt=0
    )
    save_every: Time = key("4 s", "load time between saved states (the last state is always saved)", gt=0)
    tolerance: Number = _knob(
        "stepping.tolerance", "unbalanced force over the largest of loads and reactions", ge=1e-14, lt=1e-2
    )
    max_iterations: Integer = key(20, "factorisations per step", ge=3, le=10_000)
    relaxation: Time = key(
        "0 s",
        "viscous stabilisation, off at 0 s: a Kelvin-Voigt stress, this time times the elastic stiffness times the "
        "strain rate, beside the law's own. It carries a march past states at which Newton finds no way",
        ge=0,
    )
    overload: Number = key(
        0.02,
        "with stabilisation: failure is declared once viscous stress carries more than this part of the pressure; "
        "the failure load is the largest pressure that the law itself carried",
        ge=1e-9,
        lt=1,
    )
    extrapolate: Switch = key(True, "start each step from the last increment (fewer iterations on a smooth path)")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.smallest <= self.first <= self.largest:
            raise ValueError("steps with smallest <= first <= largest")
        return self


class FemScene(Scene):
    """A plane-strain body of quads, loaded by gravity and then by pressures up to failure."""

    kind: Literal["fem"]
    mesh: Mesh = key(Mesh(), "the mesh")
    material: MaterialTable = key(_ROCK_MASS, "constitutive law and its parameters, or a file that holds them")
    softening_width: Length = key(
        "0 m",
        "width of the zones in which the ground softens together: the characteristic length that the law gets where "
        "elements are smaller. 0 m: each element softens by itself, with its own size",
        ge=0,
    )
    gravity: Gravity = key(Gravity(), "weight")
    supports: list[Support] = key(
        _SLOPE_SUPPORTS, "a support along a segment of the outline (repeatable)", min_length=1, max_length=10_000
    )
    loads: list[Load] = key(
        _SLOPE_LOADS, "a pressure on a segment of the outline (repeatable)", min_length=1, max_length=10_000
    )
    stepping: Stepping = key(Stepping(), "load steps")
    output: Output = key(Output(), "files")

    @model_validator(mode="after")
    def _something_rises(self) -> Self:
        if self.stepping.goal == "failure" and not any(load.rate > 0 for load in self.loads):
            raise ValueError('a load with a positive rate, because stepping.goal = "failure"')
        return self
