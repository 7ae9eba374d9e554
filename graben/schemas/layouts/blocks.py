"""Blocks: states of an assembly of deformable blocks, with all that averaging needs."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_T, _V, _Z, _B, _C, _L = ("time",), ("vertex",), ("zone",), ("block",), ("contact",), ("look",)


def _energy(long_name: str) -> Variable:
    return Variable(_T, "J m-1", long_name)


def _rising(dims: tuple[str, ...], units: str, long_name: str) -> Variable:
    """Known only for pressures that rise."""
    return Variable(dims, units, long_name, optional=True)


LAYOUT = Layout(
    kind="blocks",
    version=1,
    title="Jointed rock as deformable blocks",
    filled=("time", "vertex", "block"),
    dims={
        "time": "saved states; the first is the start of loading, after consolidation",
        "vertex": "grid points; each block owns its own",
        "zone": "constant-strain triangles, counter-clockwise; rigid blocks have none",
        "zone_corner": "the three vertices of a zone",
        "block": "blocks",
        "corner": "corners of all blocks, block by block, counter-clockwise",
        "contact": "touching edges of two blocks, state after state (contact_count of each)",
        "pair": "first and second block of a contact",
        "wall": "sides of the domain, from corner k of the outline to corner k + 1",
        "axis": "x, y (y is up)",
        "look": "moments at which rising pressures were looked at",
        "surface": "vertices of the free and loaded outline, along it",
        "component": "xx, yy, zz, xy",
        "plane": "xx, yy, xy",
    },
    variables={
        "time": Variable(_T, "s", "time since the first state"),
        "vertex_position": Variable(("vertex", "axis"), "m", "position at the first state"),
        "vertex_block": Variable(_V, "1", "block of the vertex", dtype="i4", index_of="block"),
        "zone_vertex": Variable(("zone", "zone_corner"), "1", "vertices of the zone", dtype="i4", index_of="vertex"),
        "zone_block": Variable(_Z, "1", "block of the zone", dtype="i4", index_of="block"),
        "block_area": Variable(_B, "m2", "area of the block, unstressed"),
        "block_corner_count": Variable(_B, "1", "corners of the block", dtype="i4", sum_of="corner"),
        "block_corner": Variable(("corner",), "1", "vertex of the corner", dtype="i4", index_of="vertex"),
        "displacement": Variable(("time", "vertex", "axis"), "m", "displacement since the first state"),
        "velocity": Variable(("time", "vertex", "axis"), "m s-1", "velocity", optional=True),
        "zone_stress": Variable(("time", "zone", "component"), "Pa", "Cauchy stress, tension positive"),
        "block_stress": Variable(
            ("time", "block", "plane"),
            "Pa",
            "mean Cauchy stress of rigid blocks, from the forces on them",
            optional=True,
        ),
        "zone_plastic_strain": Variable(
            ("time", "zone"), "1", "equivalent plastic strain, sum of sqrt(2/3 de:de)", optional=True
        ),
        "zone_state": Variable(
            ("time", "zone"),
            "1",
            "what the zone does",
            dtype="i1",
            optional=True,
            attributes={
                "flag_values": [0, 1, 2, 3],
                "flag_meanings": "elastic in_shear in_tension before",
            },
        ),
        "boundary_force": Variable(
            ("time", "vertex", "axis"), "N m-1", "force of walls and pressures on the vertex, per thickness"
        ),
        "wall_reaction": Variable(("time", "wall", "axis"), "N m-1", "sum of boundary_force along the side"),
        "confining_stress": Variable((), "Pa", "normal stress applied to the lateral sides, tension positive"),
        "confining_stress_then": Variable(
            _T, "Pa", "normal stress applied to the lateral sides at the state, where it changes", optional=True
        ),
        "lateral_over_applied_stress": Variable(
            _T, "1", "mean lateral stress of zones in the middle over the one applied to the sides", optional=True
        ),
        "friction_over_confinement": Variable(
            _T,
            "1",
            "lateral confinement by friction or supports at the ends over that by the pressure",
            optional=True,
        ),
        "outline": Variable(("wall", "axis"), "m", "corners of the domain before consolidation"),
        "contact_count": Variable(_T, "1", "contacts of the state", dtype="i4", sum_of="contact"),
        "contact_block": Variable(("contact", "pair"), "1", "blocks of the contact", dtype="i4", index_of="block"),
        "contact_position": Variable(("contact", "axis"), "m", "middle of the contact"),
        "contact_tangent": Variable(("contact", "axis"), "1", "unit vector along the contact"),
        "contact_force": Variable(("contact", "axis"), "N m-1", "force on the first block, per thickness"),
        "contact_force_moment": Variable(
            ("contact", "axis"),
            "N",
            "first moment of the force along the tangent about the middle: both ends carry their own force",
            optional=True,
        ),
        "contact_set": Variable(
            _C, "1", "set of joints of the contact; 0: those of [joints] itself", dtype="i2", optional=True
        ),
        "contact_normal_stress": Variable(_C, "Pa", "mean normal stress, tension positive", optional=True),
        "contact_shear_stress": Variable(
            _C, "Pa", "mean shear stress on the first block, along the tangent", optional=True
        ),
        "contact_length": Variable(_C, "m", "length over which the edges face each other"),
        "contact_slip": Variable(_C, "m", "net plastic sliding, mean of both ends"),
        "contact_opening": Variable(_C, "m", "gap, mean of both ends; negative: overlap", optional=True),
        "contact_state": Variable(
            _C,
            "1",
            "state of the contact",
            dtype="i1",
            attributes={"flag_values": [0, 1, 2, 3], "flag_meanings": "stick slip open broken"},
        ),
        "loose_blocks": Variable(
            _T, "1", "blocks on which no other pushes and that nothing holds", dtype="i4", optional=True
        ),
        "body_force": Variable(
            ("time", "vertex", "axis"),
            "N m-1",
            "weight less inertia and damping on the vertex: with zones, contacts and boundary_force it adds up to 0",
            optional=True,
        ),
        "overlap_moment": Variable(
            ("time", "block", "component"),
            "N",
            "force (x) distance from the middle of the block's contacts to its edges, which bear",
            optional=True,
        ),
        "energy_kinetic": _energy("kinetic energy (of the scaled masses)"),
        "energy_kinetic_loose": Variable(
            _T, "J m-1", "part of the kinetic energy that loose blocks have", optional=True
        ),
        "energy_strain": _energy("strain energy of the zones"),
        "energy_joint": _energy("energy stored in the joints"),
        "energy_friction": _energy("energy taken by sliding since the first state"),
        "energy_plastic": Variable(
            _T, "J m-1", "energy taken by yielding zones since the first state", optional=True
        ),
        "energy_damping": _energy("energy taken by damping since the first state"),
        "energy_boundary": _energy("work of moving walls since the first state"),
        "energy_external": _energy("work of pressures and gravity since the first state"),
        "energy_error": _energy("work done on the blocks less everything accounted for"),
        "energy_excavated": Variable(
            _T, "J m-1", "energy that left with blocks taken out, where there are such", optional=True
        ),
        "block_removed": Variable(
            ("time", "block"),
            "1",
            "1 once the block is taken out: it bears nothing and stays where it was",
            dtype="i1",
            optional=True,
        ),
        "load_time": _rising(_T, "s", "time for which pressures have risen, waiting not counted"),
        "look_load_time": _rising(_L, "s", "time for which pressures had risen, waiting not counted"),
        "look_settlement": _rising(_L, "m", "displacement along the rising pressures, mean over the loaded length"),
        "look_imbalance": _rising(_L, "1", "mean unbalanced force over mean zone force"),
        "look_load_at_rest": _rising(_L, "s", "load time of the load in balance with the rock alone"),
        "surface_vertex": Variable(
            ("surface",), "1", "vertex of the outline", dtype="i4", optional=True, index_of="vertex"
        ),
        "surface_carried_displacement": _rising(
            ("surface", "axis"), "m", "displacement of the outline when the last wait began: the last load carried"
        ),
    },
    attributes={"thickness_m": "1"},
)
