"""Scene of kind "blocks": jointed rock as deformable blocks, consolidated and then compressed."""

from __future__ import annotations

from functools import partial
from typing import Literal

from pydantic import model_validator

from graben.schemas.quantities import (
    Angle,
    Density,
    Integer,
    JointStiffness,
    Length,
    Number,
    Pressure,
    Switch,
    key,
    knob_key,
    law_key,
    to_si,
)
from graben.schemas.scene import InputFile, Model, Scene
from graben.schemas.scenes.blocks_loading import InSitu, Loading, Numerics, Point, Programme

# The law of blocks that yield; its elastic part is that of blocks that do not.
_knob, _law = partial(knob_key, "blocks"), partial(law_key, "mohr-coulomb")


class Domain(Model):
    """What the blocks fill: an upright rectangle, or any simple polygon."""

    width: Length = key("10 m", "width of the rectangle", gt=0)
    height: Length = key("10 m", "height of the rectangle", gt=0)
    outline: list[Point] | None = key(
        None,
        "corner points of a polygon, in order around it, instead of the rectangle",
        min_length=3,
        max_length=100_000,
    )
    holes: list[list[Point]] = key(
        [], "polygons in the domain: blocks whose middle lies in one are left out", max_length=10_000
    )

    @property
    def corners(self) -> list[Point]:
        """Corner points of the outline [m]."""
        if self.outline is not None:
            return self.outline
        w, h = self.width, self.height
        return [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)]

    @property
    def smallest_side(self) -> float:
        """Smaller side of the box around the domain [m]."""
        return min(max(c[k] for c in self.corners) - min(c[k] for c in self.corners) for k in (0, 1))


class JointSet(Model):
    """Parallel joints; sets cut the domain one after the other, in the order given."""

    dip: Angle = key(..., "angle of the joints from the x axis, counter-clockwise", ge=-7, le=7)
    spacing: Length = key(..., "mean distance between joints", gt=0)
    persistence: Number = key(1.0, "probability that a block which a joint crosses is cut by it", ge=0, le=1)
    dip_scatter: Angle = key("0 deg", "standard deviation of the angle of each joint", ge=0, le=1.57)
    spacing_scatter: Number = key(0.0, "standard deviation of each distance, over the spacing", ge=0, le=1)


class Tessellation(Model):
    """The blocks; the defaults are Voronoi blocks with the statistics of UDEC's generator."""

    method: Literal["voronoi", "joint-sets", "file"] = key(
        "voronoi",
        "voronoi: random blocks of one size; joint-sets: cut by sets of parallel joints; file: polygons given",
    )
    sets: list[JointSet] = key([], "joint-sets: the sets of joints (repeatable)", max_length=1000)
    file: InputFile | None = key(
        None, "file: polygons that fill the domain, in m, as GeoJSON or the cells of any mesh that meshio reads"
    )
    edge: Length = key(
        "0.5 m",
        "nominal edge; a Voronoi block has 0.955 times its square as mean area; other limits scale with it",
        gt=0,
    )
    lloyd_passes: Integer = key(4, "passes that even out the blocks", ge=0, le=1000)
    shortest_edge: Length | None = key(
        None, "shorter edges are collapsed; left out: 0.48 of the edge (voronoi), 0.1 of it (others)", ge=0
    )
    thinnest: Length | None = key(
        None,
        "joint-sets and file: blocks whose area over their longest diagonal is less join the neighbour with the "
        "longest common edge; left out: 0.1 of the edge",
        ge=0,
    )
    rounding: Length = key("0.05 m", "corners are cut off at this distance from them, along both edges", gt=0)
    zone_edge: Length | None = _knob(
        "tessellation.zone_edge", "longest zone edge; left out: zones span the block corners only", gt=0
    )


_GRANITE = {"friction": "51 deg", "cohesion": "55.1 MPa", "tension": "11.7 MPa", "dilation": "0 deg"}
"""Y's granite in UDEC."""


