"""Particles: beds of spheres, their contacts, and what touches the floor."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_P, _C, _B, _K, _S = ("particle",), ("contact",), ("bed",), ("class",), ("sample",)


def _energy(long_name: str) -> Variable:
    return Variable(_S, "J", long_name)


LAYOUT = Layout(
    kind="particles",
    version=1,
    title="Beds of spheres pressed on a floor",
    filled=("class", "bed", "particle", "state"),
    dims={
        "class": "spheres of equal radius and density",
        "bed": "realizations, each from its own seed",
        "particle": "spheres of all beds, in order of insertion",
        "contact": "touching pairs of spheres of all beds at the end",
        "state": "ends of the phases: inserted, settled, shaken (if asked), pressed, quenched",
        "sample": "rows of the history of all beds",
        "side": "first and second sphere of a contact",
        "force": "contacts with spheres and walls of each bed at each state: state_contact_count of each",
        "axis": "x, y, z (z is up, the floor is z = 0)",
    },
    variables={
        "class_name": Variable(_K, "1", "name of the class", dtype="U"),
        "class_diameter": Variable(_K, "m", "diameter"),
        "class_density": Variable(_K, "kg m-3", "density of the grains"),
        "class_share": Variable(_K, "1", "volume share asked for"),
        "class_stiffness": Variable(_K, "N m-1", "normal stiffness of one grain"),
        "floor_contacts_per_area": Variable(_K, "m-2", "grains that push on the floor, per area: mean over the beds"),
        "floor_contacts_low": Variable(_K, "m-2", "lower end of the 95 % confidence interval of that mean"),
        "floor_contacts_high": Variable(_K, "m-2", "upper end of the 95 % confidence interval of that mean"),
        "floor_contact_force": Variable(_K, "N", "mean force of a floor contact (0 where none)"),
        "bed_seed": Variable(_B, "1", "seed of the bed", dtype="i8"),
        "bed_area": Variable(_B, "m2", "area of the floor"),
        "bed_width": Variable(("bed",), "m", "length of the sides"),
        "bed_pressure": Variable(_B, "Pa", "pressure of the piston on the bed (positive: compression)"),
        "bed_solid_fraction": Variable(_B, "1", "solid volume over volume between floor and piston"),
        "bed_piston_height": Variable(_B, "m", "height of the piston at the end"),
        "bed_unbalanced": Variable(_B, "1", "mean net force over mean contact force at the end"),
        "bed_floor_share_of_weight": Variable(
            _B, "1", "part of the weight that the floor carries before pressing", optional=True
        ),
        "bed_wall_share_of_weight": Variable(
            _B, "1", "part of the weight that friction on the side walls carries before pressing", optional=True
        ),
        "floor_count": Variable(("bed", "class"), "1", "grains that push on the floor", dtype="i8"),
        "particle_bed": Variable(_P, "1", "index of the bed", dtype="i8", index_of="bed"),
        "particle_class": Variable(_P, "1", "index of the class", dtype="i8", index_of="class"),
        "particle_radius": Variable(_P, "m", "radius"),
        "position": Variable(("state", "particle", "axis"), "m", "centre"),
        "velocity": Variable(("particle", "axis"), "m s-1", "velocity at the end", optional=True),
        "floor_force": Variable(_P, "N", "push on the floor at the end (0: no contact)"),
        "coordination": Variable(
            _P, "1", "contacts of the sphere at the end, walls included", dtype="i8", optional=True
        ),
        "contact_particle": Variable(
            ("contact", "side"), "1", "indices of the two spheres", dtype="i8", index_of="particle"
        ),
        "contact_normal": Variable(("contact", "axis"), "1", "unit vector from the first to the second sphere"),
        "contact_force": Variable(_C, "N", "normal force, positive: push"),
        "state_name": Variable(("state",), "1", "name of the phase", dtype="U"),
        "state_time": Variable(("bed", "state"), "s", "time at the end of the phase"),
        "bed_periodic": Variable(_B, "1", "1 where the sides repeat", dtype="i1", optional=True),
        "state_contact_count": Variable(
            ("bed", "state"),
            "1",
            "entries of dim force, bed by bed and state by state",
            dtype="i8",
            optional=True,
            sum_of="force",
        ),
        "state_contact_particle": Variable(
            ("force", "side"),
            "1",
            "indices of the two spheres (-1: a wall)",
            dtype="i8",
            optional=True,
            index_of="particle or -1",
        ),
        "state_contact_force": Variable(
            ("force", "axis"), "N", "force on the first sphere, friction included, dashpots not", optional=True
        ),
        "state_contact_arm": Variable(
            ("force", "axis"), "m", "from the centre of the first sphere to the contact", optional=True
        ),
        "sample_bed": Variable(_S, "1", "index of the bed", dtype="i8", index_of="bed"),
        "time": Variable(_S, "s", "time"),
        "kinetic": _energy("kinetic energy of grains and piston"),
        "elastic": _energy("energy in contact springs"),
        "potential": _energy("energy in gravity (0 at the floor)"),
        "dashpots": _energy("energy taken by contact dashpots"),
        "friction": _energy("energy taken by friction"),
        "drag": _energy("energy taken by the drag of the quench and the piston's dashpot"),
        "floor_work": _energy("work of the moving floor on the grains"),
        "piston_work": _energy("work of the force on the piston"),
        "total": _energy("sum of all entries, constant when the steps are exact"),
        "unbalanced": Variable(_S, "1", "mean net force over mean contact force (1e30: no contact yet)"),
        "floor_push": Variable(_S, "N", "force on the floor"),
        "piston_push": Variable(_S, "N", "force on the piston"),
        "piston_height": Variable(_S, "m", "height of the piston (0: not there yet)"),
        "floor_contacts": Variable(_S, "1", "grains that push on the floor"),
        "wall_lift": Variable(_S, "N", "vertical force of the side walls' friction on the grains", optional=True),
    },
)
