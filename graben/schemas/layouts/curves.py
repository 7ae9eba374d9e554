"""Curves: average stress against average strain over time, one path per REV or per test."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_PATH = ("path",)
_STEP = ("path", "step")
_TENSOR = ("path", "step", "component")


def _step(units: str, long_name: str) -> Variable:
    """A measure per saved state that may be absent altogether, or beyond the end of a short path."""
    return Variable(_STEP, units, long_name, optional=True, may_be_nan=True)


LAYOUT = Layout(
    kind="curves",
    version=1,
    title="Average stress and strain over time",
    filled=("path", "step"),
    dims={
        "path": "one REV of one simulation, or one laboratory or reference test",
        "step": "saved states of a path; shorter paths are padded with nan after step_count",
        "component": "xx, yy, zz, xy of a symmetric tensor (tensor shear strain)",
        "axis": "x, y, z",
    },
    variables={
        "path_name": Variable(_PATH, "1", "name of the path", dtype="U"),
        "step_count": Variable(_PATH, "1", "number of valid steps of the path", dtype="i8"),
        "time": Variable(_STEP, "s", "time", may_be_nan=True),
        "stress": Variable(_TENSOR, "Pa", "average Cauchy stress, tension positive", may_be_nan=True),
        "strain": Variable(_TENSOR, "1", "average strain since the first state, extension positive", may_be_nan=True),
        "confining_stress": Variable(_PATH, "Pa", "lateral stress of the test, tension positive", may_be_nan=True),
        "lateral_over_applied_stress": _step("1", "average lateral stress over the one applied to the sides"),
        "area": Variable(
            _PATH,
            "m2",
            "area inside the outline at the first state (spheres: volume in m3, see `measure`)",
            optional=True,
        ),
        "centre": Variable(("path", "axis"), "m", "centre of the REV (z is 0 in the plane)", optional=True),
        "radius": Variable(
            _PATH, "m", "radius of the REV (polygons: of the circle of equal area)", optional=True, may_be_nan=True
        ),
        "block_count": Variable(_PATH, "1", "blocks inside the outline (or spheres)", dtype="i8", optional=True),
        "solid_fraction": _step("1", "area of blocks over area inside the outline"),
        "porosity": _step("1", "1 - solid fraction; negative where blocks overlap"),
        "rotation": _step("rad", "average rotation, counter-clockwise positive"),
        "current_area": _step("m2", "area inside the outline as it moves with the blocks"),
        "stress_boundary": Variable(
            _TENSOR,
            "Pa",
            "average stress from the forces on the outline (xx, yy, xy; zz is that of the zones)",
            optional=True,
            may_be_nan=True,
        ),
        "force_imbalance": _step("1", "resultant of the forces on the outline over the sum of their sizes"),
        "moment_imbalance": _step("1", "antisymmetric part of the boundary-force stress over its size"),
        "balance_residual": _step(
            "1", "stress by zones less stress by forces with inertia, weight and overlap, over the former"
        ),
        "hill_mandel_residual": _step("1", "(power of boundary forces - stress : strain rate) over its largest size"),
        "hill_mandel_work": _step("1", "accumulated Hill-Mandel residual over accumulated stress work"),
        "strain_blocks": Variable(
            _TENSOR, "1", "part of the strain that lies in the blocks", optional=True, may_be_nan=True
        ),
        "strain_joints": Variable(
            _TENSOR, "1", "part of the strain that lies in joint opening and slip", optional=True, may_be_nan=True
        ),
        "joint_length": _step("m", "length of joints in contact inside the outline"),
        "joint_open_fraction": _step("1", "part of the joint length inside the outline that is open"),
        "joint_slip_mean": _step("m", "mean size of joint slip, by length"),
        "joint_slip_rms": _step("m", "root mean square of joint slip, by length"),
        "joint_slip_max": _step("m", "largest joint slip"),
        "joint_slipping_fraction": _step("1", "part of the joint length that is slipping or broken"),
        "fabric": Variable(
            _TENSOR,
            "1",
            "length-weighted fabric tensor n n of the contacts (trace 1)",
            optional=True,
            may_be_nan=True,
        ),
        "coordination": _step("1", "neighbours that a block touches, inside the outline"),
    },
)
