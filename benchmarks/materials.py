"""Speed of the laws, the point driver and the search, one thread, compile time aside; JSON lines on stdout.

The path is a plane-strain compression test at constant lateral stress, 200 increments of 0.025 %. Times are
the best of several repeats of CPU time of the calling thread. Options: --repeats N (5).
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from graben.mechanics.fitting.curves import Curve, CurveFit
from graben.mechanics.materials.laws import LAWS, pack, update
from graben.mechanics.materials.point import follow
from graben.mechanics.optimise.multistart import Plan, search
from graben.mechanics.optimise.space import Box

DP = {
    "young_modulus": 1.8e9,
    "poisson_ratio": 0.2,
    "friction_angle": math.radians(56),
    "dilation_angle": math.radians(22),
    "flow_stress_ratio": 0.81,
    "initial_yield": 5e4,
    "hardening_gain": 3e6,
    "hardening_rate": 200.0,
}
DAMAGE = {
    "damage": "ductile",
    "initiation_strain_050": 0.005,
    "initiation_strain_060": 0.02,
    "failure_displacement": 0.5,
}
SETS: dict[str, tuple[str, dict[str, Any]]] = {
    "elastic": ("elastic", {"young_modulus": 1.8e9, "poisson_ratio": 0.2}),
    "drucker-prager, K = 1": ("drucker-prager", {**DP, "flow_stress_ratio": 1.0}),
    "drucker-prager": ("drucker-prager", DP),
    "drucker-prager with damage": ("drucker-prager", {**DP, **DAMAGE}),
}


def best(repeats: int, run: Callable[[], Any]) -> float:
    run()  # compiled, caches warm
    times = []
    for _ in range(repeats):
        begun = time.thread_time()
        run()
        times.append(time.thread_time() - begun)
    return min(times)


def tell(case: str, **figures: Any) -> None:
    print(json.dumps({"benchmark": "materials", "case": case, "machine": platform.machine(), **figures}), flush=True)


def paths(increments: int) -> tuple[np.ndarray, np.ndarray]:
    confining = np.repeat([0.5e6, 1e6, 2e6, 4e6], 25)
    targets = np.zeros((len(confining), increments + 1, 4))
    targets[:, :, 0] = -confining[:, None]
    targets[:, :, 1] = -np.linspace(0.0, 0.05, increments + 1)
    start = np.zeros((len(confining), 4))
    start[:, :3] = -confining[:, None]
    return targets, start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats

    for name, (law, values) in SETS.items():
        par = pack(law, values)
        for increments in (50, 200):
            targets, start = paths(increments)
            run = partial(follow, law, par, "seee", targets, stress=start, length=5.0, tolerance=1e-8)
            seconds = best(repeats, run)
            each = seconds / len(targets)
            tell(f"path, {name}", increments=increments, us_per_path=1e6 * each, paths_per_s=1.0 / each)

    record, par = LAWS["drucker-prager"], pack("drucker-prager", {**DP, **DAMAGE})
    for components in (4, 6):
        for with_tangent in (True, False):
            tangent = np.zeros((components, components) if with_tangent else (0, 0))

            def points(components: int = components, tangent: np.ndarray = tangent) -> None:
                sig, state = np.zeros(components), record.initial_state(par)
                deps = np.zeros(components)
                deps[0], deps[1], deps[3] = 1e-4, -2e-4, 1e-5
                for _ in range(2000):
                    update(record.id, deps, sig, state, par, 1.0, tangent)

            seconds = best(repeats, points) / 2000
            tell("update called from Python", components=components, tangent=with_tangent, us=1e6 * seconds)

    targets, start = paths(200)
    response = follow("drucker-prager", par, "seee", targets, stress=start)
    curves = [
        Curve(f"{i}", response.stress[i, ::4], response.strain[i, ::4]) for i in range(0, 100, 25)
    ]  # 51 points, as in the reference curves
    free = [name for name in DP | DAMAGE if name != "damage"]
    centre = np.array([{**DP, **DAMAGE}[n] for n in free])
    low, high = centre / 3.0, centre * 3.0
    high[[1, 2, 3]], low[4], high[4] = [0.45, 1.15, 1.0], 0.78, 1.0
    box = Box.of(free, low, high, [True] * 4 + [False] + [True] * 6)
    for workers in (1, 2):
        fit = CurveFit("drucker-prager", {"damage": "ductile"}, free, curves, parts=2, workers=workers)
        inside = 0.0

        def residuals(u: np.ndarray, fit: CurveFit = fit) -> np.ndarray:
            nonlocal inside
            begun = time.perf_counter()
            r = fit.residuals(box.to_values(u))
            inside += time.perf_counter() - begun
            return r

        residuals(np.full((4, box.size), 0.5))
        inside = 0.0
        begun = time.perf_counter()
        found = search(residuals, box.size, Plan(starts=1, particles=24, generations=100, refine_best=1))
        wall = time.perf_counter() - begun
        tell(
            "swarm 24 x 100 over 4 curves, then Levenberg-Marquardt",
            workers=workers, wall_s=wall, evaluations=found.evaluations,
            overhead_fraction=1.0 - inside / wall,
        )  # fmt: skip


if __name__ == "__main__":
    main()
