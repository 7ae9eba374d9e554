"""Dynamically dimensioned search in the unit box: Tolson and Shoemaker, Water Resources Research 43 (2007) W01413.

A chain keeps its best point and tries one new point at a time. Early on every parameter is perturbed, later ever
fewer: parameter by parameter with probability 1 - ln(i) / ln(m) at trial i of m, at least one. The number of
trials is the only setting that matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.optimise.swarm import SwarmResult, finite_values, stratified

Array = NDArray[np.float64]


def _steps(rng: np.random.Generator, trials: int, chains: int, size: int, reach: float) -> Iterator[Array]:
    """The perturbations (chains, size) of every trial, drawn many trials at a time."""
    for begun in range(0, trials, 256):
        i = np.arange(begun + 1, min(begun + 256, trials) + 1)
        chance = 1.0 - np.log(i) / math.log(max(trials, 2))
        chosen = rng.random((i.size, chains, size)) < chance[:, None, None]
        one = np.eye(size, dtype=bool)[rng.integers(size, size=(i.size, chains))]
        chosen |= one & ~chosen.any(axis=2, keepdims=True)
        yield from np.where(chosen, reach * rng.standard_normal((i.size, chains, size)), 0.0)


def dds(
    function: Callable[[Array], Array],
    size: int,
    *,
    evaluations: int = 2400,
    chains: int = 4,
    reach: float = 0.2,
    seed: int = 0,
    starts: Array | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """Minimise function(points (c, k)) -> (c,) over the unit box; positions of the result: each chain's best.

    evaluations : in all, shared by `chains` independent chains that are evaluated together; reach : standard
    deviation of a perturbation, as a fraction of the range; starts : (j, k), the first points of the chains.

    Beyond a bound a point is reflected; where it would leave on the other side, it is put on the bound.
    """
    trials = evaluations // max(chains, 1)
    if size < 1 or chains < 1 or trials < 1 or not reach > 0.0:
        raise Refused(f"dds: expected size, chains >= 1 and evaluations >= chains, found {size}, {chains}")
    rng = np.random.Generator(np.random.PCG64(seed))
    first = min(max(5, round(0.005 * trials)), trials)
    x = stratified(rng, first * chains, size).reshape(first, chains, size)
    if starts is not None and len(starts):
        given = np.clip(np.atleast_2d(starts), 0.0, 1.0)[:chains]
        x[0, : len(given)] = given
    values = finite_values(function(x.reshape(-1, size)), first * chains).reshape(first, chains)
    pick, row = np.argmin(values, axis=0), np.arange(chains)
    best, best_values = x[pick, row].copy(), values[pick, row].copy()
    history = [float(best_values.min())]
    for i, step in enumerate(_steps(rng, trials - first, chains, size, reach), 1):
        # reflected at 0, then at 1
        trial = np.maximum(1.0 - np.abs(1.0 - np.abs(best + step)), 0.0)
        found = finite_values(function(trial), chains)
        better = found <= best_values
        best[better], best_values[better] = trial[better], found[better]
        history.append(float(best_values.min()))
        if progress is not None:
            progress(i / (trials - first), history[-1])
    top = int(np.argmin(best_values))
    return SwarmResult(
        best[top].copy(), float(best_values[top]), best, best_values, np.array(history), trials * chains
    )
