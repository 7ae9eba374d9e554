"""Calibration: the parameters found, how well they are known, and the fit against the curves."""

from __future__ import annotations

from graben.schemas.artifact import Layout, Variable

_P, _C = ("parameter",), ("curve",)
_K = ("candidate",)
_FIELD = ("curve", "step", "component")
_BAND = ("member", "curve", "step")


def _field(units: str, long_name: str) -> Variable:
    return Variable(_FIELD, units, long_name, may_be_nan=True)


LAYOUT = Layout(
    kind="calibration",
    version=1,
    title="Parameters of a constitutive law from stress-strain curves",
    filled=("parameter", "curve"),
    dims={
        "parameter": "free parameters, in the order of the scene",
        "other": "the same, as columns of matrices",
        "direction": "combinations of parameters, worst known first",
        "curve": "curves of the fit; `role` tells those that were only predicted",
        "step": "points of a curve; shorter curves are padded with nan after step_count",
        "component": "xx, yy, zz, xy of a symmetric tensor (tensor shear strain), tension positive",
        "member": "refined parameter sets whose objective is near the best, best first",
        "generation": "generations of the global search that led to the best set",
        "candidate": "scenes held against one another",
    },
    variables={
        "parameter_name": Variable(_P, "1", "name of the parameter", dtype="U"),
        "parameter_unit": Variable(_P, "1", "SI unit of value, lower, upper and the standard errors", dtype="U"),
        "value": Variable(_P, "1", "value found, in parameter_unit"),
        "lower": Variable(_P, "1", "lower bound, in parameter_unit"),
        "upper": Variable(_P, "1", "upper bound, in parameter_unit"),
        "log_scale": Variable(_P, "1", "1 where the search moved on a log scale", dtype="i1"),
        "standard_error": Variable(
            _P,
            "1",
            "standard error with residuals correlated along each curve, in parameter_unit; nan where held by a bound "
            "or unknown",
            may_be_all_nan=True,
        ),
        "standard_error_independent": Variable(
            _P, "1", "standard error if all residuals were independent (too small)", may_be_all_nan=True
        ),
        "at_bound": Variable(_P, "1", "-1 at the lower bound, 1 at the upper, else 0", dtype="i1"),
        "identifiable": Variable(_P, "1", "1 where the curves narrow it down beyond its bounds", dtype="i1"),
        "doubtful": Variable(
            _P, "1", "1 where they narrow it down about by half: neither known nor unknown", dtype="i1", optional=True
        ),
        "covariance": Variable(
            ("parameter", "other"),
            "1",
            "covariance, in fractions of each range (log where searched so)",
            may_be_all_nan=True,
        ),
        "correlation": Variable(("parameter", "other"), "1", "correlation", may_be_all_nan=True),
        "direction": Variable(("direction", "parameter"), "1", "unit vectors in fractions of each range"),
        "direction_error": Variable(
            ("direction",),
            "1",
            "standard deviation along a direction; nan where the curves do not see it",
            may_be_all_nan=True,
        ),
        "direction_unseen": Variable(
            ("direction",), "1", "1 where it exceeds what the bounds alone give", dtype="i1"
        ),
        "curve_name": Variable(_C, "1", "name of the curve", dtype="U"),
        "role": Variable(_C, "1", "fit or validation", dtype="U"),
        "step_count": Variable(_C, "1", "number of points", dtype="i8"),
        "reached": Variable(_C, "1", "points that the law's path reaches; a fraction of the last one counts"),
        "confining_stress": Variable(_C, "Pa", "lateral stress at the first point, tension positive"),
        "stress_rmse": Variable(_C, "Pa", "root mean square error of the axial stress"),
        "strain_rmse": Variable(_C, "1", "root mean square error of the lateral strain"),
        "holdout_rmse": Variable(
            _C,
            "Pa",
            "axial-stress error of this curve predicted from a fit to the others",
            optional=True,
            may_be_nan=True,
        ),
        "candidate_name": Variable(_K, "1", "name of the scene's file; this scene first", dtype="U", optional=True),
        "candidate_law": Variable(_K, "1", "its law", dtype="U", optional=True),
        "candidate_parameters": Variable(_K, "1", "number of its free parameters", dtype="i8", optional=True),
        "candidate_rmse": Variable(_K, "Pa", "axial-stress error, fitted to all curves", optional=True),
        "candidate_holdout_rmse": Variable(
            ("candidate", "curve"),
            "Pa",
            "axial-stress error of each curve predicted from a fit to the others",
            optional=True,
            may_be_nan=True,
        ),
        "stress_measured": _field("Pa", "stress of the curve"),
        "strain_measured": _field("1", "strain of the curve since its first state"),
        "stress": _field("Pa", "stress of the law at the values found"),
        "strain": _field("1", "strain of the law since that state, at the values found"),
        "member_value": Variable(("member", "parameter"), "1", "parameter sets, in parameter_unit"),
        "member_objective": Variable(("member",), "1", "objective of each set"),
        "member_stress_rmse": Variable(("member",), "Pa", "axial-stress error of each set over the fitted curves"),
        "member_axial_stress": Variable(_BAND, "Pa", "axial stress of each set: a band", may_be_nan=True),
        "axial_stress_error": Variable(
            ("curve", "step"),
            "Pa",
            "standard deviation of the measured axial stress about the law's: parameters and misfit",
            optional=True,
            may_be_nan=True,
        ),
        "history": Variable(("generation",), "1", "best objective of the global search"),
    },
    own_attributes={"law": str, "material": str, "rmse_pa": float},
)
