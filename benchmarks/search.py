"""The search's own cost beside the model's, for every method; quality for the same budget; JSON lines on stdout.

The model is Drucker-Prager with damage on the UDEC reference curves. `overhead_fraction` is the CPU time that a
search spends outside of the model, refinement included. Options: --seeds N (3), --particles N (24), --generations N
(60), --increments N between two points (2, as in standard fidelity; 1, as in draft, is the cheapest model there is).
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.search.choices import METHODS, explore
from graben.mechanics.search.multistart import search, sum_of_squares
from graben.schemas.scene import load_scene
from graben.stages.calibrate_problem import problem_of
from graben.stages.calibrate_workers import workers_of
from graben.stages.measured import Reading, read_measured

SCENE = Path(__file__).parents[1] / "pipelines/upscaling/calibrate-udec.toml"


def tell(case: str, **figures: Any) -> None:
    print(json.dumps({"benchmark": "search", "case": case, "machine": platform.machine(), **figures}), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--particles", type=int, default=24)
    parser.add_argument("--generations", type=int, default=60)
    parser.add_argument("--increments", type=int, default=2)
    options = parser.parse_args()
    scene = load_scene(SCENE, "calibrate", ["fidelity=draft", f"increments={options.increments}"])
    problem = problem_of(scene, SCENE, "udec")
    objective = problem.objective(read_measured(scene.curves, Reading()))
    inside = 0.0

    def residuals(unit: np.ndarray) -> np.ndarray:
        nonlocal inside
        begun = time.thread_time()
        r = objective(unit)
        inside += time.thread_time() - begun
        return r

    residuals(np.full((2, problem.box.size), 0.5))  # compiled
    budget = {"particles": options.particles, "generations": options.generations}
    for method in METHODS:
        plan = replace(problem.plan, method=method, starts=1, **budget)
        explore(lambda u: np.sum(u * u, axis=1), 3, replace(plan, generations=2), seed=0)  # libraries imported
        figures = []
        for seed in range(options.seeds):
            inside, begun = 0.0, time.thread_time()
            found = search(residuals, problem.box.size, plan, seed=seed)
            spent = time.thread_time() - begun
            rmse = objective.fit.errors(problem.box.to_values(found.best.x))["stress"]
            figures.append((1.0 - inside / spent, spent, found.evaluations, found.best.value, rmse))
        overhead, spent, evaluations, value, rmse = np.array(figures).T
        tell(
            f"one start, {method}", increments=options.increments,
            overhead_fraction=float(np.median(overhead)), cpu_s=float(np.median(spent)),
            evaluations=int(np.median(evaluations)), objective_median=float(np.median(value)),
            objective_worst=float(value.max()), rmse_mpa_median=float(np.median(rmse)) / 1e6,
            rmse_mpa_worst=float(rmse.max()) / 1e6,
        )  # fmt: skip

    plan = replace(problem.plan, method="appso", starts=1, **budget)
    for count in (1, 2):
        with workers_of("appso", count, plan.particles, None) as workers:
            points = np.full((2, problem.box.size), 0.5)
            if workers.executor is not None:  # workers started, kernels loaded
                list(workers.executor.map(objective, [points] * 4 * count))
            begun = time.perf_counter()
            explore(
                partial(sum_of_squares, objective),
                problem.box.size,
                plan,
                seed=0,
                executor=workers.executor,
                chunk=workers.chunk,
            )
            tell("asynchronous swarm alone, by processes", processes=count, wall_s=time.perf_counter() - begun)


if __name__ == "__main__":
    main()
