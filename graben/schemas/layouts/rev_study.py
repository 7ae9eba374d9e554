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
        f"{name}_count": by_radius("1", "samples that have a value; of those of the same blocks one", "i8"),
        f"{name}_mean": by_radius(units, "mean"),
        f"{name}_deviation": by_radius(units, "standard deviation of the samples", may_be_nan=True),
        f"{name}_low": by_radius(units, "lower end of the bootstrap interval of the mean", may_be_nan=True),
        f"{name}_high": by_radius(units, "upper end of the bootstrap interval of the mean", may_be_nan=True),
        f"{name}_mean_p": by_radius(
            "1", "p of t: the mean is off that at the largest radius by the tolerance or more", may_be_nan=True
        ),
        f"{name}_variance_p": by_radius(
            "1", "p of chi-squared: the scatter is the accepted one or more", may_be_nan=True
        ),
        f"{name}_settled": by_radius("1", "1 where this and all larger radii pass both tests", "i1"),
    }


_FIT = ("radius", "centre", "realization")
_PARAMETER = ("parameter",)


def _by_parameter(what: str, dtype: str = "f8", may_be_nan: bool = False) -> Variable:
    long_name = f"parameters, in parameter_unit: {what}"
    return Variable(("parameter", "radius"), "1", long_name, dtype=dtype, optional=True, may_be_nan=may_be_nan)


_CALIBRATION = {
    "run_confining_stress": Variable(("run",), "Pa", "lateral stress of the run, tension positive", optional=True),
    "run_realization": Variable(("run",), "1", "index of the realization", dtype="i8", optional=True),
    "parameter_name": Variable(_PARAMETER, "1", "calibrated parameter", dtype="U", optional=True),
    "parameter_unit": Variable(_PARAMETER, "1", "its unit, SI", dtype="U", optional=True),
    "parameter_lower": Variable(_PARAMETER, "1", "lower bound, in parameter_unit", optional=True),
    "parameter_upper": Variable(_PARAMETER, "1", "upper bound, in parameter_unit", optional=True),
    "parameter_identifiable": Variable(
        _PARAMETER, "1", "1 where the curves of the first fit can tell it", dtype="i1", optional=True
    ),
    "parameter_value": Variable(
        ("parameter", *_FIT), "1", "value fitted to the curves of the sample, in parameter_unit", optional=True
    ),
    "parameter_at_bound": _by_parameter("samples whose value lies on a bound", "i8"),
    "parameter_count": _by_parameter("samples that have a value; of those of the same blocks one", "i8"),
    "parameter_mean": _by_parameter("mean"),
    "parameter_deviation": _by_parameter("standard deviation of the samples", may_be_nan=True),
    "parameter_low": _by_parameter("lower end of the bootstrap interval of the mean", may_be_nan=True),
    "parameter_high": _by_parameter("upper end of the bootstrap interval of the mean", may_be_nan=True),
    "parameter_mean_p": _by_parameter(
        "p of t: the mean is off that at the largest radius by the tolerance or more", may_be_nan=True
    ),
    "parameter_variance_p": _by_parameter(
        "p of chi-squared: the scatter is the accepted one or more", may_be_nan=True
    ),
    "parameter_settled": _by_parameter("1 where this and all larger radii pass both tests", "i1"),
    "fit_rmse": Variable(_FIT, "Pa", "error of the fitted axial stress, root mean square", optional=True),
}

LAYOUT = Layout(
    kind="rev-study",
    version=1,
    title="Average properties by size and place of the representative area",
    filled=("radius", "centre"),
    dims={
        "radius": "radii, rising",
        "centre": "places",
        "run": "simulations",
        "step": "saved states; shorter runs are padded with nan",
        "component": "xx, yy, zz, xy",
        "axis": "x, y",
        "parameter": "calibrated parameters",
        "realization": "seeds; each is one run per lateral stress",
    },
    variables={
        "radius": Variable(_RADIUS, "m", "radius of the REV"),
        "centre_position": Variable(("run", "centre", "axis"), "m", "centre of the REV"),
        "run_name": Variable(("run",), "1", "name of the simulation", dtype="U"),
        "confining_stress": Variable(
            (), "Pa", "lateral stress of the runs, tension positive (of several: the smallest)"
        ),
        "area": Variable(_SAMPLE, "m2", "area inside the outline at the first state"),
        "block_count": Variable(_SAMPLE, "1", "blocks inside the outline", dtype="i8"),
        "independent_samples": Variable(_RADIUS, "1", "REVs without overlap that the samples are worth"),
        "recommended_radius": Variable(
            (), "m", "smallest radius at which all chosen properties have settled (0: none)"
        ),
        "stress": Variable((*_SAMPLE, "step", "component"), "Pa", "average Cauchy stress", may_be_nan=True),
        "strain": Variable((*_SAMPLE, "step", "component"), "1", "average strain", may_be_nan=True),
        **{k: v for name, (units, text) in PROPERTIES.items() for k, v in _statistics(name, units, text).items()},
        **_CALIBRATION,
    },
    attributes={"properties": "secant_modulus, poisson_ratio, peak_stress, strain_at_peak, dilation"},
)
