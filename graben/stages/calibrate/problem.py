"""A calibrate scene as a problem of the search: box, priors, plan; solved for any set of curves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.fitting.curves import Curve, CurveFit, Weights
from graben.mechanics.fitting.objective import Objective, Priors
from graben.mechanics.materials.laws import LAWS
from graben.mechanics.optimise.choices import fewest
from graben.mechanics.optimise.multistart import Found, Plan, search
from graben.mechanics.optimise.space import Box
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.stages.calibrate.state import State
from graben.stages.calibrate.workers import Sent
from graben.stages.shared.estimate import Estimate, work
from graben.stages.shared.fidelity import setting

_POINT_BYTES = 200.0  # of one point of one particle: prediction and residuals
_ELASTIC = ("young_modulus", "poisson_ratio")
_ELASTIC_PART = 0.3  # of a curve's largest change of stress: where its elastic stage ends
Tell = Callable[[float, str], None]


@dataclass(frozen=True)
class Problem:
    """What is sought and how; `name` tells its searches from those of other problems in the saved state."""

    name: str
    scene: CalibrateScene
    box: Box
    fixed: dict[str, Any]
    priors: Priors
    plan: Plan
    increments: int
    guesses: np.ndarray | None
    threads: int

    def fit(self, curves: Sequence[Curve], **changes: Any) -> CurveFit:
        w = self.scene.weights
        settings: dict[str, Any] = {"law": self.scene.law, "fixed": self.fixed, "free": self.box.names} | changes
        return CurveFit(
            curves=curves,
            weights=Weights(w.normalise, w.last, w.strain, w.penalty),
            length=self.scene.length,
            parts=self.increments,
            workers=self.threads,
            **settings,
        )

    def objective(self, curves: Sequence[Curve]) -> Objective:
        scene = self.scene
        return Objective(self.fit(curves), self.box, self.priors, scene.weights.noise, scene.correlation_length)

    def solve(
        self, curves: Sequence[Curve], plan: Plan, state: State, task: str, tell: Tell | None = None
    ) -> tuple[Objective, Found]:
        """Search for the parameters that follow `curves`; `task` names the search in the saved state."""
        guesses, evaluations = self.guesses, 0
        task = f"{self.name}: {task}"
        if self.scene.staged:
            staged, evaluations = self._staged(curves, plan, state, task)
            guesses = staged if guesses is None else np.concatenate([staged, guesses])
        objective = self.objective(curves)
        found = search(
            objective if state.workers.executor is None else Sent(objective),
            self.box.size,
            plan,
            seed=self.scene.seed,
            guesses=guesses,
            help=state.help(task, self.box.size),
            progress=tell,
        )
        return objective, replace(found, evaluations=found.evaluations + evaluations)

    def _stages(self, curves: Sequence[Curve]) -> list[tuple[str, list[str], list[Curve], dict[str, Any]]]:
        """Name, free parameters, curves and changes of the fit of each stage that has a parameter."""
        law = LAWS[self.scene.law]
        damage = {p.name for p in law.parameters if p.when is not None and p.when[0] == "damage"}
        amounts = {n: 0.0 for n in self.box.names if n.endswith("_damage") and n not in damage}
        free = self.box.names
        groups: list[tuple[str, list[str], list[Curve], dict[str, Any]]] = [
            ("elastic", [n for n in free if n in _ELASTIC], _beginnings(curves), {"law": "elastic"}),
            ("hardening", [n for n in free if n not in {*_ELASTIC, *damage, *amounts}], _rises(curves), {}),
            ("damage", [n for n in free if n in damage or n in amounts], list(curves), {}),
        ]
        return [stage for stage in groups if stage[1]]

    def _stage_fit(
        self, stage: str, names: list[str], part: Sequence[Curve], changes: dict[str, Any], known: dict[str, float]
    ) -> CurveFit:
        law = LAWS[self.scene.law]
        damage = {p.name for p in law.parameters if p.when is not None and p.when[0] == "damage"}
        fixed = {**self.fixed, **known}
        if stage == "elastic":
            fixed = {n: v for n, v in fixed.items() if n in _ELASTIC}
        elif stage == "hardening":
            amounts = {n: 0.0 for n in self.box.names if n.endswith("_damage") and n not in damage}
            fixed = {n: v for n, v in fixed.items() if n not in damage} | amounts
            fixed |= {"damage": "none"} if damage else {}
        return self.fit(part, **{"fixed": fixed, "free": names} | changes)

    def check(self, curves: Sequence[Curve]) -> None:
        """Raise Refused where the law or a curve cannot be fitted; nothing is searched."""
        self.fit(curves)
        known: dict[str, float] = {}
        for stage, names, part, changes in self._stages(curves) if self.scene.staged else []:
            self._stage_fit(stage, names, part, changes, known)
            known |= {n: float(self.box.lower[self.box.names.index(n)]) for n in names}

    def _staged(self, curves: Sequence[Curve], plan: Plan, state: State, task: str) -> tuple[np.ndarray, int]:
        """A guess (1, k) from one group of parameters after the other, Y 5.2: elastic ones from the beginnings of
        the curves, hardening without damage up to their peaks, damage from whole curves; and its evaluations.
        """
        known: dict[str, float] = {}
        evaluations = 0
        short = replace(plan, starts=1, generations=min(plan.generations, 40), refine_best=2)
        for stage, names, part, changes in self._stages(curves):
            at = np.array([self.box.names.index(n) for n in names])
            box = Box.of(names, self.box.lower[at], self.box.upper[at], self.box.log[at])
            fit = self._stage_fit(stage, names, part, changes, known)
            own = np.isin(self.priors.columns, at)
            priors = Priors(
                np.array([int(np.flatnonzero(at == c)[0]) for c in self.priors.columns[own]], dtype=np.int64),
                self.priors.mean[own],
                self.priors.deviation[own],
            )
            goal = Objective(fit, box, priors, self.scene.weights.noise, self.scene.correlation_length)
            guess = None if self.guesses is None else self.guesses[:, at]
            done = state.help(f"{task}, {stage}", len(names))
            found = search(goal, len(names), short, seed=self.scene.seed, guesses=guess, help=done)
            evaluations += found.evaluations
            known |= {n: float(v) for n, v in zip(names, box.to_values(found.best.x))}
        return self.box.to_unit(np.array([known[n] for n in self.box.names]))[None], evaluations


def _beginnings(curves: Sequence[Curve]) -> list[Curve]:
    """Each curve up to a fraction of its largest change of axial stress, at least three points."""
    out = []
    for c in curves:
        change = np.abs(c.stress[:, 1] - c.stress[0, 1])
        out.append(_cut(c, int(np.argmax(change > _ELASTIC_PART * change.max()))))
    return out


def _rises(curves: Sequence[Curve]) -> list[Curve]:
    """Each curve up to its largest axial stress: before damage, at least three points."""
    return [_cut(c, int(np.argmax(np.abs(c.stress[:, 1])))) for c in curves]


def _cut(curve: Curve, last: int) -> Curve:
    rows = slice(0, max(3, last + 1))
    return replace(curve, stress=curve.stress[rows], strain=curve.strain[rows])


def problem_of(scene: CalibrateScene, scene_path: Path, name: str, threads: int = 1) -> Problem:
    """Check the scene against its law; BadInput with every fault. threads share the candidates of a call."""
    names, lower, upper, log, initial = scene.bounds_si()
    law = LAWS[scene.law]
    fixed = scene.fixed_si()
    faults = []
    stand_in = {**fixed, **dict(zip(names, upper))}
    for parameter, text in law.faults(stand_in):
        if parameter:
            key = f"free.{parameter}" if parameter in names else f"fixed.{parameter}"
            faults.append(Fault(str(scene_path), key, "" if parameter in stand_in else "(absent)", text))
    if scene.search == "cma-es" and find_spec("cmaes") is None:
        expected = "the package cmaes: pip install 'graben[search]'"
        faults.append(Fault(str(scene_path), "search", scene.search, expected))
    plan = plan_of(scene)
    if plan.particles < fewest(scene.search):
        expected = f"at least {fewest(scene.search)} for {scene.search}"
        faults.append(Fault(str(scene_path), "swarm.particles", str(plan.particles), expected))
    if faults:
        raise BadInput(faults)
    box = Box.of(names, lower, upper, log)
    guess = None
    if any(v is not None for v in initial):
        middle = box.to_values(np.full(box.size, 0.5))
        point = np.array([m if v is None else v for v, m in zip(initial, middle)])
        guess = box.to_unit(point)[None]
    return Problem(
        name, scene, box, fixed, _priors(scene, box), plan, setting(scene, "increments"), guess, threads
    )  # fmt: skip


def sizes_of(problem: Problem, rivals: int, curves: Sequence[Curve]) -> list[Estimate]:
    """Evaluations of all searches, and what the curves of one generation keep."""
    plan, scene = problem.plan, problem.scene
    points = float(sum(len(c.stress) for c in curves))
    refined = plan.refine_best * plan.iterations * (problem.box.size + 3.0)
    evaluations = plan.starts * (plan.particles * (plan.generations + 1.0) + refined)
    folds = len(curves) if scene.cross_validation or rivals else 0
    evaluations *= (1.0 + 0.5 * folds) * (1.0 + rivals)
    key, value = "swarm.particles", str(plan.particles)
    return [
        Estimate("particles", plan.particles, plan.particles * points * _POINT_BYTES, key, value),
        work("evaluations times increments", evaluations * points, problem.increments, "swarm.generations",
             str(plan.generations)),
    ]  # fmt: skip


def plan_of(scene: CalibrateScene) -> Plan:
    """How hard the scene says to search."""
    s, r = scene.swarm, scene.refine
    return Plan(
        starts=setting(scene, "swarm.starts"),
        particles=setting(scene, "swarm.particles"),
        generations=setting(scene, "swarm.generations"),
        inertia=s.inertia,
        inertia_reduction=s.inertia_reduction,
        cognitive=s.cognitive,
        social=s.social,
        constriction=s.constriction,
        refine_best=setting(scene, "refine.best"),
        damping=r.damping,
        factor=r.factor,
        move_limit=r.move_limit,
        iterations=r.iterations,
        method=scene.search,
    )


def _priors(scene: CalibrateScene, box: Box) -> Priors:
    given = scene.priors_si()
    if not given:
        return Priors.none()
    columns = np.array([box.names.index(n) for n in given], dtype=np.int64)
    middle = box.to_values(np.full(box.size, 0.5))
    for n, (mean, _deviation) in given.items():
        middle[box.names.index(n)] = mean
    unit = box.to_unit(middle)
    deviation = np.array([d for _mean, d in given.values()]) / box.slope(unit)[columns]
    return Priors(columns, unit[columns], deviation)
