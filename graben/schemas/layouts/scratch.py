"""Scratch: forces along the path, sections of the groove under load and after lifting, energies."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_TIME = ("time",)
_CUT = ("state", "section")


def _energy(long_name: str) -> Variable:
    return Variable(_TIME, "J", long_name)


def _measure(units: str, long_name: str) -> Variable:
    """A measure of a section; nan where there is no groove."""
    return Variable(_CUT, units, long_name, may_be_nan=True)


def _volume(long_name: str) -> Variable:
    return Variable(("state",), "m3", long_name)


LAYOUT = Layout(
    kind="scratch",
    version=1,
    title="Scratch by a rigid grain",
    filled=("time",),
    dims={
        "time": "refresh intervals of the run",
        "phase": "indent, slide (where there is a path), lift, rest",
        "axis": "x along the scratch, y across, z up; z = 0 is the first surface",
        "state": "0 under load at the end of the path, 1 after lifting",
        "section": "cuts across the track at section_position",
        "point": "points of a section, from the middle outwards",
    },
    variables={
        "groove_area": Variable((), "m2", "groove area after lifting, mean over the middle fifth of the path"),
        "shoulder_area": Variable((), "m2", "shoulder area after lifting, the same sections"),
        "degree_of_wear": Variable((), "1", "(groove_area - shoulder_area) / groove_area at s_over_a; H (8.5)"),
        "degree_of_wear_loaded": Variable((), "1", "the same under load"),
        "degree_of_penetration": Variable((), "1", "2 depth / width of the groove after lifting; H (8.6)"),
        "s_over_a": Variable(
            (), "1", "path to the middle of the groove over contact half-width: where degree_of_wear is"
        ),
        "normal_force": Variable((), "N", "normal force, mean over the second half of the path"),
        "tangential_force": Variable((), "N", "tangential force, the same mean"),
        "grain_radius": Variable((), "m", "radius of the sphere"),
        "depth": Variable((), "m", "depth of indentation below the first surface"),
        "path": Variable((), "m", "sliding distance"),
        "start": Variable((), "m", "position of the indentation"),
        "contact_half_width": Variable((), "m", "a = sqrt(2 R d)"),
        "friction": Variable((), "1", "Coulomb friction"),
        "time": Variable(_TIME, "s", "time"),
        "phase_name": Variable(("phase",), "1", "names of the phases", dtype="U"),
        "phase_index": Variable(_TIME, "1", "phase", dtype="i4", index_of="phase"),
        "tip_position": Variable(("time", "axis"), "m", "centre of the sphere"),
        "force": Variable(("time", "axis"), "N", "force on the specimen, mean over the interval"),
        "contact_nodes": Variable(_TIME, "1", "surface nodes in contact, half model", dtype="i4"),
        "energy_external": _energy("work of the tip"),
        "energy_internal": _energy("work of stress: elastic energy and dissipation in the material"),
        "energy_kinetic": _energy("kinetic energy"),
        "energy_friction": _energy("work lost in sliding friction"),
        "energy_contact": _energy("energy stored in penalty springs"),
        "energy_hourglass": _energy("work against hourglass control"),
        "energy_viscous": _energy("work lost in bulk viscosity"),
        "energy_damping": _energy("work lost in damping after lifting"),
        "energy_added_mass": _energy("kinetic energy that added mass brought in"),
        "energy_error": Variable(_TIME, "1", "unaccounted share of the external work"),
        "state_name": Variable(("state",), "1", "loaded, unloaded", dtype="U"),
        "section_position": Variable(("section",), "m", "position along the specimen"),
        "section_s_over_a": Variable(("section",), "1", "(position - start) / contact_half_width"),
        "profile_y": Variable(("point",), "m", "distance from the middle"),
        "profile_z": Variable(
            ("state", "section", "point"), "m", "height of the remaining material", may_be_nan=True
        ),
        "section_groove_area": _measure("m2", "area below the first surface"),
        "section_shoulder_area": _measure("m2", "area above the first surface"),
        "section_width": _measure("m", "width of the groove at the first surface"),
        "section_depth": _measure("m", "depth of the groove"),
        "section_shoulder_height": _measure("m", "height of the shoulders"),
        "section_degree_of_wear": _measure("1", "(Ag - As) / Ag, H (8.5)"),
        "section_degree_of_penetration": _measure("1", "2 d / w, H (8.6)"),
        "volume_groove": _volume("volume below the first surface"),
        "volume_shoulders": _volume("volume above it behind the middle of the tip: beside the track"),
        "volume_bow": _volume("volume above it ahead of the middle of the tip"),
        "volume_compressed": _volume("volume that the remaining elements lost"),
        "volume_removed": _volume("volume of removed elements"),
        "volume_closure": Variable(("state",), "1", "unaccounted share of the groove volume"),
        "largest_plastic_strain": Variable((), "1", "largest equivalent plastic strain"),
    },
)
