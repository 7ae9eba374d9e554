"""Speed of the sphere kernels: particle-steps per second on one core, as JSON lines on stdout.

A settled crowd of spheres (largest over smallest radius 1.66, six walls), with and without friction. Options:
--particles N (16000), --steps N (300).
"""

from __future__ import annotations

import argparse
import json
import platform
import time

import numpy as np

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw

CLASSES = 8


def crowd(count: int, friction: float) -> Assembly:
    """Spheres of eight radii, settled under gravity."""
    radius = np.linspace(1.66, 1.0, CLASSES) * 1e-3
    kind = np.sort(np.arange(count) % CLASSES)
    side = 1.1 * float(np.sum((2.0 * radius[kind]) ** 3)) ** (1.0 / 3.0)
    weight = 2500.0 * 9.81 * side * 0.6
    stiffness = 2.0 * weight * 2e-3 / 5e-3  # 0.5 % overlap at the bottom
    values = {
        "radius": radius,
        "density": np.full(CLASSES, 2500.0),
        "normal_stiffness": np.full(CLASSES, stiffness),
        "wall_stiffness": 10.0 * stiffness,
        "damping": 0.5,
    }
    law = LinearLaw(**values, friction=friction, wall_friction=friction)
    height = float(np.sum(4.0 / 3.0 * np.pi * radius[kind] ** 3)) / (0.28 * side**2)
    rng = np.random.Generator(np.random.PCG64(0))
    x = insert(radius[kind], (side, side), height, rng, periodic=False)
    box = Assembly(law, x, kind, (side, side), periodic=False)
    fall = np.sqrt(2.0 * height / 9.81)
    box.advance(int(1.2 * fall / box.dt))
    return box


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--particles", type=int, default=16_000)
    parser.add_argument("--steps", type=int, default=300)
    options = parser.parse_args()
    for friction in (0.0, 0.5):
        box = crowd(options.particles, friction)
        box.advance(20)
        begun, rebuilds = time.perf_counter(), box.rebuilds
        cpu = time.process_time()
        box.advance(options.steps)
        wall, cpu = time.perf_counter() - begun, time.process_time() - cpu
        survey, _, _ = box.survey()
        print(
            json.dumps(
                {
                    "benchmark": "particles",
                    "case": "friction" if friction else "frictionless",
                    "particles": options.particles,
                    "steps": options.steps,
                    "particle_steps_per_cpu_s": options.particles * options.steps / cpu,
                    "particle_steps_per_s": options.particles * options.steps / wall,
                    "contacts_per_particle": 2.0 * survey.contacts / options.particles,
                    "candidates_per_contact": box.pairs / survey.contacts,
                    "rebuilds": box.rebuilds - rebuilds,
                    "machine": platform.processor() or platform.machine(),
                    "threads": 1,
                }
            ),
            flush=True,
        )


if __name__ == "__main__":
    main()
