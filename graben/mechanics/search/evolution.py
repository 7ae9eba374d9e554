"""Evolutionary searches of well-kept libraries, in the unit box: differential evolution of scipy, CMA-ES of `cmaes`.

Both are given whole populations to evaluate at once and return what `swarm` returns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.search.swarm import SwarmResult, finite_values, stratified

Array = NDArray[np.float64]
Objective = Callable[[Array], Array]


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

    function(points (c, k)) -> (c,); starts (j, k): the first of the population. At least 5 particles.
    """
    from scipy import optimize

    if size < 1 or particles < 5:
        raise ValueError(f"differential_evolution: expected size >= 1 and particles >= 5, found {size}, {particles}")
    rng = np.random.Generator(np.random.PCG64(seed))
    population = stratified(rng, particles, size)
    if starts is not None and len(starts):
        given = np.clip(np.atleast_2d(starts), 0.0, 1.0)[:particles]
        population[: len(given)] = given
    history: list[float] = []

    def tell(intermediate_result: Any) -> None:
        history.append(float(intermediate_result.fun))
        if progress is not None:
            progress(len(history) / max(1, generations), history[-1])

    spent = 0

    def value(columns: Array) -> Array:
        nonlocal spent
        spent += columns.shape[1]
        return finite_values(function(np.ascontiguousarray(columns.T)), columns.shape[1])

    result = optimize.differential_evolution(
        value, [(0.0, 1.0)] * size, init=population, maxiter=generations, rng=rng, polish=False, tol=0.0,
        updating="deferred", vectorized=True, callback=tell,
    )  # fmt: skip
    return SwarmResult(
        np.array(result.x), float(result.fun), np.array(result.population), np.array(result.population_energies),
        np.array(history or [float(result.fun)]), spent,
    )  # fmt: skip


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
    population, until particles x (generations + 1) evaluations are spent.

    The first mean is the first of `starts`, or the middle of the box. ModuleNotFoundError says what to install.
    """
    try:
        from cmaes import CMA
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "cma-es needs the package cmaes: pip install 'graben[search]'", name="cmaes"
        ) from error
    if size < 1 or particles < 5:
        raise ValueError(f"cma_es: expected size >= 1 and particles >= 5, found {size}, {particles}")
    rng = np.random.Generator(np.random.PCG64(seed))
    # The package refuses a single parameter: a second one without effect stands beside it.
    bounds = np.tile([0.0, 1.0], (max(size, 2), 1))
    left, population = particles * (generations + 1), particles
    total, spent = left, 0
    mean = np.full(len(bounds), 0.5)
    if starts is not None and len(starts):
        mean[:size] = np.clip(np.atleast_2d(starts)[0], 0.0, 1.0)
    optimiser, champions, champion_values = None, [], []
    history: list[float] = []
    last, last_values = np.empty((0, size)), np.empty(0)
    while left >= population:
        if optimiser is None:
            optimiser = CMA(mean, sigma, bounds, seed=int(rng.integers(2**31)), population_size=population)
            champions.append(mean[:size].copy())
            champion_values.append(np.inf)
        points = np.array([optimiser.ask() for _ in range(population)])
        values = finite_values(function(np.ascontiguousarray(points[:, :size])), population)
        optimiser.tell(list(zip(points, values.tolist())))
        left, spent = left - population, spent + population
        i = int(np.argmin(values))
        if values[i] < champion_values[-1]:
            champions[-1], champion_values[-1] = points[i, :size].copy(), float(values[i])
        last, last_values = points[:, :size], values
        history.append(min(champion_values))
        if progress is not None:
            progress(spent / total, history[-1])
        if optimiser.should_stop():
            optimiser, population, mean = None, 2 * population, rng.random(len(bounds))
    positions = np.concatenate([np.array(champions).reshape(-1, size), last])
    every = np.concatenate([np.array(champion_values), last_values])
    best = int(np.argmin(every))
    return SwarmResult(positions[best].copy(), float(every[best]), positions, every, np.array(history), spent)
