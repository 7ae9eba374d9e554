"""Laws held against one another by curves that they were not fitted to: cross-validation over curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from graben.mechanics.fitting.curves import Curve
from graben.schemas.scene import load_scene
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.stages.calibrate.problem import Problem, problem_of
from graben.stages.calibrate.state import State
from graben.stages.shared.record import Progress


@dataclass(frozen=True)
class Candidate:
    """A law with its free parameters: errors of the fit and of curves predicted from fits to the others, in Pa."""

    name: str
    law: str
    parameters: int
    fitted: float
    holdout: np.ndarray

    @property
    def cross_validated(self) -> float:
        """Root mean square over curves; nan where there is one curve only."""
        return float(np.sqrt(np.mean(self.holdout**2)))


def cross_validate(problem: Problem, curves: Sequence[Curve], state: State, progress: Progress) -> np.ndarray:
    """Axial-stress error of each curve predicted from a fit to the others; nan where there is no other."""
    out = np.full(len(curves), np.nan)
    if len(curves) < 2:
        return out
    plan = replace(problem.plan, starts=max(1, problem.plan.starts // 2))
    for i, held in enumerate(curves):
        progress(i / len(curves), f"{problem.name}: without {held.name}")
        rest = [c for j, c in enumerate(curves) if j != i]
        _objective, found = problem.solve(rest, plan, state, f"without curve {i + 1}")
        out[i] = problem.fit([held]).errors(problem.box.to_values(found.best.x))["stress"]
    return out


def rivals(paths: Sequence[Path], scene: CalibrateScene, names: list[str], threads: int) -> list[Problem]:
    """The problems of other scenes: their law, parameters and bounds; how to search and to weigh is `scene`'s own.

    names: taken already; the new ones are added.
    """
    out = []
    same = ("seed", "fidelity", "test", "length", "increments", "weights", "search", "staged", "swarm", "refine")
    for path in paths:
        other: CalibrateScene = load_scene(path, "calibrate")
        source = other.source
        name = label(path, names)
        other = other.model_copy(update={k: getattr(scene, k) for k in (*same, "correlation_length", "workers")})
        other._source = source
        out.append(problem_of(other, path, name, threads))
    return out


def label(path: Path, names: list[str]) -> str:
    """A name for a scene that no other has: its file's stem, numbered where it is taken; it is added to names."""
    name, number = path.stem, 2
    while name in names:
        name, number = f"{path.stem} {number}", number + 1
    names.append(name)
    return name


def compare(
    problems: Sequence[Problem], curves: Sequence[Curve], state: State, progress: Progress
) -> list[Candidate]:
    """Fit and cross-validate every problem on the same curves."""
    out = []
    for k, problem in enumerate(problems):

        def tell(part: float, words: str, k: int = k) -> None:
            progress((k + 0.3 + 0.7 * part) / len(problems), words)

        progress(k / len(problems), f"{problem.name}: all curves")
        objective, found = problem.solve(curves, problem.plan, state, "all curves")
        fitted = objective.fit.errors(problem.box.to_values(found.best.x))["stress"]
        holdout = cross_validate(problem, curves, state, tell)
        out.append(Candidate(problem.name, problem.scene.law, problem.box.size, fitted, holdout))
    return out
