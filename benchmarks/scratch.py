"""Speed of the scratch kernels: element updates per second of CPU on one core, as JSON lines on stdout.

What each feature costs: elastic, J2, ERVE with 20 subdomains; one point against eight. Option: --steps N (40).
"""

from __future__ import annotations

import argparse
import json
import platform
import time

import numpy as np

from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.scratch.body import Body
from graben.mechanics.scratch.mesh import specimen
from graben.mechanics.scratch.motion import Phase, phase_rows
from graben.mechanics.scratch.setup import Numerics, Tip

STEEL = [[0.0, 380e6], [0.05, 483e6], [0.2, 589e6], [1.0, 762e6]]


def measure(law: str, points: int, steps: int) -> dict[str, object]:
    """Indent to plastic flow and time the steps after it."""
    values: dict[str, object] = {"young_modulus": 210e9, "poisson_ratio": 0.33}
    if law != "elastic":
        values["hardening"] = STEEL
    if law == "erve":
        values["damage_threshold"] = 5e6
        values["max_damage_step"] = 1e-5
    par = pack(law, values)
    tip = Tip(50e-6, 0.1, 50e-6, 2e-6, 60e-6)
    mesh = specimen(200e-6, 50e-6, 15e-6, 50e-6, 60e-6, np.sqrt(2 * tip.radius * tip.depth), 1.5e-6)
    wave = 6316.0
    rows = phase_rows([Phase("indent", 2e-6, 0.05 * wave, (0.0, 0.0, -1.0))])
    numerics = Numerics(points=points, volume_limit=0.5)
    body = Body(
        mesh, LAWS[law].id, par, LAWS[law].initial_state(par), 7800.0, numerics, tip, rows, wave, None, (0, -1)
    )
    for _ in range(3):
        body.advance(body.refresh())
    body.updates = 0
    begun = time.process_time()
    body.refresh()
    body.advance(steps)
    seconds = time.process_time() - begun
    return {
        "benchmark": "scratch",
        "law": law,
        "points": points,
        "elements": len(mesh.cells),
        "updates_per_cpu_second": body.updates / seconds,
        "machine": platform.processor() or platform.machine(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=40)
    steps = parser.parse_args().steps
    for law, points in (("elastic", 1), ("j2", 1), ("erve", 1), ("j2", 8)):
        measure(law, points, 1)  # compiles
        print(json.dumps(measure(law, points, steps)), flush=True)


if __name__ == "__main__":
    main()
