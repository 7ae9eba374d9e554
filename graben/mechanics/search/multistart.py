"""Swarm, then Levenberg-Marquardt, from several seeds: the search behind `calibrate`, and its runners-up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.search.levenberg_marquardt import FitResult, levenberg_marquardt
from graben.mechanics.search.swarm import swarm

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plan:
    """How hard to search.

    starts: swarms with different seeds; refine_best: how many particles of each swarm are refined, the best
    first and apart from one another; the rest as in `swarm` and `levenberg_marquardt`.
    """

    starts: int = 3
    particles: int = 24
    generations: int = 100
    inertia: float = 0.73
    inertia_reduction: float = 0.0
    cognitive: float = 1.5
    social: float = 1.5
    constriction: float = 1.0
    refine_best: int = 3
    damping: float = 1e-2
    factor: float = 4.0
    move_limit: float = 0.1
    iterations: int = 40
    tolerance: float = 1e-5


@dataclass(frozen=True)
class Found:
    """best: the best refined fit. members (j, k) and member_values (j,): every refined set, best first.

    history (generations + 1,): best value of the swarm that led to the best fit; evaluations in all.
    """

    best: FitResult
    members: Array
    member_values: Array
    history: Array
    evaluations: int


def search(
    residuals: Callable[[Array], Array],
    size: int,
    plan: Plan,
    *,
    seed: int = 0,
    guesses: Array | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Found:
    """Least squares over the unit box of `size` parameters; residuals takes (c, k) and gives (c, m), finite.

    guesses (j, k): points that every swarm begins with. Same seed, same answer.
    """

    def value(points: Array) -> Array:
        r = residuals(points)
        return np.einsum("ij,ij->i", r, r)

    fits: list[FitResult] = []
    histories: list[Array] = []
    evaluations = 0
    share = 1.0 / max(1, plan.starts)
    for start in range(plan.starts):

        def tell(part: float, best: float, start: int = start) -> None:
            if progress is not None:
                progress((start + 0.7 * part) * share, f"swarm {start + 1} of {plan.starts}, objective {best:.4g}")

        flock = swarm(
            value,
            size,
            particles=plan.particles,
            generations=plan.generations,
            inertia=plan.inertia,
            inertia_reduction=plan.inertia_reduction,
            cognitive=plan.cognitive,
            social=plan.social,
            constriction=plan.constriction,
            seed=int(np.random.SeedSequence([seed, start]).generate_state(1)[0]),
            starts=guesses,
            progress=tell,
        )
        evaluations += flock.evaluations
        chosen = _apart(flock.positions, flock.values, plan.refine_best)
        for i, particle in enumerate(chosen):
            fit = levenberg_marquardt(
                residuals,
                flock.positions[particle],
                damping=plan.damping,
                factor=plan.factor,
                move_limit=plan.move_limit,
                max_iterations=plan.iterations,
                tolerance=plan.tolerance,
            )
            fits.append(fit)
            histories.append(flock.history)
            evaluations += fit.evaluations
            if progress is not None:
                best = min(f.value for f in fits)
                progress((start + 0.7 + 0.3 * (i + 1) / len(chosen)) * share, f"refined, objective {best:.4g}")
    order = np.argsort([f.value for f in fits], kind="stable")
    return Found(
        fits[order[0]],
        np.array([fits[i].x for i in order]),
        np.array([fits[i].value for i in order]),
        histories[order[0]],
        evaluations,
    )


def _apart(positions: Array, values: Array, count: int, gap: float = 0.15) -> list[int]:
    """Indices of the best positions that differ by `gap` or more in some parameter; at least the very best."""
    chosen: list[int] = []
    for i in np.argsort(values, kind="stable"):
        if len(chosen) >= count:
            break
        if all(np.abs(positions[i] - positions[j]).max() >= gap for j in chosen):
            chosen.append(int(i))
    return chosen
