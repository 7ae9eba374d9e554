"""REV study: scalars of average curves by radius, centre and run, and whether they have settled."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_SAMPLE = ("radius", "centre", "run")
_RADIUS = ("radius",)

PROPERTIES = {
    "secant_modulus": ("Pa", "secant modulus of vertical stress over vertical strain"),
    "poisson_ratio": ("1", "lateral extension over vertical shortening at the secant point"),
    "peak_stress": ("Pa", "largest vertical compression (positive: compression)"),
    "strain_at_peak": ("1", "vertical shortening at the peak"),
    "dilation": ("rad", "dilation angle between secant point and peak"),
}


def _statistics(name: str, units: str, long_name: str) -> dict[str, Variable]:
    def by_radius(units: str, what: str, dtype: str = "f8", may_be_nan: bool = False) -> Variable:
        return Variable(_RADIUS, units, f"{long_name}: {what}", dtype=dtype, optional=True, may_be_nan=may_be_nan)

    return {
        name: Variable(_SAMPLE, units, long_name, optional=True, may_be_nan=True),
        f"{name}_count": by_radius("1", "samples that have a value", "i8"),
        f"{name}_mean": by_radius(units, "mean"),
        f"{name}_deviation": by_radius(units, "standard deviation of the samples"),
        f"{name}_low": by_radius(units, "lower end of the bootstrap interval of the mean"),
        f"{name}_high": by_radius(units, "upper end of the bootstrap interval of the mean"),
        f"{name}_mean_p": by_radius(
            "1", "p of t: the mean is off that at the largest radius by the tolerance or more", may_be_nan=True
        ),
        f"{name}_variance_p": by_radius(
            "1", "p of chi-squared: the scatter is the accepted one or more", may_be_nan=True
        ),
        f"{name}_settled": by_radius("1", "1 where this and all larger radii pass both tests", "i1"),
    }


LAYOUT = Layout(
    kind="rev-study",
    version=1,
    title="Average properties by size and place of the representative area",
    dims={
        "radius": "radii, rising",
        "centre": "places",
        "run": "simulations",
        "step": "saved states; shorter runs are padded with nan",
        "component": "xx, yy, zz, xy",
        "axis": "x, y",
    },
    variables={
        "radius": Variable(_RADIUS, "m", "radius of the REV"),
        "centre_position": Variable(("run", "centre", "axis"), "m", "centre of the REV"),
        "run_name": Variable(("run",), "1", "name of the simulation", dtype="U"),
        "confining_stress": Variable((), "Pa", "lateral stress of the runs, tension positive"),
        "area": Variable(_SAMPLE, "m2", "area inside the outline at the first state"),
        "block_count": Variable(_SAMPLE, "1", "blocks inside the outline", dtype="i8"),
        "independent_samples": Variable(_RADIUS, "1", "REVs without overlap that the samples are worth"),
        "recommended_radius": Variable(
            (), "m", "smallest radius at which all chosen properties have settled (0: none)"
        ),
        "stress": Variable((*_SAMPLE, "step", "component"), "Pa", "average Cauchy stress", may_be_nan=True),
        "strain": Variable((*_SAMPLE, "step", "component"), "1", "average strain", may_be_nan=True),
        **{k: v for name, (units, text) in PROPERTIES.items() for k, v in _statistics(name, units, text).items()},
    },
    attributes={"properties": "secant_modulus, poisson_ratio, peak_stress, strain_at_peak, dilation"},
)