class Rock(Model):
    """The blocks themselves, in plane strain; strengths left out are those of Y's granite in UDEC."""

    zones: Literal["elastic", "mohr-coulomb", "rigid"] = key(
        "elastic",
        "elastic: zones deform; mohr-coulomb: they also yield, in shear and in tension; rigid: blocks without zones",
    )
    young: Pressure = _law("young_modulus", "65 GPa", "Young's modulus (rigid blocks have none)")
    poisson: Number = _law("poisson_ratio", 0.2, "Poisson's ratio (rigid blocks have none)")
    density: Density = key("2700 kg/m^3", "density", gt=0)
    friction: Angle | None = _law(
        "friction_angle", None, f"mohr-coulomb: friction angle; left out: {_GRANITE['friction']}"
    )
    cohesion: Pressure | None = _law("cohesion", None, f"mohr-coulomb: cohesion; left out: {_GRANITE['cohesion']}")
    tension: Pressure | None = _law(
        "tensile_strength",
        None,
        f"mohr-coulomb: tensile strength, cut at the cone's apex; left out: {_GRANITE['tension']}",
    )
    dilation: Angle | None = _law(
        "dilation_angle", None, f"mohr-coulomb: dilation angle, at most friction; left out: {_GRANITE['dilation']}"
    )

    @property
    def strength(self) -> tuple[float, float, float, float]:
        """Friction [rad], cohesion, tension [Pa], dilation [rad]."""
        given = (self.friction, self.cohesion, self.tension, self.dilation)
        left_out = (
            to_si(text, unit) for text, unit in zip(_GRANITE.values(), ("rad", "Pa", "Pa", "rad"), strict=True)
        )
        friction, cohesion, tension, dilation = (d if g is None else g for g, d in zip(given, left_out, strict=True))
        return friction, cohesion, tension, dilation

    @model_validator(mode="after")
    def _only_what_the_zones_use(self) -> Rock:
        strength = ("friction", "cohesion", "tension", "dilation")
        unused = ", ".join(name for name in strength if getattr(self, name) is not None)
        if unused and self.zones != "mohr-coulomb":
            raise ValueError(f'zones = "mohr-coulomb", because {unused} is given (found "{self.zones}")')
        if self.strength[3] > self.strength[0]:
            raise ValueError("dilation of at most the friction angle")
        return self


_SLOPE = {"ge": 0, "lt": 1.57}  # angles of joints: their tangents are finite


class JointsOfSet(Model):
    """Joints of one set that differ from the others; what is left out is as in [joints]."""

    set: Integer = key(
        ..., "number of the set: the first of [[tessellation.sets]] is 1; as numbered in a file", ge=1, le=1_000_000
    )
    normal_stiffness: JointStiffness | None = key(None, "normal stiffness", gt=0)
    shear_stiffness: JointStiffness | None = key(None, "shear stiffness", gt=0)
    friction: Angle | None = key(None, "friction angle", **_SLOPE)
    cohesion: Pressure | None = key(None, "cohesion", ge=0)
    tension: Pressure | None = key(None, "tensile strength", ge=0)
    dilation: Angle | None = key(None, "dilation angle", **_SLOPE)
    dilation_limit: Length | None = key(None, "net slip at which dilation stops", gt=0)
    residual_friction: Angle | None = key(None, "friction once a joint has broken", **_SLOPE)
    residual_cohesion: Pressure | None = key(None, "cohesion once a joint has broken", ge=0)
    closure: Length | None = key(None, "largest closure of joints that stiffen", gt=0)


class Joints(Model):
    """Coulomb slip with area contact; the defaults are those of Y table 4.1, tension as in the UDEC model (0)."""

    normal_stiffness: JointStiffness = key("10 GPa/m", "normal stiffness", gt=0)
    shear_stiffness: JointStiffness = key("1 GPa/m", "shear stiffness", gt=0)
    friction: Angle = key("32 deg", "friction angle", **_SLOPE)
    cohesion: Pressure = key("100 kPa", "cohesion, kept while sliding", ge=0)
    tension: Pressure = key("0 Pa", "tensile strength, lost once broken", ge=0)
    dilation: Angle = key("5 deg", "dilation angle", **_SLOPE)
    dilation_limit: Length | None = key(None, "net slip at which dilation stops; left out: never", gt=0)
    residual_friction: Angle | None = key(
        None, "friction once a joint has broken, by slip or in tension; left out: as before", **_SLOPE
    )
    residual_cohesion: Pressure | None = key(None, "cohesion once a joint has broken; left out: as before", ge=0)
    closure: Length | None = key(
        None,
        "largest closure of joints that stiffen as they close, from normal_stiffness on (Barton and Bandis); "
        "left out: linear",
        gt=0,
    )
    sets: list[JointsOfSet] = key(
        [],
        "joint-sets and file: joints of one set with properties of their own (repeatable); where edges of two sets "
        "meet, after blocks have moved, the joint is that of lower friction, then of lower cohesion",
        max_length=1000,
    )

    def of_set(self, number: int) -> Joints:
        """Properties of the joints of a set."""
        own = [s.model_dump(exclude_none=True, exclude={"set"}) for s in self.sets if s.set == number]
        return self.model_copy(update=own[0]) if own else self


