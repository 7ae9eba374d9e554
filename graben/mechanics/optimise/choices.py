"""The global searches that a user can choose from, behind one call and with the same budget of evaluations."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.optimise.appso import appso
from graben.mechanics.optimise.dds import dds
from graben.mechanics.optimise.evolution import FEWEST, cma_es, differential_evolution
from graben.mechanics.optimise.swarm import SwarmResult, swarm

Array = NDArray[np.float64]

METHODS = ("swarm", "appso", "dds", "differential-evolution", "cma-es")


def fewest(method: str) -> int:
    """The smallest number of particles that a search takes."""
    return FEWEST if method in ("differential-evolution", "cma-es") else 1


class Budget(Protocol):
    """What `explore` reads of a plan: the method, its budget particles x (generations + 1), the swarm's rule."""

    @property
    def method(self) -> str: ...
    @property
    def particles(self) -> int: ...
    @property
    def generations(self) -> int: ...
    @property
    def inertia(self) -> float: ...
    @property
    def inertia_reduction(self) -> float: ...
    @property
    def cognitive(self) -> float: ...
    @property
    def social(self) -> float: ...
    @property
    def constriction(self) -> float: ...


def explore(
    function: Callable[[Array], Array],
    size: int,
    plan: Budget,
    *,
    seed: int,
    starts: Array | None = None,
    executor: Executor | None = None,
    chunk: int = 1,
    progress: Callable[[float, float], None] | None = None,
) -> SwarmResult:
    """Minimise function(points (c, k)) -> (c,) over the unit box by plan.method, one of METHODS.

    starts (j, k): points to begin with. executor and chunk serve "appso", see there; the other methods evaluate
    here.
    """
    swarming: dict[str, Any] = {
        "inertia": plan.inertia, "inertia_reduction": plan.inertia_reduction, "cognitive": plan.cognitive,
        "social": plan.social, "constriction": plan.constriction,
    }  # fmt: skip
    budget: dict[str, Any] = {"particles": plan.particles, "generations": plan.generations}
    if plan.method == "swarm":
        return swarm(function, size, seed=seed, starts=starts, progress=progress, **budget, **swarming)
    if plan.method == "appso":
        return appso(
            function, size, seed=seed, starts=starts, executor=executor, chunk=chunk, progress=progress,
            **budget, **swarming,
        )  # fmt: skip
    if plan.method == "dds":
        evaluations = plan.particles * (plan.generations + 1)
        return dds(
            function, size, evaluations=evaluations, chains=min(4, evaluations), seed=seed, starts=starts,
            progress=progress,
        )  # fmt: skip
    if plan.method == "differential-evolution":
        return differential_evolution(function, size, seed=seed, starts=starts, progress=progress, **budget)
    if plan.method == "cma-es":
        return cma_es(function, size, seed=seed, starts=starts, progress=progress, **budget)
    raise ValueError(f"method: expected one of {', '.join(METHODS)}, found {plan.method!r}")
