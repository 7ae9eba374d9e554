"""Particle swarm in the unit box, synchronous, Y 2.6.1 (2.49)-(2.56).

Each generation moves all particles and then evaluates them in one call, so the answer depends on the seed
alone and not on how many workers share the evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SwarmResult:
    """best (k,) and its value; positions (particles, k) and values (particles,) of each particle's own best;
    history (generations + 1,) of the best value; evaluations."""

    best: Array
    value: float
    positions: Array
    values: Array
    history: Array
    evaluations: int


def stratified(rng: np.random.Generator, count: int, size: int) -> Array:
    """Latin hypercube sample (count, size) of the unit box."""
    cells = np.stack([rng.permutation(count) for _ in range(size)], axis=1) if size else np.empty((count, 0))
    return (cells + rng.random((count, size))) / count


def starting(rng: np.random.Generator, particles: int, size: int, starts: Array | None) -> tuple[Array, Array]:
    """First positions and velocities: the given starts, then a stratified sample; velocities half way to another."""
    x = stratified(rng, particles, size)
    if starts is not None and len(starts):
        given = np.clip(np.atleast_2d(starts), 0.0, 1.0)[:particles]
        x[: len(given)] = given
    return x, 0.5 * (stratified(rng, particles, size) - x)


def swarm(
    function: Callable[[Array], Array],
    size: int,
    *,
    particles: int = 24,
    generations: int = 100,
    inertia: float = 0.73,
    inertia_reduction: float = 0.0,
    cognitive: float = 1.5,
    social: float = 1.5,
    constriction: float = 1.0,
    seed: int = 0,
    starts: Array | None = None,
    patience: int = 0,
    tolerance: float = 1e-4,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """Minimise over the unit box.

    Parameters
    ----------
    function : (particles, k) positions -> (particles,) values, all finite
    size : k
    inertia, cognitive, social, constriction : omega, c1, c2, zeta of Y (2.54); the random factors are
    uniform in 0..1
    inertia_reduction : the inertia loses this fraction in each generation
    starts : (j, k) positions of the first particles; the others are a stratified sample
    patience : stop when the best value fell by less than `tolerance` (relative) in that many generations; 0
    never

    A particle that would leave the box is put on its face and its velocity there is reversed and halved.
    """
    if size < 1 or particles < 1 or generations < 0:
        raise Refused(f"swarm: expected size, particles >= 1, found {size}, {particles}")
    rng = np.random.Generator(np.random.PCG64(seed))
    x, v = starting(rng, particles, size, starts)
    values = finite_values(function(x), particles)
    own, own_values = x.copy(), values.copy()
    best = int(np.argmin(own_values))
    history = [own_values[best]]
    for generation in range(generations):
        u1, u2 = rng.random((particles, size)), rng.random((particles, size))
        v = constriction * (inertia * v + cognitive * u1 * (own - x) + social * u2 * (own[best] - x))
        inertia *= 1.0 - inertia_reduction
        x = x + v
        outside = (x < 0.0) | (x > 1.0)
        v[outside] *= -0.5
        x = np.clip(x, 0.0, 1.0)
        values = finite_values(function(x), particles)
        better = values < own_values
        own[better], own_values[better] = x[better], values[better]
        best = int(np.argmin(own_values))
        history.append(own_values[best])
        if progress is not None:
            progress((generation + 1) / generations, float(own_values[best]))
        if patience and generation >= patience and history[-1] > (1.0 - tolerance) * history[-1 - patience]:
            break
    return SwarmResult(
        own[best].copy(), float(own_values[best]), own, own_values, np.array(history), particles * len(history)
    )


def finite_values(values: Array, count: int) -> Array:
    """What an objective gave for `count` points, as float64; ValueError unless that many and all finite."""
    values = np.asarray(values, float)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise ValueError(f"search: the function must give {count} finite values")
    return values
