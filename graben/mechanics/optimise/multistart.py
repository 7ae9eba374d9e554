"""A global search, then Levenberg-Marquardt, from several seeds: the search behind `calibrate`, and its runners-up.

Starts do not know of one another, so they can run anywhere and in any order, and a search that was interrupted
goes on with those that are missing; the answer is that of a straight run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.optimise.choices import explore
from graben.mechanics.optimise.levenberg_marquardt import FitResult, jacobian, levenberg_marquardt

Array = NDArray[np.float64]
Residuals = Callable[[Array], Array]


@dataclass(frozen=True)
class Plan:
    """How hard to search.

    method: the global search, one of `choices.METHODS`; starts: with different seeds; refine_best: how many points
    of each are refined, the best first and apart from one another; the rest as in `swarm` and
    `levenberg_marquardt`.
    """

    starts: int = 4
    particles: int = 24
    generations: int = 100
    inertia: float = 0.73
    inertia_reduction: float = 0.0
    cognitive: float = 1.5
    social: float = 1.5
    constriction: float = 1.0
    refine_best: int = 4
    damping: float = 1e-2
    factor: float = 4.0
    move_limit: float = 0.1
    iterations: int = 40
    tolerance: float = 1e-5
    method: str = "swarm"


@dataclass(frozen=True)
class Start:
    """What one start found: refined sets (j, k), their values (j,), why each ended, history (generations + 1,)."""

    members: Array
    values: Array
    reasons: tuple[str, ...]
    history: Array
    evaluations: int


@dataclass(frozen=True)
class Help:
    """Who evaluates, and what is known already; none of it changes the answer.

    executor: takes starts as tasks, or the particles of "appso", `chunk` in a task; residuals must then be
    picklable. done: finished starts by number; keep(number, start) is told of every new one.
    """

    executor: Executor | None = None
    chunk: int = 1
    done: Mapping[int, Start] = field(default_factory=dict)
    keep: Callable[[int, Start], None] | None = None


@dataclass(frozen=True)
class Found:
    """best: the best refined fit. members (j, k) and member_values (j,): every refined set, best first.

    history (generations + 1,): best value of the global search that led to the best fit; evaluations in all. ends
    (starts, k), end_values (starts,): the best of each start.
    """

    best: FitResult
    members: Array
    member_values: Array
    history: Array
    evaluations: int
    ends: Array
    end_values: Array


def sum_of_squares(residuals: Residuals, points: Array) -> Array:
    """(c, k) points -> (c,) sums; each depends on its own point alone, to the last bit."""
    r = np.ascontiguousarray(residuals(points))  # numpy adds along rows in one order only where they are contiguous
    return np.sum(r * r, axis=1)


def search(
    residuals: Residuals,
    size: int,
    plan: Plan,
    *,
    seed: int = 0,
    guesses: Array | None = None,
    help: Help | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Found:
    """Least squares over the unit box of `size` parameters; residuals takes (c, k) and gives (c, m), finite.

    guesses (j, k): points that every start begins with. Same seed, same answer, whoever helps.
    """
    help = help or Help()
    starts: dict[int, Start] = {i: s for i, s in help.done.items() if i < plan.starts}
    missing = [i for i in range(plan.starts) if i not in starts]

    def finish(i: int, start: Start) -> None:
        starts[i] = start
        if help.keep is not None:
            help.keep(i, start)
        if progress is not None:
            best = min(float(s.values.min()) for s in starts.values())
            progress(len(starts) / plan.starts, f"start {len(starts)} of {plan.starts} done, objective {best:.4g}")

    one = partial(one_start, residuals, size, plan, seed, guesses)
    if help.executor is not None and plan.method != "appso":
        tasks = {help.executor.submit(one, i): i for i in missing}
        try:
            for task in as_completed(tasks):
                finish(tasks[task], task.result())
        except BaseException:
            for task in tasks:
                task.cancel()
            raise
    else:
        for i in missing:

            def tell(part: float, best: float) -> None:
                if progress is not None:
                    words = f"{plan.method} {len(starts) + 1} of {plan.starts}, objective {best:.4g}"
                    progress((len(starts) + 0.7 * part) / plan.starts, words)

            finish(i, one(i, help.executor, help.chunk, tell))
    every = [starts[i] for i in sorted(starts)]
    values = np.concatenate([s.values for s in every])
    members = np.concatenate([s.members for s in every])
    owner = np.repeat(np.arange(len(every)), [len(s.values) for s in every])
    reasons = [r for s in every for r in s.reasons]
    order = np.argsort(values, kind="stable")
    top, x = order[0], members[order[0]]
    evaluations = sum(s.evaluations for s in every)
    best = FitResult(
        x, residuals(x[None])[0], float(values[top]), jacobian(residuals, x, 1e-4), 0, evaluations, reasons[top]
    )
    tops = [int(np.argmin(s.values)) for s in every]
    ends = np.array([s.members[i] for s, i in zip(every, tops)])
    end_values = np.array([s.values[i] for s, i in zip(every, tops)])
    return Found(best, members[order], values[order], every[owner[top]].history, evaluations, ends, end_values)


def one_start(
    residuals: Residuals,
    size: int,
    plan: Plan,
    seed: int,
    guesses: Array | None,
    number: int,
    executor: Executor | None = None,
    chunk: int = 1,
    progress: Callable[[float, float], None] | None = None,
) -> Start:
    """One global search and the refinement of its best points; `search` runs plan.starts of them."""
    own_seed = int(np.random.SeedSequence([seed, number]).generate_state(1)[0])
    flock = explore(
        partial(sum_of_squares, residuals), size, plan, seed=own_seed, starts=guesses, executor=executor, chunk=chunk,
        progress=progress,
    )  # fmt: skip
    chosen = _apart(flock.positions, flock.values, plan.refine_best)
    refine: Any = partial(
        levenberg_marquardt, residuals, damping=plan.damping, factor=plan.factor, move_limit=plan.move_limit,
        max_iterations=plan.iterations, tolerance=plan.tolerance,
    )  # fmt: skip
    points = [flock.positions[i] for i in chosen]
    fits = list(executor.map(refine, points)) if executor is not None else [refine(p) for p in points]
    return Start(
        np.array([f.x for f in fits]), np.array([f.value for f in fits]), tuple(f.reason for f in fits),
        flock.history, flock.evaluations + sum(f.evaluations for f in fits),
    )  # fmt: skip


def _apart(positions: Array, values: Array, count: int, gap: float = 0.15) -> list[int]:
    """Indices of the best positions that differ by `gap` or more in some parameter; at least the very best."""
    chosen: list[int] = []
    for i in np.argsort(values, kind="stable"):
        if len(chosen) >= count:
            break
        if all(np.abs(positions[i] - positions[j]).max() >= gap for j in chosen):
            chosen.append(int(i))
    return chosen
