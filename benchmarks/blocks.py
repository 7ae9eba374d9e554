"""Speed of the block model: zone-steps per second and cost per block as JSON lines on stdout.

Voronoi granite of growing size, squeezed so that joints slide, contacts and their search included. Options:
--sizes EDGE ... (domain edges in m: 10 20), --dilations DEG ... (0 5), --steps N (2000), --threads N ... (1; what
several gain over the first is a line of its own), --features (what each feature of joints and each law of zones
costs: median of twelve rounds, in turn, of runs with it and without).
"""

from __future__ import annotations

import argparse
import json
import platform
import time

import numpy as np

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.contact.sleeping import AWAY, CLOSED
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.biaxial import consolidate
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks
from graben.mechanics.blocks.zones.plastic import ELASTIC, PlasticZones, Strength

PLAIN = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, 0.0, np.inf)
FEATURES = {
    "plain": (PLAIN,),
    "plain again": (PLAIN,),
    "dilation": (PLAIN._replace(dilation=np.tan(np.radians(5))),),
    "dilation that stops": (PLAIN._replace(dilation=np.tan(np.radians(5)), dilation_limit=5e-3),),
    "tension": (PLAIN._replace(tension=1e5),),
    "residual strength": (PLAIN._replace(residual_friction=0.5, residual_cohesion=0.0),),
    "stiffening": (PLAIN._replace(closure=1e-3),),
    "two sets": (PLAIN, PLAIN),
}
# Y's rock, in which next to nothing yields, and one so weak that a seventh of it does.
LAWS: dict[str, dict] = {
    "rigid blocks": {"rigid": True},
    "yielding zones": {"strength": Strength(np.radians(51), 55.1e6, 11.7e6)},
    "yielding zones, weak": {"strength": Strength(np.radians(40), 2e6, 0.5e6, np.radians(5))},
}


def granite(
    size: float, dilation: float, joints: tuple[Joint, ...] = (), threads: int = 1, **law: object
) -> BlockModel:
    """A square of Voronoi granite after consolidation, its top moving down; with several sets, edges take turns."""
    outline = size * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    bodies = build_bodies(voronoi_blocks(outline, 0.5, seed=1))
    sets = joints or (PLAIN._replace(dilation=np.tan(np.radians(dilation))),)
    model = BlockModel(
        bodies,
        young=65e9,
        poisson=0.2,
        density=2700.0,
        joint=sets[0],
        more_joints=sets[1:],
        edge_set=np.arange(len(bodies.edge_from)) % len(sets),
        rounding=0.05,
        dt=2e-3,
        threads=threads,
        **law,
    )
    consolidate(model, -0.5e6, -0.25e6, tolerance=5e-2)
    # The same motion per step whatever the size: step costs compare.
    model.hold(bodies.vertex_side[:, 2], 1, -0.005)
    model.set_speed(1.0)
    return model


def feature_costs(size: float, steps: int) -> None:
    """Step cost with each feature on, over that of plain joints."""
    models = {name: granite(size, 0.0, joints) for name, joints in FEATURES.items()}
    models |= {name: granite(size, 0.0, (PLAIN,), **law) for name, law in LAWS.items()}
    spent: dict[str, list[float]] = {name: [] for name in models}
    for _ in range(12):
        for name, model in models.items():
            cpu = time.process_time()
            model.advance(steps)
            spent[name].append(time.process_time() - cpu)
    plain = np.median(spent["plain"])
    for name, model in models.items():
        ratio = float(np.median(spent[name]) / plain)
        blocks = len(model.bodies.block_area)
        line = {"benchmark": "blocks features", "feature": name, "blocks": blocks, "cost_over_plain": round(ratio, 3)}
        if isinstance(model.skeleton.zones, PlasticZones):
            line["yielded"] = round(float((model.skeleton.zones.flag != ELASTIC).mean()), 3)
        line["ns_per_block_step"] = round(1e9 * float(np.median(spent[name])) / steps / blocks, 1)
        print(json.dumps(line), flush=True)


def step_costs(size: float, dilation: float, steps: int, threads: list[int]) -> None:
    """Cost of a step of one model, with each number of threads in turn, five rounds; then what threads gain."""
    model = granite(size, dilation)
    model.advance(steps)
    zones, blocks = len(model.bodies.zone_block), len(model.bodies.block_area)
    spent = np.zeros((5, len(threads), 2))
    before = model.rebuilds
    for spell in spent:
        for seen, model.threads in zip(spell, threads, strict=True):
            seen[:] = time.perf_counter(), time.process_time()
            model.advance(steps // 5)
            seen[:] = time.perf_counter() - seen[0], time.process_time() - seen[1]
    pairs = len(model.pairs.key)
    kinds = np.bincount(model.motion.kind, minlength=AWAY + 1)
    for k, count in enumerate(threads):
        wall, cpu = np.median(spent[:, k], axis=0) / (steps // 5)
        line = {"benchmark": "blocks", "blocks": blocks, "zones": zones, "dilation_deg": dilation, "steps": steps}
        line |= {"threads": count, "wall_us_per_step": round(1e6 * wall, 1), "cpu_us_per_step": round(1e6 * cpu, 1)}
        line |= {"zone_steps_per_cpu_s": round(zones / cpu), "ns_per_block_step": round(1e9 * cpu / blocks, 1)}
        line |= {"candidates": pairs, "closed": int(kinds[CLOSED]), "awake": int(kinds[:AWAY].sum())}
        line |= {"contact_searches": model.rebuilds - before}
        line |= {"machine": platform.machine(), "python": platform.python_version()}
        print(json.dumps(line), flush=True)
    for k, count in enumerate(threads[1:], start=1):
        wall, cpu = np.median(spent[:, k] / spent[:, 0], axis=0)
        line = {"benchmark": "blocks threads", "blocks": blocks, "dilation_deg": dilation, "threads": count}
        line |= {"speedup": round(1.0 / wall, 3), "cpu_over_one_thread": round(cpu, 3)}
        print(json.dumps(line), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=float, nargs="+", default=[10.0, 20.0])
    parser.add_argument("--dilations", type=float, nargs="+", default=[0.0, 5.0])
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    parser.add_argument("--features", action="store_true")
    options = parser.parse_args()
    if options.features:
        feature_costs(options.sizes[0], options.steps)
        return
    for size in options.sizes:
        for dilation in options.dilations:
            step_costs(size, dilation, options.steps, options.threads)


if __name__ == "__main__":
    main()
