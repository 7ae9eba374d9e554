"""Scene of kind "particles": a bed of grains that is poured, settled, shaken if asked, pressed and counted."""

from __future__ import annotations

from functools import partial
from typing import Literal

from pydantic import model_validator

from graben.schemas.quantities import (
    Acceleration,
    ContactStiffness,
    Density,
    Integer,
    Length,
    Number,
    Pressure,
    Switch,
    key,
    knob_key,
)
from graben.schemas.scene import Model, Name, Scene

_knob = partial(knob_key, "particles")


class GrainSize(Model):
    """Equal grains."""

    name: Name = key(..., "name of the class", min_length=1, examples=["grains"])
    diameter: Length = key(..., "diameter", gt=0, examples=["100 um"])
    share: Number = key(1.0, "volume share of the class; the shares sum to 1", ge=0, le=1)
    density: Density = key("2200 kg/m^3", "density (default: quartz sand, H table 8.3)", gt=0)


class Box(Model):
    """Where the grains lie."""

    width: Length = key("2 mm", "length of both sides", gt=0)
    depth: Length = key("0.6 mm", "depth of the bed before pressing, at a solid fraction of 0.6", gt=0)
    sides: Literal["periodic", "walls"] = key("periodic", "sides repeat, or are hard walls (which bias the count)")


class Contact(Model):
    """Linear contacts, H (4.11)-(4.12), with friction and viscous damping."""

    normal_stiffness: ContactStiffness | None = key(
        None, "of one grain; left out: such that the pressure gives the overlap below", gt=0
    )
    overlap: Number = _knob(
        "contact.overlap", "mean overlap over the smallest diameter at the pressure", ge=1e-9, le=0.05
    )
    wall_stiffness_ratio: Number = key(
        10.0, "stiffness of floor, piston and walls over that of a grain", ge=1e-6, le=1e6
    )
    shear_ratio: Number = key(0.8, "tangential over normal stiffness (where friction acts)", ge=1e-6, le=1e3)
    friction: Number = key(0.0, "Coulomb friction between grains; 0 switches rotation and history off", ge=0, le=1e3)
    wall_friction: Number = key(0.0, "Coulomb friction on floor, piston and walls", ge=0, le=1e3)
    damping: Number = key(0.3, "viscous damping of a contact over critical damping, H (4.10)", ge=0, le=1)


class Loading(Model):
    """Gravity and piston."""

    gravity: Acceleration = key("9.81 m/s^2", "gravity", gt=0)
    pressure: Pressure = key("30 Pa", "pressure of the piston; see docs for why it need not be the machine's", gt=0)
    ramp: Number = _knob(
        "loading.ramp",
        "time over which the pressure rises, in half periods of the bed's slowest mode",
        ge=1e-3,
        le=1e6,
    )


class Shaking(Model):
    """Vertical harmonic motion of the floor after settling."""

    cycles: Integer = key(50, "number of cycles", gt=0, le=10**9)
    amplitude: Number = key(0.1, "amplitude over the smallest diameter", ge=1e-9, le=1e3)
    acceleration: Number = key(2.0, "peak acceleration over gravity", ge=1e-9, le=1e6)


class Numerics(Model):
    """Knobs that trade accuracy for time; left out, fidelity sets them."""

    safety: Number | None = _knob("numerics.safety", "time step over the estimated critical one", ge=1e-6, le=1)
    rest: Number | None = _knob(
        "numerics.rest",
        "kinetic energy over weight times smallest radius at which a poured bed has settled",
        ge=1e-30,
        le=1e6,
    )
    balance: Number | None = _knob(
        "numerics.balance", "unbalanced force over mean contact force at which the bed is at rest", ge=1e-15, le=1e3
    )
    loose_fraction: Number = key(0.25, "solid fraction of the column that is poured", ge=0.01, le=0.35)
    energy_limit: Number = key(0.05, "largest allowed error of the energy balance", ge=1e-12, le=1e3)
    max_steps: Integer = key(
        2_000_000, "steps after which a bed that does not come to rest is given up", gt=0, le=10**12
    )


class Output(Model):
    """What is written beside the artifact."""

    vtk: Switch = key(True, "VTU files with a PVD for ParaView, one per phase, of the first bed")
    fields: list[Literal["radius", "class", "velocity", "coordination", "floor_force"]] | None = key(
        None,
        "fields of VTU files; the artifact also lacks what no later stage needs; left out: all",
        max_length=50,
    )


class ParticlesScene(Scene):
    """A bed of grains: settle, press, count the grains that push on the floor."""

    kind: Literal["particles"]
    beds: Integer = _knob(
        "beds", "beds with seeds seed, seed + 1, ...; their scatter gives the confidence interval", ge=1, le=100_000
    )
    box: Box = key(default_factory=Box, description="the box")
    grains: tuple[GrainSize, ...] = key(
        ...,
        "grain classes",
        min_length=1,
        examples=[[{"name": "grains", "diameter": "100 um", "share": 1.0, "density": "2200 kg/m^3"}]],
    )
    contact: Contact = key(default_factory=Contact, description="contacts")
    loading: Loading = key(default_factory=Loading, description="gravity and piston")
    shaking: Shaking | None = key(None, "shake the floor between settling and pressing (off)")
    numerics: Numerics = key(default_factory=Numerics, description="numerics")
    output: Output = key(default_factory=Output, description="files")

    @model_validator(mode="after")
    def _consistent(self) -> ParticlesScene:
        faults = []
        total = sum(g.share for g in self.grains)
        if abs(total - 1.0) > 1e-6:
            faults.append(f"shares of grains with sum 1 (found {total:g})")
        names = [g.name for g in self.grains]
        if len(set(names)) < len(names):
            faults.append(f"different names in grains (found {names})")
        largest = max(g.diameter for g in self.grains)
        smallest = min(g.diameter for g in self.grains)
        if self.box.sides == "periodic" and self.box.width < 3.0 * (largest + 0.2 * smallest):
            faults.append(
                f"box.width of at least {3.0 * (largest + 0.2 * smallest):.4g} m, three of its largest grains "
                f"(found {self.box.width:.4g} m)"
            )
        if self.box.depth < largest:
            faults.append(f"box.depth of at least one diameter, {largest:.4g} m (found {self.box.depth:.4g} m)")
        for g in self.grains:
            solid = 0.6 * self.box.width**2 * self.box.depth * g.share
            if g.share > 0 and round(solid / (0.5235987755982988 * g.diameter**3)) == 0:
                faults.append(f"a bed that holds at least one grain of class {g.name!r} (box and share leave none)")
        if faults:
            raise ValueError("; ".join(faults))
        return self
