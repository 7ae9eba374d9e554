"""What each optional feature costs in time and memory, on and off; a line of JSON each, or --table for markdown.

Runs of one body with the feature on and with nothing on take turns; `cpu_over_off` is the median of their ratios,
round by round, and `off_again` is the same for a second body with nothing on: the noise. `bytes_over_off` compares
the arrays that the bodies hold. Options: --rounds N (9), --table.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.scratch.body import Body
from graben.mechanics.scratch.setup import Tip
from graben.stages.blocks.stage import prepare
from graben.stages.fem_run.stage import prepare as prepare_fem
from graben.stages.scratch.stage import mesh_of, numerics_of
from graben.stages.scratch.stage import prepare as prepare_scratch
from graben.stages.shared.default_scene import default_scene

Made = tuple[Any, Callable[[], Any]]
"""What holds the arrays, and a piece of work."""


def blocks(*keys: str) -> Made:
    small = ["fidelity=draft", 'domain.width="10 m"', 'domain.height="10 m"', "numerics.steps=20000"]
    prepared = prepare(default_scene("blocks", [*small, *keys]))
    for _ in prepared.test.begin():
        pass
    model = prepared.model
    model.advance(300)
    return model, lambda: model.advance(300)


def grains(friction: float = 0.0, periodic: bool = True) -> Made:
    radius, one = 1e-3, np.array([1.0])
    law = LinearLaw(
        radius=one * radius, density=one * 2500.0, normal_stiffness=one * 1e3, wall_stiffness=1e4, shear_ratio=0.8,
        friction=friction, wall_friction=friction, damping=0.3, shear_damping=0.3,
    )  # fmt: skip
    place = np.stack(np.meshgrid(*[np.arange(12)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    position = (2.0 * radius) * place * 1.001 + radius
    box = Assembly(law, position, np.zeros(len(place), np.int64), (24.1 * radius,) * 2, periodic=periodic)
    box.advance(200)
    return box, lambda: box.advance(200)


def scratched(*keys: str) -> Made:
    scene = default_scene("scratch", ["fidelity=draft", 'tip.path="0 um"', *keys])
    law, par, _, _ = prepare_scratch(scene)
    tip, row = Tip(5e-5, 0.1, 5e-5, 2e-6, 0.0), np.zeros((1, 6))
    body = Body(
        mesh_of(scene), law.id, par, law.initial_state(par), 7800.0, numerics_of(scene), tip, row, 6e3, None, (-1, -1)
    )
    body.refresh()
    body.advance(1)
    return body, lambda: body.advance(5)


def elements(*keys: str) -> Made:
    body = prepare_fem(default_scene("fem", ["fidelity=draft", *keys]))[0].body
    state = body.untouched()
    still = np.zeros(body.pattern.size)
    return (body, state), lambda: [body.respond(state, still, True) for _ in range(5)]


ELASTIC = ('material.law="elastic"', 'material.parameters={young_modulus="1 GPa", poisson_ratio=0.2}')
FEATURES: dict[str, dict[str, Callable[[], Made]]] = {
    "blocks": {
        "off": lambda: blocks('joints.dilation="0 deg"'),
        "dilation": lambda: blocks(),
        "tension": lambda: blocks('joints.dilation="0 deg"', 'joints.tension="100 kPa"'),
        "residual strength": lambda: blocks('joints.dilation="0 deg"', 'joints.residual_friction="27 deg"'),
        "joints that stiffen": lambda: blocks('joints.dilation="0 deg"', 'joints.closure="1 mm"'),
        "yielding zones": lambda: blocks('joints.dilation="0 deg"', 'rock.zones="mohr-coulomb"'),
        "rigid blocks": lambda: blocks('joints.dilation="0 deg"', 'rock.zones="rigid"'),
        "local damping": lambda: blocks(
            'joints.dilation="0 deg"', 'numerics.damping="local"', "numerics.damping_share=0.1"
        ),
        "force check": lambda: blocks('joints.dilation="0 deg"', "numerics.force_check=0.05"),
        "two threads": lambda: blocks('joints.dilation="0 deg"', "numerics.threads=2"),
    },
    "grains": {
        "off": grains,
        "friction": lambda: grains(0.5),
        "walls": lambda: grains(0.0, False),
        "friction, walls": lambda: grains(0.5, False),
    },
    "scratch": {"off": scratched, "eight points": lambda: scratched("numerics.points=8")},
    "fem": {"off": lambda: elements(*ELASTIC), "plasticity and damage": elements},
}


def held(thing: Any, seen: set[int] | None = None) -> int:
    """Bytes of all arrays that hang on something of graben."""
    seen = set() if seen is None else seen
    if id(thing) in seen or isinstance(thing, str | type):
        return 0
    seen.add(id(thing))
    if isinstance(thing, np.ndarray):
        return held(thing.base, seen) if isinstance(thing.base, np.ndarray) else thing.nbytes
    parts: Iterable[Any] = ()
    if isinstance(thing, tuple | list):
        parts = thing
    elif isinstance(thing, dict):
        parts = thing.values()
    elif is_dataclass(thing):
        parts = [getattr(thing, field.name) for field in fields(thing)]
    elif hasattr(thing, "__dict__") and type(thing).__module__.startswith("graben."):
        parts = vars(thing).values()
    return sum(held(part, seen) for part in parts)


def measured(stage: str, rounds: int) -> list[dict[str, Any]]:
    made = {name: make() for name, make in FEATURES[stage].items()}
    made["off again"] = FEATURES[stage]["off"]()
    spent: dict[str, list[float]] = {name: [] for name in made}
    for _ in range(rounds):
        for name, (_, work) in made.items():
            begun = time.process_time()
            work()
            spent[name].append(time.process_time() - begun)
    off = np.array(spent["off"])
    plain = held(made["off"][0])
    return [
        {
            "benchmark": "features",
            "stage": stage,
            "feature": name,
            "rounds": rounds,
            "cpu_over_off": round(float(np.median(np.array(spent[name]) / off)), 3),
            "lowest_over_lowest": round(float(min(spent[name]) / off.min()), 3),
            "megabytes": round(held(thing) / 1e6, 2),
            "bytes_over_off": round(held(thing) / plain, 3),
            "load": round(os.getloadavg()[0], 1),
        }
        for name, (thing, _) in made.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--stages", nargs="+", choices=FEATURES, default=list(FEATURES))
    parser.add_argument("--table", action="store_true", help="rows of a markdown table")
    options = parser.parse_args()
    if options.table:
        print("| stage | feature | CPU over off: median, lowest | arrays, MB (over off) |\n|---|---|---|---|")
    for stage in options.stages:
        for row in measured(stage, options.rounds):
            cost = f"{row['cpu_over_off']}, {row['lowest_over_lowest']}"
            memory = f"{row['megabytes']} ({row['bytes_over_off']})"
            line = f"| {stage} | {row['feature']} | {cost} | {memory} |" if options.table else json.dumps(row)
            print(line, flush=True)


if __name__ == "__main__":
    main()
