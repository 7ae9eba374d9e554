"""What a calibration hands back: the arrays of its artifact, the headline numbers, the note of the material file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from graben.mechanics.fitting.agreement import Agreement, rank
from graben.mechanics.fitting.curves import Curve, CurveFit
from graben.mechanics.fitting.identifiability import Identifiability
from graben.mechanics.materials.laws import LAWS
from graben.mechanics.optimise.multistart import Found
from graben.mechanics.optimise.space import Box
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.stages.calibrate.compare import Candidate
from graben.stages.calibrate.problem import Problem
from graben.stages.shared.measures import Measure


def distinct(members: np.ndarray, gap: float = 1e-3) -> np.ndarray:
    chosen: list[np.ndarray] = []
    for m in members:
        if all(np.abs(m - c).max() > gap for c in chosen):
            chosen.append(m)
    return np.array(chosen)


def arrays_of(
    problem: Problem, fit: CurveFit, measured: Sequence[Curve], unseen: Sequence[Curve], values: np.ndarray,
    known: Identifiability, errors: dict[str, Any], holdout: np.ndarray | None, members: np.ndarray, found: Found,
    candidates: Sequence[Candidate],
) -> dict[str, Any]:  # fmt: skip
    box = problem.box
    law = LAWS[problem.scene.law]
    every = [*measured, *unseen]
    whole = problem.fit(every) if unseen else fit
    steps = max(len(c.stress) for c in every)
    sets = np.array([values, *(fit.used(v) for v in box.to_values(members))])
    predicted = whole.predict(np.concatenate([values[None], sets[1:]]))
    all_errors = whole.errors(values) if unseen else errors
    shape = (len(every), steps, 4)
    data = {n: np.full(shape, np.nan) for n in ("stress_measured", "strain_measured", "stress", "strain")}
    band = np.full((len(members), len(every), steps), np.nan)
    for i, c in enumerate(every):
        r = len(c.stress)
        data["stress_measured"][i, :r], data["strain_measured"][i, :r] = c.stress, c.strain
        data["stress"][i, :r], data["strain"][i, :r] = predicted.stress[0, i, :r], predicted.strain[0, i, :r]
        band[:, i, :r] = predicted.stress[1:, i, :r, 1]
    scatter = _prediction_error(whole, box, box.to_unit(values), known, errors["stress"], shape)
    slope = box.slope(box.to_unit(values))
    unit = box.to_unit(values)
    bound = np.where(unit <= 1e-6, -1, np.where(unit >= 1.0 - 1e-6, 1, 0))
    out = {
        "parameter_name": np.array(box.names, dtype=str),
        "parameter_unit": np.array([law.parameter(n).unit for n in box.names], dtype=str),
        "value": values,
        "lower": box.lower,
        "upper": box.upper,
        "log_scale": box.log.astype(np.int8),
        "standard_error": known.robust_error * slope,
        "standard_error_independent": known.standard_error * slope,
        "at_bound": bound.astype(np.int8),
        "identifiable": known.identifiable.astype(np.int8),
        "doubtful": known.doubtful.astype(np.int8),
        "covariance": known.covariance,
        "correlation": known.correlation,
        "direction": known.directions,
        "direction_error": np.where(np.isfinite(known.direction_error), known.direction_error, np.nan),
        "direction_unseen": known.unseen.astype(np.int8),
        "curve_name": np.array([c.name for c in every], dtype=str),
        "role": np.array(["fit"] * len(measured) + ["validation"] * len(unseen), dtype=str),
        "step_count": np.array([len(c.stress) for c in every]),
        "reached": np.maximum(predicted.reached[0], 0.0),
        "confining_stress": np.array([c.stress[0, 0] for c in every]),
        "stress_rmse": all_errors["stress_per_curve"],
        "strain_rmse": all_errors["strain_per_curve"],
        **data,
        "member_value": sets[1:],
        "member_objective": fit.objective(sets[1:]),
        "member_stress_rmse": np.array([fit.errors(v)["stress"] for v in sets[1:]]),
        "member_axial_stress": band,
        "axial_stress_error": scatter,
        "history": found.history,
    }
    if holdout is not None:
        out["holdout_rmse"] = np.concatenate([holdout, np.full(len(unseen), np.nan)])
    if candidates:
        out |= {
            "candidate_name": np.array([c.name for c in candidates], dtype=str),
            "candidate_law": np.array([c.law for c in candidates], dtype=str),
            "candidate_parameters": np.array([c.parameters for c in candidates]),
            "candidate_rmse": np.array([c.fitted for c in candidates]),
            "candidate_holdout_rmse": np.array(
                [np.concatenate([c.holdout, np.full(len(unseen), np.nan)]) for c in candidates]
            ),
        }
    return out


def _prediction_error(
    fit: CurveFit, box: Box, unit: np.ndarray, known: Identifiability, rmse: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Standard deviation (curve, step) of a measured axial stress about the prediction: what the parameters leave
    open, to first order (correlation, robust errors), and the misfit of the fitted curves."""
    free = np.flatnonzero(known.free)
    step = 1e-4
    up, down = np.repeat(unit[None], free.size, axis=0), np.repeat(unit[None], free.size, axis=0)
    row = np.arange(free.size)
    up[row, free], down[row, free] = np.minimum(unit[free] + step, 1.0), np.maximum(unit[free] - step, 0.0)
    out = np.full(shape[:2], np.nan)
    variance = np.zeros(shape[:2])
    if free.size:
        high, low = (fit.predict(box.to_values(u)).stress[..., 1] for u in (up, down))
        change = (high - low) / (up[row, free] - down[row, free])[:, None, None]
        error = known.robust_error[free]
        covariance = known.correlation[np.ix_(free, free)] * np.outer(error, error)
        variance = np.einsum("ics,ij,jcs->cs", change, covariance, change)
    for i, c in enumerate(fit.curves):
        out[i, : len(c.stress)] = np.sqrt(np.maximum(variance[i, : len(c.stress)], 0.0) + rmse**2)
    return out


