"""Scene of kind "blocks": jointed rock as deformable blocks, consolidated and then compressed."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from graben.schemas.quantities import Angle, Density, JointStiffness, Length, Pressure, Speed, Time, key
from graben.schemas.scene import Model, Scene


class Domain(Model):
    """The upright rectangle that the blocks fill."""

    width: Length = key("10 m", "width", gt=0)
    height: Length = key("10 m", "height", gt=0)


class Tessellation(Model):
    """Voronoi blocks; the defaults give the block statistics of UDEC's generator."""

    edge: Length = key("0.5 m", "nominal edge; a block has 0.955 times its square as mean area", gt=0)
    lloyd_passes: int = key(4, "passes that even out the blocks", ge=0, le=1000)
    shortest_edge: Length | None = key(None, "shorter edges are collapsed; left out: 0.48 of the edge", ge=0)
    rounding: Length = key("0.05 m", "corners are cut off at this distance from them, along both edges", gt=0)
    zone_edge: Length | None = key(None, "longest zone edge; left out: zones span the block corners only", gt=0)


class Rock(Model):
    """The blocks themselves: elastic, plane strain."""

    young: Pressure = key("65 GPa", "Young's modulus", gt=0)
    poisson: float = key(0.2, "Poisson's ratio", gt=-1, lt=0.5)
    density: Density = key("2700 kg/m^3", "density", gt=0)


class Joints(Model):
    """Coulomb slip with area contact; the defaults are those of Y table 4.1, tension as in the UDEC model (0)."""

    normal_stiffness: JointStiffness = key("10 GPa/m", "normal stiffness", gt=0)
    shear_stiffness: JointStiffness = key("1 GPa/m", "shear stiffness", gt=0)
    friction: Angle = key("32 deg", "friction angle", ge=0, lt=1.57)
    cohesion: Pressure = key("100 kPa", "cohesion, kept while sliding", ge=0)
    tension: Pressure = key("0 Pa", "tensile strength, lost once broken", ge=0)
    dilation: Angle = key("5 deg", "dilation angle", ge=0, lt=1.57)
    dilation_limit: Length | None = key(None, "net slip at which dilation stops; left out: never", gt=0)


class Loading(Model):
    """Confinement first, then the top moves down."""

    confining_pressure: Pressure = key("0.5 MPa", "normal pressure on the left and right sides", gt=0)
    vertical_ratio: float = key(0.5, "vertical over confining pressure during consolidation", gt=0)
    speed: Speed = key("5 mm/s", "speed of the top, downwards", gt=0)
    duration: Time = key("100 s", "time of loading", gt=0)
    states: int = key(51, "saved states, the first before loading", ge=2)


class Numerics(Model):
    """Knobs that trade accuracy for time; left out, fidelity sets them."""

    steps: int | None = key(None, "steps of loading: fewer means heavier scaled masses, so more inertia", gt=100)
    damping_ratio: float = key(0.5, "power of the adaptive damping over the rate of kinetic energy", gt=0)
    consolidation_tolerance: float = key(1e-3, "unbalanced over mean zone force that ends consolidation", gt=0)
    energy_limit: float = key(0.05, "largest error of the energy ledger over the work done", gt=0)


class Output(Model):
    """What is written beside the artifact."""

    vtk: bool = key(True, "VTU files with a PVD for ParaView: zones and, in NAME-joints, contacts")


class BlocksScene(Scene):
    """A rectangle of jointed rock, compressed to failure under confinement."""

    kind: Literal["blocks"]
    domain: Domain = key(default_factory=Domain, description="domain")
    tessellation: Tessellation = key(default_factory=Tessellation, description="blocks")
    rock: Rock = key(default_factory=Rock, description="blocks' rock")
    joints: Joints = key(default_factory=Joints, description="joints")
    loading: Loading = key(default_factory=Loading, description="loading")
    numerics: Numerics = key(default_factory=Numerics, description="numerics")
    output: Output = key(default_factory=Output, description="files")

    @model_validator(mode="after")
    def _consistent(self) -> BlocksScene:
        faults = []
        t, d = self.tessellation, self.domain
        if t.edge > 0.5 * min(d.width, d.height):
            faults.append(f"tessellation.edge of at most half the domain (found {t.edge:.4g} m)")
        if t.rounding > 0.25 * t.edge:
            faults.append(f"tessellation.rounding of at most a quarter of the edge (found {t.rounding:.4g} m)")
        if t.shortest_edge is not None and t.shortest_edge > t.edge:
            faults.append(f"tessellation.shortest_edge below the edge (found {t.shortest_edge:.4g} m)")
        strain = self.loading.speed * self.loading.duration / d.height
        if strain > 0.5:
            faults.append(f"loading that shortens the domain by at most one half (found {strain:.3g})")
        if faults:
            raise ValueError("; ".join(faults))
        return self
