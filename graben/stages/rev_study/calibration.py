"""Calibrated parameters of every sample of a REV study, as if each place and radius were all that is known.

Y 4.4: a parameter is representative from the radius on at which its fits stay the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from graben.declared.knobs import values_at
from graben.errors import BadInput, Fault, Refused
from graben.mechanics.fitting.curves import Curve, CurveFit, Weights
from graben.mechanics.fitting.identifiability import identify
from graben.mechanics.materials.laws import LAWS
from graben.mechanics.optimise.levenberg_marquardt import jacobian
from graben.mechanics.optimise.multistart import Found, Plan, search
from graben.mechanics.optimise.space import Box
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.schemas.scenes.rev_study import RevStudyScene
from graben.stages.rev_study.done import Done
from graben.stages.shared.material import find_law
from graben.stages.shared.record import Progress
from graben.stages.shared.workers import compute


@dataclass(frozen=True)
class FitTask:
    """One fit, as a worker needs it: the law, what is fixed, the box, the curves, and where to begin."""

    law: str
    fixed: dict[str, Any]
    box: Box
    weights: Weights
    length: float
    increments: int
    lag: int
    seed: int
    plan: Plan
    guesses: np.ndarray | None
    curves: tuple[Curve, ...]

    def fit(self) -> CurveFit:
        """The law against the curves."""
        return CurveFit(
            self.law, self.fixed, self.box.names, self.curves, self.weights, length=self.length, parts=self.increments
        )

    def solve(self) -> tuple[CurveFit, Found]:
        """The best parameters in the unit box."""
        fit = self.fit()
        found = search(
            lambda unit: fit.residuals(self.box.to_values(unit)),
            self.box.size,
            self.plan,
            seed=self.seed,
            guesses=self.guesses,
        )
        return fit, found


@dataclass(frozen=True)
class Fits:
    """names, units (parameter,); value (parameter, radius, centre, realization) SI; stress_rmse
    (radius, centre, realization) Pa; identifiable (parameter,) by the first fit; box: bounds."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    value: np.ndarray
    stress_rmse: np.ndarray
    identifiable: np.ndarray
    box: Box

    def at_bound(self) -> np.ndarray:
        """(parameter, radius) samples whose parameter lies on a bound: there the bound chose it."""
        unit = self.box.to_unit(np.moveaxis(self.value, 0, -1))
        return np.moveaxis(((unit <= 1e-6) | (unit >= 1.0 - 1e-6)).sum(axis=(1, 2)), -1, 0)


def fit_sample(task: FitTask) -> tuple[np.ndarray, float]:
    """Parameters (k,) in SI and RMSE of the axial stress in Pa; runs in a worker process."""
    find_law(task.law)
    fit, found = task.solve()
    values = task.box.to_values(found.best.x)
    return values, float(fit.errors(values)["stress"])


def fit_samples(
    scene: RevStudyScene,
    law: CalibrateScene,
    stress: np.ndarray,
    strain: np.ndarray,
    groups: np.ndarray,
    middle: int,
    processes: int,
    cluster: str | None,
    progress: Progress,
    done: Done | None = None,
) -> Fits:
    """Fit the law to the curves of every (radius, centre, realization).

    Parameters
    ----------
    scene, law : the study, and the scene of kind "calibrate" with its law, bounds and weights
    stress, strain : (radius, centre, run, step, 4) Pa and 1, shorter runs end in nan
    groups : (realization, confinement) runs of each realization
    middle : the centre whose largest radius gives the first fit
    processes, cluster, progress : see `compute`
    done : fits that are there already; takes the others

    Raises
    ------
    BadInput : the law refuses the scene's parameters, or a bound is out of its range
    """
    box = _box(law)
    radii, centres = stress.shape[:2]
    increments = law.increments or values_at("calibrate", scene.fidelity)["increments"]
    w = law.weights

    def task(r: int, c: int, runs: np.ndarray, plan: Plan, guesses: np.ndarray | None) -> FitTask:
        curves = tuple(_curve(stress[r, c, run], strain[r, c, run], f"run {run}") for run in runs)
        return FitTask(
            law.law, law.fixed_si(), box, Weights(w.normalise, w.last, w.strain, w.penalty), law.length, increments,
            law.correlation_length, scene.seed, plan, guesses, curves,
        )  # fmt: skip

    progress(0.0, "the first fit, at the largest radius")
    first = task(radii - 1, middle, groups[0], first_plan(scene), None)
    done = done or Done()
    if done.first is None:
        done.fitted_first(first.solve()[1].members)
    fit, members = first.fit(), done.first
    assert members is not None
    best = members[0]
    residuals = fit.residuals(box.to_values(best[None]))[0]
    slopes, coarse = (jacobian(lambda u: fit.residuals(box.to_values(u)), best, step) for step in (1e-4, 2e-4))
    known = identify(
        best, residuals, slopes, groups=fit.groups, lag=first.lag, noise=coarse - slopes, floor=fit.floor
    )
    guesses = members[: values_at("rev-study", scene.fidelity)["calibration.each.best"]]
    each = each_plan(scene, len(guesses))
    tasks = [task(r, c, runs, each, guesses) for r in range(radii) for c in range(centres) for runs in groups]
    results = compute(
        fit_sample, tasks, processes, lambda f: progress(0.1 + 0.9 * f, "calibrating"), cluster=cluster,
        known=done.fits, got=done.fitted,
    )  # fmt: skip
    shape = (radii, centres, len(groups))
    return Fits(
        names=box.names,
        units=tuple(LAWS[law.law].parameter(n).unit for n in box.names),
        value=np.moveaxis(np.array([v for v, _ in results]).reshape(*shape, box.size), -1, 0),
        stress_rmse=np.array([e for _, e in results]).reshape(shape),
        identifiable=np.asarray(known.identifiable, dtype=bool),
        box=box,
    )