class Output(Model):
    """What is written beside the artifact."""

    balance: Switch = key(
        False,
        "also body_force and overlap_moment, with which homogenize closes the balance of stress by zones and by "
        "forces to round-off",
    )
    vtk: Switch = key(True, "VTU files with a PVD for ParaView: zones and, in NAME-joints, contacts")


class BlocksScene(Scene):
    """Jointed rock, compressed to failure under confinement, or loaded by its weight and by rising pressures."""

    kind: Literal["blocks"]
    domain: Domain = key(default_factory=Domain, description="domain")
    tessellation: Tessellation = key(default_factory=Tessellation, description="blocks")
    rock: Rock = key(default_factory=Rock, description="blocks' rock")
    joints: Joints = key(default_factory=Joints, description="joints")
    in_situ: InSitu | None = key(None, "stress in blocks and joints from the start; left out: none")
    loading: Loading = key(default_factory=Loading, description="biaxial compression of a rectangle")
    programme: Programme | None = key(
        None, "weight and rising pressures on any outline, instead of [loading]; the defaults are Y's slope, 4.5"
    )
    numerics: Numerics = key(default_factory=Numerics, description="numerics")
    output: Output = key(default_factory=Output, description="files")

    @model_validator(mode="after")
    def _consistent(self) -> BlocksScene:
        faults = []
        t, d = self.tessellation, self.domain
        # A map brings its own size, which is known where it is read.
        sized = t.method != "file" or bool({"width", "height", "outline"} & d.model_fields_set)
        if sized and t.edge > 0.5 * d.smallest_side:
            faults.append(f"tessellation.edge of at most half the domain (found {t.edge:.4g} m)")
        if t.method == "file" and t.file is None:
            faults.append('tessellation.file, because method = "file"')
        if t.method == "joint-sets" and not t.sets:
            faults.append('at least one [[tessellation.sets]], because method = "joint-sets"')
        numbers = [s.set for s in self.joints.sets]
        if numbers and t.method == "voronoi":
            faults.append('tessellation.method = "joint-sets" or "file", because of [[joints.sets]]')
        elif len(set(numbers)) < len(numbers):
            faults.append(f"one entry of [[joints.sets]] for each set (found sets {numbers})")
        elif numbers and t.method == "joint-sets" and max(numbers) > len(t.sets):
            faults.append(f"joints.sets of the {len(t.sets)} sets in [[tessellation.sets]] (found {max(numbers)})")
        if self.rock.zones == "rigid" and t.zone_edge is not None:
            faults.append('no tessellation.zone_edge, because rock.zones = "rigid"')
        if self.rock.zones == "rigid":
            dug = self.programme is not None and bool(self.programme.excavations)
            asked = {"in_situ": self.in_situ, "numerics.force_check": self.numerics.force_check}
            faults += [
                f'no {name}, because rock.zones = "rigid"' for name, value in asked.items() if value is not None
            ]
            faults += ['no programme.excavations, because rock.zones = "rigid"'] if dug else []
        if self.rock.zones == "rigid" and self.output.balance:
            faults.append('no output.balance, because rock.zones = "rigid" (stress comes from the forces)')
        if t.rounding > 0.25 * t.edge:
            faults.append(f"tessellation.rounding of at most a quarter of the edge (found {t.rounding:.4g} m)")
        if t.shortest_edge is not None and t.shortest_edge > t.edge:
            faults.append(f"tessellation.shortest_edge below the edge (found {t.shortest_edge:.4g} m)")
        if self.programme is not None and self.numerics.stop_loose_blocks:
            faults.append("[loading] with numerics.stop_loose_blocks (under weight loose blocks fall)")
        strain = self.loading.largest_travel / d.height
        if self.programme is not None and "loading" in self.model_fields_set:
            faults.append("either [loading] or [programme]")
        if self.programme is not None and self.numerics.force_check is not None:
            faults.append("numerics.force_check with [loading] only (a frame paces a programme)")
        if self.in_situ is not None and self.in_situ.k0 is not None and self.programme is None:
            faults.append("in_situ.k0 with a [programme], which has weight")
        if self.programme is None and d.outline is not None:
            faults.append("[programme] with a domain.outline ([loading] compresses the rectangle)")
        elif self.programme is None and sized and strain > 0.5:
            faults.append(f"loading that shortens the domain by at most one half (found {strain:.3g})")
        if faults:
            raise ValueError("; ".join(faults))
        return self
