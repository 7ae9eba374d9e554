"""Speed of the block model: zone-steps per second and cost per block, one thread, as JSON lines on stdout.

Voronoi granite of growing size, squeezed so that joints slide, contacts and their search included. Options:
--sizes EDGE ... (domain edges in m: 10 20), --steps N (2000).
"""

from __future__ import annotations

import argparse
import json
import platform
import time

import numpy as np

from graben.mechanics.blocks import relaxation as rx
from graben.mechanics.blocks.bodies import build_bodies
from graben.mechanics.blocks.compression import consolidate
from graben.mechanics.blocks.joints import Joint
from graben.mechanics.blocks.model import BlockModel
from graben.mechanics.blocks.tessellation import voronoi_blocks


def granite(size: float, dilation: float) -> BlockModel:
    """A square of Voronoi granite after consolidation, its top moving down."""
    outline = size * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    bodies = build_bodies(voronoi_blocks(outline, 0.5, seed=1))
    joint = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, np.tan(np.radians(dilation)), np.inf)
    model = BlockModel(bodies, young=65e9, poisson=0.2, density=2700.0, joint=joint, rounding=0.05, dt=2e-3)
    consolidate(model, -0.5e6, -0.25e6, tolerance=1e-2)
    model.hold(bodies.vertex_side[:, 2], 1, -0.0005 * size)
    model.motion.drive[rx.SPEED] = 1.0
    return model


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=float, nargs="+", default=[10.0, 20.0])
    parser.add_argument("--steps", type=int, default=2000)
    options = parser.parse_args()
    for size in options.sizes:
        for dilation in (0.0, 5.0):
            model = granite(size, dilation)
            model.advance(options.steps)
            searches, wall, cpu = model.rebuilds, time.perf_counter(), time.process_time()
            model.advance(options.steps)
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            zones, blocks = len(model.bodies.zone_block), len(model.bodies.block_area)
            print(
                json.dumps(
                    {
                        "benchmark": "blocks",
                        "blocks": blocks,
                        "zones": zones,
                        "dilation_deg": dilation,
                        "steps": options.steps,
                        "wall_s": round(wall, 3),
                        "cpu_s": round(cpu, 3),
                        "zone_steps_per_cpu_s": round(zones * options.steps / cpu),
                        "ns_per_block_step": round(1e9 * cpu / options.steps / blocks, 1),
                        "candidates": len(model.pairs.key),
                        "active": int(model.motion.active_count[0]),
                        "contact_searches": model.rebuilds - searches,
                        "machine": platform.machine(),
                        "python": platform.python_version(),
                    }
                ),
                flush=True,
            )


if __name__ == "__main__":
    main()