def first_plan(scene: RevStudyScene) -> Plan:
    """The one fit that all samples begin with."""
    own = values_at("rev-study", scene.fidelity)
    names = {"starts": "starts", "particles": "particles", "generations": "generations", "best": "refine_best"}
    return Plan(**{field: own[f"calibration.first.{name}"] for name, field in names.items()})


def each_plan(scene: RevStudyScene, sets: int) -> Plan:
    """Each sample refines so many best sets of the first fit.

    Nothing random takes part: a swarm of its own for each sample ends in other basins that fit as well, and that
    would pass for scatter of the rock.
    """
    iterations = values_at("rev-study", scene.fidelity)["calibration.each.iterations"]
    return Plan(starts=1, particles=sets, generations=0, refine_best=sets, iterations=iterations)


def _curve(stress: np.ndarray, strain: np.ndarray, name: str) -> Curve:
    """Plane strain: no strain out of the plane, and shear is not prescribed (as calibrate reads curves)."""
    valid = np.isfinite(stress[:, 1])
    strain = strain[valid].copy()
    strain[:, 2:] = 0.0
    return Curve(name, stress[valid].copy(), strain)


def check_law(scene: RevStudyScene, law: CalibrateScene) -> None:
    """Raise BadInput where the law cannot be fitted, or a name that must settle is not free."""
    free = _box(law).names
    assert scene.calibration is not None
    faults = [
        Fault(str(scene.source.path), "calibration.properties", n, f"a free parameter: {', '.join(free)}")
        for n in scene.calibration.properties
        if n not in free
    ]
    if faults:
        raise BadInput(faults)


def _box(scene: CalibrateScene) -> Box:
    """Bounds of the free parameters of a law that averages of blocks can tell."""
    names, lower, upper, log, _ = scene.bounds_si()
    path = str(scene.source.path)
    if scene.test != "plane-strain":
        raise BadInput(Fault(path, "test", scene.test, '"plane-strain": averages of blocks'))
    try:
        CurveFit.stand_in(scene.law, scene.fixed_si(), names)
    except Refused as error:
        raise BadInput(Fault(path, "", "", f"a law that can be fitted ({error})")) from error
    return Box.of(names, lower, upper, log)


def parameters_of(law: CalibrateScene) -> int:
    """How many a fit has."""
    return _box(law).size


def chosen_parameters(scene: RevStudyScene, fits: Fits) -> Sequence[str]:
    """Names that must settle: those asked for, or those that the first fit's curves can tell.

    Raises
    ------
    BadInput : none asked for and none identifiable
    """
    assert scene.calibration is not None
    file, free = str(scene.source.path), ", ".join(fits.names)
    names = scene.calibration.properties or [n for n, told in zip(fits.names, fits.identifiable) if told]
    if not names:
        raise BadInput(
            Fault(
                file, "calibration.properties", "[]", f"names; the curves tell none of {free} apart from the others"
            )
        )
    return names
