"""calibrate: from stress-strain curves to the parameters of a law, and what the curves cannot tell."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.materials.laws import LAWS
from graben.mechanics.search.curves import Curve, CurveFit, Weights
from graben.mechanics.search.identifiability import Identifiability, identify
from graben.mechanics.search.levenberg_marquardt import jacobian
from graben.mechanics.search.multistart import Found, Plan, search
from graben.mechanics.search.space import Box
from graben.schemas.artifact import write_artifact
from graben.schemas.faults import BadInput, Fault
from graben.schemas.files import refuse_existing
from graben.schemas.layouts.calibration import LAYOUT
from graben.schemas.scene import load_scene
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.schemas.scenes.material import material_text, write_material
from graben.stages.measured import Reading, read_measured
from graben.stages.record import Progress, Record, silent

# starts, particles, generations, refined particles of each swarm, increments between two points
_FIDELITY = {"draft": (1, 24, 60, 3, 1), "standard": (4, 24, 100, 4, 2), "reference": (12, 48, 200, 6, 4)}
_NEAR = 1.1  # members of the ensemble: objective up to this multiple of the best


@dataclass(frozen=True)
class _Problem:
    scene: CalibrateScene
    box: Box
    fixed: dict[str, Any]
    plan: Plan
    increments: int
    guesses: np.ndarray | None

    def fit(self, curves: Sequence[Curve]) -> CurveFit:
        w = self.scene.weights
        return CurveFit(
            self.scene.law,
            self.fixed,
            self.box.names,
            curves,
            Weights(w.normalise, w.last, w.strain, w.penalty),
            length=self.scene.length,
            parts=self.increments,
            workers=self.scene.workers,
        )

    def solve(self, curves: Sequence[Curve], plan: Plan, progress: Any = None) -> tuple[CurveFit, Found]:
        fit = self.fit(curves)

        def residuals(unit: np.ndarray) -> np.ndarray:
            return fit.residuals(self.box.to_values(unit))

        found = search(residuals, self.box.size, plan, seed=self.scene.seed, guesses=self.guesses, progress=progress)
        return fit, found


def run(
    scene_path: Path,
    output: Path,
    *,
    curves: Sequence[Path] = (),
    validate: Sequence[Path] = (),
    overrides: Iterable[str] = (),
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Fit the scene's law to its curves (or to the files `curves` instead); predict the curves of `validate`.

    Writes `output` (kind "calibration") and `<output stem>.material.toml` beside it; returns the headline
    numbers: rmse_pa, parameters (SI), per curve errors, what is not identifiable, validation_rmse_pa where
    asked.

    Raises
    ------
    BadInput : the scene or a curve has faults, or an output exists
    """
    scene: CalibrateScene = load_scene(scene_path, "calibrate", overrides)
    material_path = output.with_suffix("").with_suffix(".material.toml")
    refuse_existing(output, overwrite)
    refuse_existing(material_path, overwrite)
    sources = [Path(p) for p in (curves or scene.curves)]
    if not sources:
        raise BadInput(
            Fault(str(scene_path), "curves", "[]", "at least one file of curves, here or on the command line")
        )
    record = Record.begin(scene, [p for p in [*sources, *validate] if p.is_file()])
    reading = Reading(scene.test, scene.csv.sign, scene.csv.allow_tension)
    measured = read_measured([*sources, *validate], reading)
    extra = read_measured(validate, reading) if validate else []
    measured, unseen_curves = measured[: len(measured) - len(extra)], extra
    problem = _problem(scene, scene_path)
    share = 0.5 if scene.cross_validation else 0.95
    fit, found = problem.solve(measured, problem.plan, lambda part, words: progress(share * part, words))
    best = found.best
    values = problem.box.to_values(best.x)
    groups = fit.groups
    known = identify(
        best.x, best.residuals, jacobian(lambda u: fit.residuals(problem.box.to_values(u)), best.x, 1e-4),
        groups=groups, lag=scene.correlation_length,
    )  # fmt: skip
    errors = fit.errors(values)
    holdout = _cross_validate(problem, measured, best.x, progress) if scene.cross_validation else None
    near = found.member_values <= _NEAR * found.best.value
    members = _distinct(found.members[near])
    material = {**problem.fixed, **dict(zip(problem.box.names, (float(v) for v in values)))}
    ordered = {p.name: material[p.name] for p in LAWS[scene.law].parameters if p.name in material}
    note = _note(scene, measured, errors)
    arrays = _arrays(problem, fit, measured, unseen_curves, values, known, errors, holdout, members, found)
    record.cost.update(
        evaluations=found.evaluations, curves=len(measured), increments_per_point=problem.increments,
        objective=best.value,
    )  # fmt: skip
    attributes = {
        "law": scene.law,
        "material": material_text(scene.law, ordered, note),
        "rmse_pa": errors["stress"],
        "objective": best.value,
        "search_ended": best.reason,
    }
    headline = _headline(scene, problem, measured, unseen_curves, values, known, errors, holdout, arrays)
    write_artifact(output, LAYOUT, arrays, record, attributes)
    write_material(material_path, scene.law, ordered, note)
    progress(1.0, "done")
    return {**headline, "output": str(output), "material": str(material_path)}


