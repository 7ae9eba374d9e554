"""Scene of scratch: one rigid grain pressed into a metal specimen, slid, and lifted. Defaults follow H 8.2."""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from graben.declared.knobs import knob
from graben.errors import Refused
from graben.schemas.quantities import Density, Integer, Length, Number, key, knob_key
from graben.schemas.scene import Model, Scene
from graben.schemas.scenes.material import MaterialTable

# Approximate true stress-strain curve of St-52 (S355): Swift's sigma = 760 MPa (0.0154 + p)^0.166, which starts at
# 380 MPa and reaches an engineering strength near 490 MPa. H prints the curve as a figure only (8.4).
_ST52: Any = {
    "law": "j2",
    "parameters": {
        "young_modulus": "210 GPa",
        "poisson_ratio": 0.33,
        "hardening": [
            [0.0, "380 MPa"],
            [0.02, "436 MPa"],
            [0.05, "483 MPa"],
            [0.1, "531 MPa"],
            [0.2, "589 MPa"],
            [0.5, "681 MPa"],
            [1.0, "762 MPa"],
            [2.0, "854 MPa"],
            [4.0, "957 MPa"],
        ],
    },
}


_knob = partial(knob_key, "scratch")
_SIZE, _SPEED = knob("scratch", "mesh.size"), knob("scratch", "numerics.slide_speed")


class Specimen(Model):
    """Block whose upper surface is scratched; base, ends and sides are held. One half is computed."""

    length: Length = key("200 um", "length, along the scratch", gt=0)
    width: Length = key("100 um", "width across the scratch (whole specimen)", gt=0)
    thickness: Length = key(
        "15 um", "thickness; the plastic zone of a 2 um dent reaches a base at 15 um (H), 30 um frees it", gt=0
    )
    density: Density = key(
        "7800 kg/m^3", "density; speeds are shares of the wave speed, so it sets the clock only", gt=0
    )


class Mesh(Model):
    """Bricks: fine under the path, growing outside."""

    size: Length = key("1.5 um", "edge under the path at standard fidelity", gt=0)
    growth: Number = _knob("mesh.growth", "ratio of neighbouring edges outside the fine range", ge=1, le=2)
    growth_depth: Number = _knob("mesh.growth_depth", "the same from the surface down", ge=1, le=2)
    draft_factor: Number = key(_SIZE.draft.factor, "factor of the edge at draft fidelity", ge=1, le=1e3)
    reference_factor: Number = key(_SIZE.reference.factor, "factor of the edge at reference fidelity", ge=1e-3, le=1)


class Tip(Model):
    """Rigid sphere and its path."""

    radius: Length = key("50 um", "radius of the sphere", gt=0)
    friction: Number = key(0.1, "Coulomb friction between grain and specimen", ge=0, le=2)
    depth: Length = key("2 um", "depth of indentation below the first surface, held while sliding", gt=0)
    start: Length = key("50 um", "position of the indentation along the specimen", gt=0)
    path: Length = key("60 um", "sliding distance; 0 um only indents (H slides 100 um)", ge=0)


class Damage(Model):
    """Limits of ERVE damage in the run; takes a material with law "erve"."""

    growth_per_joule: Number = key(
        3e5,
        "alpha of H (6.98): largest growth of damage per joule of work of the tip on the specimen. H prints 0.05 "
        "with units that change; too small does nothing, too large deletes the track: a study, not a constant",
        ge=1e-12,
        le=1e21,
    )
    remove_at: Number = key(0.95, "elements whose damage 1 - f reaches this are removed", ge=1e-6, lt=1)


def _one_or_eight(value: Any) -> Any:
    if isinstance(value, bool):  # true counts as 1
        raise Refused("1 or 8")
    return value


