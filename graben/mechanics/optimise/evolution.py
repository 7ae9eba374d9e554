"""Evolutionary searches of well-kept libraries, in the unit box: differential evolution of scipy, CMA-ES of `cmaes`.

Both are given whole populations to evaluate at once and return what `swarm` returns.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.optimise.swarm import SwarmResult, finite_values, stratified

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]
FEWEST = 5  # sets of a population


def differential_evolution(
    function: Objective,
    size: int,
    *,
    particles: int = 24,
    generations: int = 100,
    seed: int = 0,
    starts: Array | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """scipy.optimize.differential_evolution (Storn and Price 1997), best1bin, without its own polishing.

    The trials of a generation are made in one go (`_Trials`): scipy makes them one by one, which costs as much as a
    tenth of the model.

    function(points (c, k)) -> (c,); starts (j, k): the first of the population. At least 5 particles.
    """
    from scipy import optimize

    if size < 1 or particles < FEWEST:
        raise Refused(f"differential_evolution: expected size >= 1, particles >= {FEWEST}, found {size}, {particles}")
    rng = np.random.Generator(np.random.PCG64(seed))
    population = stratified(rng, particles, size)
    if starts is not None and len(starts):
        given = np.clip(np.atleast_2d(starts), 0.0, 1.0)[:particles]
        population[: len(given)] = given
    history: list[float] = []
    spent = 0

    def value(columns: Array) -> Array:
        nonlocal spent
        spent += columns.shape[1]
        found = finite_values(function(np.ascontiguousarray(columns.T)), columns.shape[1])
        history.append(min([float(found.min()), *history[-1:]]))
        if progress is not None and generations:
            progress(min(1.0, (len(history) - 1) / generations), history[-1])
        return found

    result = optimize.differential_evolution(
        value, [(0.0, 1.0)] * size, strategy=_Trials(), init=population, maxiter=generations, rng=rng,
        polish=False, tol=0.0, updating="deferred", vectorized=True,
    )  # fmt: skip
    return SwarmResult(
        np.array(result.x), float(result.fun), np.array(result.population), np.array(result.population_energies),
        np.array(history), spent,
    )  # fmt: skip


class _Trials:
    """best1bin for a whole generation at its first candidate, handed out one by one; `updating="deferred"` asks for
    the candidates in order. The best stands first in scipy's population."""

    trials: Array = np.empty((0, 0))

    def __call__(self, candidate: int, population: Array, rng: np.random.Generator) -> Array:
        if candidate == 0:
            count, size = population.shape
            # two others, different from each other and from the candidate
            first = rng.integers(count - 1, size=count)
            second = rng.integers(count - 2, size=count)
            own = np.arange(count)
            first += first >= own
            second += second >= np.minimum(own, first)
            second += second >= np.maximum(own, first)
            scale = rng.uniform(0.5, 1.0)  # scipy's dither
            mutant = population[0] + scale * (population[first] - population[second])
            taken = rng.random((count, size)) < 0.7
            taken[own, rng.integers(size, size=count)] = True
            self.trials = np.where(taken, mutant, population)
        return self.trials[candidate]


def cma_es(
    function: Objective,
    size: int,
    *,
    particles: int = 24,
    generations: int = 100,
    seed: int = 0,
    starts: Array | None = None,
    sigma: float = 0.25,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """CMA-ES (Hansen 2016) of the package `cmaes`; where it has converged it begins again elsewhere with twice the
    population, until particles x (generations + 1) evaluations are spent. Points beyond a bound are evaluated, and
    reported, at their mirror image.

    The first mean is the first of `starts`, or the middle of the box. ModuleNotFoundError says what to install.
    """
    try:
        from cmaes import CMA
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "cma-es needs the package cmaes: pip install 'graben[search]'", name="cmaes"
        ) from error
    if size < 1 or particles < FEWEST:
        raise Refused(f"cma_es: expected size >= 1 and particles >= {FEWEST}, found {size}, {particles}")
    rng = np.random.Generator(np.random.PCG64(seed))
    # The package refuses a single parameter: a second one without effect stands beside it.
    sizes = max(size, 2)
    left, population = particles * (generations + 1), particles
    total, spent = left, 0
    mean = np.full(sizes, 0.5)
    if starts is not None and len(starts):
        mean[:size] = np.clip(np.atleast_2d(starts)[0], 0.0, 1.0)
    optimiser, champions, champion_values = None, [], []
    history: list[float] = []
    last, last_values = np.empty((0, size)), np.empty(0)
    while left >= population:
        if optimiser is None:
            optimiser = CMA(mean, sigma, seed=int(rng.integers(2**31)), population_size=population)
            champions.append(mean[:size].copy())
            champion_values.append(np.inf)
        asked = [optimiser.ask() for _ in range(population)]
        points = np.mod(np.array(asked), 2.0)
        points = np.ascontiguousarray(np.minimum(points, 2.0 - points)[:, :size])
        values = finite_values(function(points), population)
        optimiser.tell(list(zip(asked, values.tolist())))
        left, spent = left - population, spent + population
        i = int(np.argmin(values))
        if values[i] < champion_values[-1]:
            champions[-1], champion_values[-1] = points[i].copy(), float(values[i])
        last, last_values = points, values
        history.append(min(champion_values))
        if progress is not None:
            progress(spent / total, history[-1])
        if len(history) % 4 == 0 and optimiser.should_stop():
            optimiser, population, mean = None, 2 * population, rng.random(sizes)
    positions = np.concatenate([np.array(champions).reshape(-1, size), last])
    every = np.concatenate([np.array(champion_values), last_values])
    best = int(np.argmin(every))
    return SwarmResult(positions[best].copy(), float(every[best]), positions, every, np.array(history), spent)
