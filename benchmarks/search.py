"""The search's own cost beside the model's, for every method; quality for the same budget; JSON lines on stdout.

The model is Drucker-Prager with damage on the UDEC reference curves. `overhead_fraction` is the CPU time that a
search spends outside of the model, refinement included. Options: --seeds N (3), --particles N (24), --generations N
(60), --increments N between two points (2, as in standard fidelity; 1, as in draft, is the cheapest model there is).

`--scaling` measures only what a second thread or process gives: swarm and refinement by threads, the asynchronous
swarm by processes, one and two in turn for --rounds N (5), best of each; `ratio` is the one over the other, with the
machine's load at the end. Wall times: run it on a quiet machine. `ratio_by_cpu` = 2 / (1 + serial share) is what CPU
times alone promise: serial is what the calling thread spends outside of the paths (threads), or to hand out and take
in tasks beside two busy processes. It needs no quiet machine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.optimise.choices import METHODS, explore
from graben.mechanics.optimise.multistart import search, sum_of_squares
from graben.schemas.scene import load_scene
from graben.stages.calibrate.measured import Reading, read_measured
from graben.stages.calibrate.problem import problem_of
from graben.stages.calibrate.workers import Sent, workers_of

SCENE = Path(__file__).parents[1] / "pipelines/upscaling/calibrate-udec.toml"


def tell(case: str, **figures: Any) -> None:
    print(json.dumps({"benchmark": "search", "case": case, "machine": platform.machine(), **figures}), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--particles", type=int, default=24)
    parser.add_argument("--generations", type=int, default=60)
    parser.add_argument("--increments", type=int, default=2)
    parser.add_argument("--scaling", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    if options.scaling:
        scaling(options)
        return
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


def scaling(options: argparse.Namespace) -> None:
    scene = load_scene(SCENE, "calibrate", ["fidelity=draft", f"increments={options.increments}"])
    curves = read_measured(scene.curves, Reading())
    single = problem_of(scene, SCENE, "udec")
    size = single.box.size
    budget = {"particles": options.particles, "generations": options.generations, "starts": 1}
    objectives = {n: problem_of(scene, SCENE, "udec", threads=n).objective(curves) for n in (1, 2)}
    for objective in objectives.values():
        objective(np.full((4, size), 0.5))  # compiled, threads started
    walls: dict[tuple[str, int], list[float]] = {}
    shares: dict[str, list[float]] = {}
    inside = 0.0
    predict = objectives[1].fit.predict

    def timed(*arguments: Any) -> Any:
        nonlocal inside
        begun = time.thread_time()
        found = predict(*arguments)
        inside += time.thread_time() - begun
        return found

    with workers_of("appso", 2, options.particles, None) as workers:
        assert workers.executor is not None
        sent = Sent(objectives[1])
        list(workers.executor.map(sent, [np.full((2, size), 0.5)] * 8))  # workers started, kernels loaded
        alone = 0.0
        for _ in range(options.rounds):
            for n in (1, 2):
                begun = time.perf_counter()
                search(objectives[n], size, replace(single.plan, method="swarm", **budget))
                walls.setdefault(("threads, swarm and refinement", n), []).append(time.perf_counter() - begun)
                begun, spent = time.perf_counter(), time.process_time()
                explore(
                    partial(sum_of_squares, sent), size, replace(single.plan, method="appso", **budget),
                    seed=0, executor=workers.executor if n == 2 else None, chunk=workers.chunk,
                )  # fmt: skip
                walls.setdefault(("processes, asynchronous swarm", n), []).append(time.perf_counter() - begun)
                spent = time.process_time() - spent
                alone = spent if n == 1 else alone
            shares.setdefault("processes, asynchronous swarm", []).append(spent / alone)
    objectives[1].fit.predict = timed  # type: ignore[method-assign]
    for _ in range(options.rounds):
        inside, begun = 0.0, time.thread_time()
        search(objectives[1], size, replace(single.plan, method="swarm", **budget))
        shares.setdefault("threads, swarm and refinement", []).append(1.0 - inside / (time.thread_time() - begun))
    for what in dict.fromkeys(name for name, _ in walls):
        one, two = min(walls[what, 1]), min(walls[what, 2])
        serial = float(np.median(shares[what]))
        tell(
            f"two {what}", wall_1_s=one, wall_2_s=two, ratio=one / two, ratio_by_cpu=2.0 / (1.0 + serial),
            load=os.getloadavg()[0], rounds=options.rounds,
        )  # fmt: skip


if __name__ == "__main__":
    main()