def _problem(scene: CalibrateScene, scene_path: Path) -> _Problem:
    names, lower, upper, log, initial = scene.bounds_si()
    law = LAWS[scene.law]
    fixed = scene.fixed_si()
    faults = []
    for name, low, high in zip(names, lower, upper):
        p = law.parameter(name)
        for key, bound in (("lower", low), ("upper", high)):
            if not p.lower <= bound <= p.upper:
                faults.append(
                    Fault(
                        str(scene_path),
                        f"free.{name}.{key}",
                        f"{bound:g}",
                        f"from {p.lower:g} to {p.upper:g} {p.unit}",
                    )
                )
    stand_in = {**fixed, **dict(zip(names, upper))}
    for name, text in law.faults(stand_in):
        if name:
            key = f"free.{name}" if name in names else f"fixed.{name}"
            faults.append(Fault(str(scene_path), key, "" if name in stand_in else "(absent)", text))
    if faults:
        raise BadInput(faults)
    box = Box.of(names, lower, upper, log)
    guess = None
    if any(v is not None for v in initial):
        middle = box.to_values(np.full(box.size, 0.5))
        point = np.array([m if v is None else v for v, m in zip(initial, middle)])
        guess = box.to_unit(point)[None]
    starts, particles, generations, refined, increments = _FIDELITY[scene.fidelity]
    s, r = scene.swarm, scene.refine
    plan = Plan(
        starts=s.starts or starts,
        particles=s.particles or particles,
        generations=generations if s.generations is None else s.generations,
        inertia=s.inertia,
        inertia_reduction=s.inertia_reduction,
        cognitive=s.cognitive,
        social=s.social,
        constriction=s.constriction,
        refine_best=r.best or refined,
        damping=r.damping,
        factor=r.factor,
        move_limit=r.move_limit,
        iterations=r.iterations,
    )
    return _Problem(scene, box, fixed, plan, scene.increments or increments, guess)


def _cross_validate(problem: _Problem, curves: Sequence[Curve], x: np.ndarray, progress: Progress) -> np.ndarray:
    """Axial-stress error of each curve predicted from a fit to the others; nan where there is no other."""
    out = np.full(len(curves), np.nan)
    if len(curves) < 2:
        return out
    plan = replace(problem.plan, starts=max(1, problem.plan.starts // 2))
    for i, held in enumerate(curves):
        progress(0.5 + 0.45 * i / len(curves), f"cross-validation without {held.name}")
        _fit, found = problem.solve([c for j, c in enumerate(curves) if j != i], plan)
        out[i] = problem.fit([held]).errors(problem.box.to_values(found.best.x))["stress"]
    return out


def _distinct(members: np.ndarray, gap: float = 1e-3) -> np.ndarray:
    chosen: list[np.ndarray] = []
    for m in members:
        if all(np.abs(m - c).max() > gap for c in chosen):
            chosen.append(m)
    return np.array(chosen)


def _arrays(
    problem: _Problem, fit: CurveFit, measured: Sequence[Curve], unseen: Sequence[Curve], values: np.ndarray,
    known: Identifiability, errors: dict[str, Any], holdout: np.ndarray | None, members: np.ndarray, found: Found,
) -> dict[str, Any]:  # fmt: skip
    box = problem.box
    law = LAWS[problem.scene.law]
    every = [*measured, *unseen]
    whole = problem.fit(every) if unseen else fit
    steps = max(len(c.stress) for c in every)
    sets = box.to_values(np.concatenate([box.to_unit(values)[None], members]))
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
        "history": found.history,
    }
    if holdout is not None:
        out["holdout_rmse"] = np.concatenate([holdout, np.full(len(unseen), np.nan)])
    return out


def _headline(
    scene: CalibrateScene, problem: _Problem, measured: Sequence[Curve], unseen: Sequence[Curve],
    values: np.ndarray, known: Identifiability, errors: dict[str, Any], holdout: np.ndarray | None,
    arrays: dict[str, Any],
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
        "not_identifiable": [n for n, ok, free in zip(names, known.identifiable, known.free) if free and not ok],
        "unseen_directions": int(known.unseen.sum()),
    }
    if holdout is not None:
        out["holdout_rmse_pa"] = {c.name: _finite(e) for c, e in zip(measured, holdout)}
        out["cross_validation_rmse_pa"] = _finite(float(np.sqrt(np.mean(holdout**2))))
    if unseen:
        each = arrays["stress_rmse"][len(measured) :]
        points = np.array([len(c.stress) for c in unseen])
        out["validation_rmse_pa"] = float(np.sqrt(np.sum(each**2 * points) / points.sum()))
        out["validation_curve_rmse_pa"] = {c.name: float(e) for c, e in zip(unseen, each)}
    return out


def _finite(value: float) -> float | None:
    """JSON has no nan: None where there is no number."""
    return float(value) if math.isfinite(value) else None


def _note(scene: CalibrateScene, curves: Sequence[Curve], errors: dict[str, Any]) -> str:
    names = ", ".join(c.name for c in curves)
    title = scene.title or "calibrate"
    return f"{title}\nfitted to {names}; axial-stress RMSE {errors['stress'] / 1e6:.4g} MPa"
