"""Asynchronous parallel particle swarm in the unit box, Y 2.6.2, whose answer does not depend on the workers.

A particle moves as soon as its own evaluation is done: the swarm's best that it follows is that of all particles
`lag` generations before (Y: the previous iteration), so that nobody waits for the slowest of the generation. A
particle can run ahead of the slowest by `lag` generations, then it waits.

Which best a particle sees is thus fixed by generation numbers and never by the order in which evaluations come
back, and random numbers belong to a particle and a generation: the same seed gives the same positions to the last bit
on one worker and on a hundred, fast or slow.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.optimise.swarm import SwarmResult, finite_values, starting

Array = NDArray[np.float64]


class _Flock:
    """Positions, own bests, and the bests of whole generations as they become complete."""

    def __init__(self, x: Array, v: Array, generations: int, seed: int, lag: int, rule: dict[str, float]) -> None:
        count = len(x)
        self.x, self.v, self.seed, self.lag, self.rule = x, v, seed, lag, rule
        self.own, self.own_values = x.copy(), np.full(count, np.inf)
        self.generation = np.zeros(count, np.int64)  # the one that a particle is in
        self.waiting = np.zeros(count, bool)  # evaluated, and not moved since
        self.left = np.full(generations + 1, count, np.int64)  # particles yet to be evaluated in a generation
        self.complete = -1  # all generations up to this one are evaluated
        self.history = np.full(generations + 1, np.inf)
        # Bests by generation and random numbers by generation; those that nobody needs any more are dropped.
        self.leaders: dict[int, Array] = {}
        self.trails: dict[int, tuple[Array, Array]] = {}
        self.random: dict[int, Array] = {}

    def record(self, group: NDArray[np.int64], values: Array) -> None:
        """The values of the particles `group` (j,) where they stand."""
        better = values < self.own_values[group]
        self.own[group[better]], self.own_values[group[better]] = self.x[group[better]], values[better]
        self.waiting[group] = True
        for g in np.unique(self.generation[group]):
            those = group[self.generation[group] == g]
            if g not in self.trails:
                self.trails[g] = np.full(len(self.x), np.inf), np.empty_like(self.x)
            self.trails[g][0][those], self.trails[g][1][those] = self.own_values[those], self.own[those]
            self.left[g] -= len(those)
        while self.complete + 1 < len(self.left) and self.left[self.complete + 1] == 0:
            self.complete += 1
            trail, places = self.trails.pop(self.complete)
            best = int(np.argmin(trail))
            self.leaders[self.complete], self.history[self.complete] = places[best], trail[best]

    def move(self) -> NDArray[np.int64]:
        """Move every particle that may, Y (2.55), (2.56), with the swarm's best of `lag` generations before (at the
        start, the particle's own); their numbers."""
        able = self.waiting & (self.generation - self.lag <= self.complete) & (self.generation + 1 < len(self.left))
        moved = np.flatnonzero(able)
        rule = self.rule
        for g in np.unique(self.generation[moved]):
            i = moved[self.generation[moved] == g]
            leader = self.leaders[g - self.lag] if g >= self.lag else self.own[i]
            if g not in self.random:
                stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence([self.seed, int(g)])))
                self.random[g] = stream.random((2, *self.x.shape))
            u1, u2 = self.random[g][:, i]
            inertia = rule["inertia"] * (1.0 - rule["inertia_reduction"]) ** int(g)
            pull = rule["cognitive"] * u1 * (self.own[i] - self.x[i]) + rule["social"] * u2 * (leader - self.x[i])
            v = rule["constriction"] * (inertia * self.v[i] + pull)
            x = self.x[i] + v
            v[(x < 0.0) | (x > 1.0)] *= -0.5
            self.x[i], self.v[i] = np.clip(x, 0.0, 1.0), v
        self.generation[moved] += 1
        self.waiting[moved] = False
        slowest = int(self.generation.min())
        for table, oldest in ((self.random, slowest), (self.leaders, slowest - self.lag)):
            for g in [g for g in table if g < oldest]:
                del table[g]
        return moved


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
        raise Refused(f"appso: expected size, particles, lag, chunk >= 1, found {size}, {particles}, {lag}, {chunk}")
    rng = np.random.Generator(np.random.PCG64(seed))
    x, v = starting(rng, particles, size, starts)
    rule = {
        "inertia": inertia, "inertia_reduction": inertia_reduction, "cognitive": cognitive, "social": social,
        "constriction": constriction,
    }  # fmt: skip
    flock = _Flock(x, v, generations, seed, lag, rule)
    ready = np.arange(particles)
    pending: dict[Future[Any], NDArray[np.int64]] = {}
    try:
        while ready.size or pending:
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
                flock.record(group, finite_values(values, len(group)))
            ready = flock.move()
            if progress is not None and flock.complete > before:
                progress(flock.complete / max(1, generations), float(flock.history[flock.complete]))
    except BaseException:
        for future in pending:
            future.cancel()
        raise
    best = int(np.argmin(flock.own_values))
    return SwarmResult(
        flock.own[best].copy(), float(flock.own_values[best]), flock.own, flock.own_values,
        flock.history, particles * (generations + 1),
    )  # fmt: skip