def headline_of(
    scene: CalibrateScene, problem: Problem, measured: Sequence[Curve], unseen: Sequence[Curve],
    values: np.ndarray, known: Identifiability, starts: Agreement, errors: dict[str, Any], holdout: np.ndarray | None,
    arrays: dict[str, Any], candidates: Sequence[Candidate],
) -> dict[str, Any]:  # fmt: skip
    names = problem.box.names
    out: dict[str, Any] = {
        "law": scene.law,
        "rmse_pa": errors["stress"],
        "strain_rmse": errors["strain"],
        "parameters": {n: float(v) for n, v in zip(names, values)},
        "standard_errors": {n: _finite(e) for n, e in zip(names, arrays["standard_error"])},
        "curve_rmse_pa": {c.name: float(e) for c, e in zip(measured, errors["stress_per_curve"])},
        "incomplete": [c.name for c, ok in zip(measured, errors["complete"]) if not ok],
        "at_bounds": [n for n, b in zip(names, arrays["at_bound"]) if b],
        "near_bounds": [n for n, near in zip(names, known.near_bound) if near],
        "not_identifiable": [n for n, lost in zip(names, unseen_parameters(known)) if lost],
        "doubtful": [n for n, between in zip(names, known.doubtful) if between],
        "unseen_directions": int(known.unseen.sum()),
        "steps_to_go": {n: _finite(p) for n, p in zip(names, known.pending)},
        "starts": starts.verdict,
        "starts_rms_ratio": _finite(starts.ratio),
        "starts_apart": {names[starts.parameter]: _finite(starts.apart)},
    }
    if holdout is not None:
        out["holdout_rmse_pa"] = {c.name: _finite(e) for c, e in zip(measured, holdout)}
        out["cross_validation_rmse_pa"] = _finite(float(np.sqrt(np.mean(holdout**2))))
    if candidates:
        order, close = rank(
            np.array([c.cross_validated for c in candidates]), np.array([c.parameters for c in candidates])
        )
        table = [candidates[i] for i in order]
        out["as_good_as_the_best"] = [candidates[i].name for i in close[1:]]
        out["comparison"] = [
            {
                "name": c.name,
                "law": c.law,
                "parameters": c.parameters,
                "rmse_pa": c.fitted,
                "cross_validation_rmse_pa": _finite(c.cross_validated),
                "worst_holdout_rmse_pa": _finite(float(c.holdout.max())),
            }
            for c in table
        ]
    if unseen:
        each = arrays["stress_rmse"][len(measured) :]
        points = np.array([len(c.stress) for c in unseen])
        out["validation_rmse_pa"] = float(np.sqrt(np.sum(each**2 * points) / points.sum()))
        gap = np.abs(arrays["stress"] - arrays["stress_measured"])[len(measured) :, :, 1]
        inside = gap <= 1.96 * arrays["axial_stress_error"][len(measured) :]
        out["validation_inside_95_band"] = float(inside[np.isfinite(gap)].mean())
        out["validation_curve_rmse_pa"] = {c.name: float(e) for c, e in zip(unseen, each)}
    return out


def measures_of(headline: dict[str, Any]) -> list[Measure]:
    """What a user should know before the parameters go on to the next stage."""

    def some(name: str, sentence: str) -> Measure:
        return Measure(name, float(len(headline[name])), 0.0, f"{', '.join(headline[name])}: {sentence}")

    return [
        some("incomplete", "the law cannot follow these curves to their ends"),
        some("at_bounds", "the bound chose the value, not the curves: widen it in [free], or fix the parameter"),
        some("not_identifiable", "the curves do not tell these parameters apart: fix some, or add curves"),
        some(
            "doubtful", "the curves about halve what the bounds leave open, which is little: fix some, or add curves"
        ),
        Measure("starts", float(headline["starts"] != "agree"), 0.0, _of_starts(headline)),
    ]


def _of_starts(headline: dict[str, Any]) -> str:
    if headline["starts"] == "single":
        return "one start only, so nothing tells whether another would find a better fit: raise swarm.starts"
    ((name, apart),) = headline["starts_apart"].items()
    ratio = headline["starts_rms_ratio"]
    parts = (
        "differ beyond measure" if ratio is None else f"differ by {100.0 * (ratio - 1.0):.2g} % (root mean square)"
    )
    told = "disagree" if headline["starts"] == "disagree" else "agree only roughly"
    return (
        f"the two best starts {told}: their objectives {parts}, {name} by {apart:.2g} standard errors: raise "
        "swarm.starts, or fix parameters"
    )


def unseen_parameters(known: Identifiability) -> np.ndarray:
    """(k,) true where a free parameter is neither identifiable nor doubtful."""
    return known.free & ~known.identifiable & ~known.doubtful


def _finite(value: float) -> float | None:
    """JSON has no nan: None where there is no number."""
    return float(value) if math.isfinite(value) else None


def note_of(scene: CalibrateScene, curves: Sequence[Curve], errors: dict[str, Any]) -> str:
    names = ", ".join(c.name for c in curves)
    title = scene.title or "calibrate"
    return f"{title}\nfitted to {names}; axial-stress RMSE {errors['stress'] / 1e6:.4g} MPa"