class Numerics(Model):
    """What trades accuracy for time. Speeds are top speeds as shares of the longitudinal wave speed."""

    points: Annotated[Literal[1, 8], BeforeValidator(_one_or_eight)] = _knob(
        "numerics.points", "integration points: 1 with hourglass control, or 8 with mean dilatation (reference)"
    )
    indent_speed: Number = key(0.003, "indentation; faster makes the tip bounce", ge=1e-9, le=0.1)
    slide_speed: Number = key(0.02, "sliding", ge=1e-9, le=0.1)
    lift_speed: Number = key(0.006, "lifting", ge=1e-9, le=0.1)
    draft_speed_factor: Number = key(_SPEED.draft.factor, "factor of the speeds at draft fidelity", ge=1, le=10)
    reference_speed_factor: Number = key(
        _SPEED.reference.factor, "factor of the speeds at reference fidelity", ge=1e-3, le=1
    )
    safety: Number = _knob("numerics.safety", "step over volume / largest face / wave speed", ge=1e-3, le=1)
    floor: Number = _knob(
        "numerics.floor", "share of the first step below which an element gets mass instead", ge=1e-6, le=1
    )
    mass_cap: Number = key(0.05, "the run stops when added mass exceeds this share of the specimen's", ge=0, le=1e6)
    refresh: Integer = _knob(
        "numerics.refresh", "steps between refreshes of the step, of removal and of the history", ge=1, le=500
    )
    hourglass: Number = _knob(
        "numerics.hourglass", "hourglass stiffness over the elastic bending stiffness", ge=0, le=1
    )
    viscosity: Number = _knob("numerics.viscosity", "linear bulk viscosity, share of the critical one", ge=0, le=0.5)
    penalty: Number = _knob(
        "numerics.penalty", "contact stiffness over E A / h of the surface element", ge=1e-6, le=5
    )
    energy_limit: Number = key(0.03, "the run stops at this energy error, share of the external work", ge=1e-12, le=1)
    volume_limit: Number = key(0.02, "without damage, the run stops when det F leaves 1 by this", ge=1e-12, le=0.5)


class Output(Model):
    """What is saved."""

    frames: Integer = key(4, "states saved while sliding, besides the ends of the phases", ge=0, le=1000)
    sections: Integer = key(
        61, "sections across the track, from one end of the fine range to the other", ge=3, le=2000
    )
    points: Integer = key(181, "points per section", ge=11, le=5000)
    fields: list[Literal["displacement", "stress", "von_mises", "plastic_strain", "damage"]] | None = key(
        None, "fields of VTU files; left out: all", max_length=50
    )


class ScratchScene(Scene):
    """A rigid grain indents a specimen, slides and lifts; the groove is measured."""

    kind: Literal["scratch"]
    specimen: Specimen = key(Specimen(), "the specimen")
    mesh: Mesh = key(Mesh(), "the mesh")
    tip: Tip = key(Tip(), "the grain and its path")
    material: MaterialTable = key(
        _ST52, "constitutive law; the default table approximates St-52 (S355), of which H prints a figure only"
    )
    damage: Damage | None = key(None, 'rate limit and removal of damaged material, with law "erve"')
    numerics: Numerics = key(Numerics(), "accuracy against time")
    output: Output = key(Output(), "what is saved")

    @property
    def contact_half_width(self) -> float:
        """a = sqrt(2 R d) [m]."""
        return math.sqrt(2.0 * self.tip.radius * self.tip.depth)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        a = self.contact_half_width
        wrong = []
        if self.tip.depth >= 0.5 * min(self.specimen.thickness, self.tip.radius):
            wrong.append("tip.depth below half of specimen.thickness and of tip.radius")
        if 1.2 * a > 0.5 * self.specimen.width:
            wrong.append(f"specimen.width of at least 2.4 contact half-widths ({2.4e6 * a:.3g} um)")
        if self.tip.start < a or self.tip.start + self.tip.path + a > self.specimen.length:
            wrong.append(f"a path that stays a contact half-width ({1e6 * a:.3g} um) inside specimen.length")
        if (self.mesh.size * self.mesh.draft_factor > a and self.fidelity == "draft") or self.mesh.size > a:
            wrong.append(f"mesh.size below the contact half-width ({1e6 * a:.3g} um)")
        if self.damage is not None and self.material.law not in (None, "erve"):
            wrong.append('material.law = "erve", because [damage] is given')
        if wrong:
            raise ValueError("; ".join(wrong))
        return self
