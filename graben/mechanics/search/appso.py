"""Asynchronous parallel particle swarm in the unit box, Y 2.6.2, whose answer does not depend on the workers.

A particle moves as soon as its own evaluation is done: the swarm's best that it follows is that of all particles
`lag` generations before (Y: the previous iteration), so that nobody waits for the slowest of the generation. A
particle can run ahead of the slowest by `lag` generations, then it waits.

Which best a particle sees is thus fixed by generation numbers and never by the order in which evaluations come
back, and every particle has random numbers of its own: the same seed gives the same positions to the last bit on
one worker and on a hundred, fast or slow.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.search.swarm import SwarmResult, finite_values, stratified

Array = NDArray[np.float64]


class _Flock:
    """Positions, own bests, and the bests of whole generations as they become complete."""

    def __init__(self, x: Array, v: Array, generations: int, seed: int, lag: int, rule: dict[str, float]) -> None:
        count = len(x)
        self.x, self.v, self.lag, self.rule = x, v, lag, rule
        self.own, self.own_values = x.copy(), np.full(count, np.inf)
        self.generation = np.zeros(count, np.int64)  # the one that a particle is in
        self.random = [np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, i]))) for i in range(count)]
        self.trail = np.full((generations + 1, count), np.inf)  # value of each particle's own best
        self.trail_x = np.empty((generations + 1, *x.shape))
        self.left = np.full(generations + 1, count, np.int64)
        self.complete = -1  # all generations up to this one are evaluated

    def record(self, i: int, value: float) -> None:
        """The value of particle i where it stands."""
        if value < self.own_values[i]:
            self.own[i], self.own_values[i] = self.x[i], value
        g = self.generation[i]
        self.trail[g, i], self.trail_x[g, i] = self.own_values[i], self.own[i]
        self.left[g] -= 1
        while self.complete + 1 < len(self.left) and self.left[self.complete + 1] == 0:
            self.complete += 1

    def may_move(self, i: int) -> bool:
        return bool(self.generation[i] - self.lag <= self.complete and self.generation[i] + 1 < len(self.left))

    def move(self, i: int) -> None:
        """Y (2.55), (2.56), with the swarm's best of `lag` generations before; at the start, the particle's own."""
        g = self.generation[i]
        seen = g - self.lag
        leader = self.own[i] if seen < 0 else self.trail_x[seen, int(np.argmin(self.trail[seen]))]
        u1, u2 = self.random[i].random((2, self.x.shape[1]))
        rule = self.rule
        inertia = rule["inertia"] * (1.0 - rule["inertia_reduction"]) ** int(g)
        pull = rule["cognitive"] * u1 * (self.own[i] - self.x[i]) + rule["social"] * u2 * (leader - self.x[i])
        v = rule["constriction"] * (inertia * self.v[i] + pull)
        x = self.x[i] + v
        v[(x < 0.0) | (x > 1.0)] *= -0.5
        self.x[i], self.v[i] = np.clip(x, 0.0, 1.0), v
        self.generation[i] += 1


def appso(
    function: Callable[[Array], Array],
    size: int,
    *,
    executor: Executor | None = None,
    chunk: int = 1,
    lag: int = 1,
    particles: int = 24,
    generations: int = 100,
    inertia: float = 0.73,
    inertia_reduction: float = 0.0,
    cognitive: float = 1.5,
    social: float = 1.5,
    constriction: float = 1.0,
    seed: int = 0,
    starts: Array | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """Minimise over the unit box; parameters as in `swarm`, and:

    executor : evaluates particles elsewhere (`function` must then be picklable); None here, one after the other
    chunk : particles evaluated in one task at most; more spares overhead where an evaluation is cheap
    lag : age in generations of the swarm's best that a particle follows

    Neither executor nor chunk changes the answer.
    """
    if size < 1 or particles < 1 or generations < 0 or lag < 1 or chunk < 1:
        raise ValueError(
            f"appso: expected size, particles, lag, chunk >= 1, found {size}, {particles}, {lag}, {chunk}"
        )
    rng = np.random.Generator(np.random.PCG64(seed))
    x = stratified(rng, particles, size)
    if starts is not None and len(starts):
        given = np.clip(np.atleast_2d(starts), 0.0, 1.0)[:particles]
        x[: len(given)] = given
    v = 0.5 * (stratified(rng, particles, size) - x)
    rule = {
        "inertia": inertia, "inertia_reduction": inertia_reduction, "cognitive": cognitive, "social": social,
        "constriction": constriction,
    }  # fmt: skip
    flock = _Flock(x, v, generations, seed, lag, rule)
    ready, waiting = list(range(particles)), set()
    pending: dict[Future[Any], list[int]] = {}
    try:
        while ready or pending:
            if executor is None:
                back = [(ready, function(flock.x[ready]))]
            else:
                for first in range(0, len(ready), chunk):
                    group = ready[first : first + chunk]
                    pending[executor.submit(function, flock.x[group])] = group
                done, _ = wait(pending, return_when=FIRST_COMPLETED)
                back = [(pending.pop(future), future.result()) for future in done]
            before = flock.complete
            for group, values in back:
                for i, value in zip(group, finite_values(values, len(group))):
                    flock.record(i, value)
                    waiting.add(i)
            ready = [i for i in sorted(waiting) if flock.may_move(i)]
            waiting -= set(ready)
            for i in ready:
                flock.move(i)
            if progress is not None and flock.complete > before:
                progress(flock.complete / max(1, generations), float(flock.trail[flock.complete].min()))
    except BaseException:
        for future in pending:
            future.cancel()
        raise
    best = int(np.argmin(flock.own_values))
    return SwarmResult(
        flock.own[best].copy(), float(flock.own_values[best]), flock.own, flock.own_values,
        flock.trail.min(axis=1), particles * (generations + 1),
    )  # fmt: skip
