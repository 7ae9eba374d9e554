"""Speed of the plane-strain solver on the slope: element pass, factorisation, one load step; JSON lines on stdout.

Options: --sizes (background element sizes, m), --repeat N.
"""

from __future__ import annotations

import argparse
import json
import platform
import time

import numpy as np

from graben.mechanics.fem.body import Body, Material, make_body
from graben.mechanics.fem.loads import body_force
from graben.mechanics.fem.newton import NewtonOptions, equilibrate, factorise
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.meshes.mapped import mapped_mesh
from graben.mechanics.meshes.sizing import SizeField

CORNERS = np.array([(x, y) for y in (0, 20) for x in (0, 30, 80)] + [(40, 50), (80, 50)], float)
PATCHES = np.array([(0, 1, 4, 3), (1, 2, 5, 4), (4, 5, 7, 6)])
ROCK = {
    "young_modulus": 1.8e9,
    "poisson_ratio": 0.2,
    "friction_angle": 0.95,
    "dilation_angle": 0.4,
    "initial_yield": 5e4,
    "hardening_gain": 2e6,
    "hardening_rate": 200.0,
}


def slope(size: float, law: str) -> Body:
    """The slope of Y 4.5 with elements of one size."""
    mesh = mapped_mesh(CORNERS, PATCHES, SizeField(size))
    values = ROCK if law == "drucker-prager" else {k: ROCK[k] for k in ("young_modulus", "poisson_ratio")}
    parameters = pack(law, values)
    x, y = mesh.points.T
    fixed = np.stack([(x == 0) | (x == 80), y == 0], axis=1)
    return make_body(mesh, [Material(LAWS[law].id, parameters, LAWS[law].initial_state(parameters))], fixed.ravel())


def cpu(action: object, repeat: int) -> float:
    """Smallest CPU time of a call, s."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        action()  # type: ignore[operator]
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=float, nargs="+", default=[2.0, 1.0, 0.5])
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    for size in options.sizes:
        for law in ("elastic", "drucker-prager"):
            body = slope(size, law)
            weight = body_force(body.mesh, 2700.0, np.array([0.0, -9.81]))
            start = body.untouched()
            held = np.zeros(len(body.fixed))
            step = equilibrate(body, start, weight, held, NewtonOptions())
            increment = step.state.displacement
            values = body.respond(start, increment, True).values
            matrix = body.free_block.matrix(values)
            print(
                json.dumps(
                    {
                        "benchmark": "fem",
                        "case": law,
                        "elements": len(body.mesh.quads),
                        "degrees_of_freedom": len(body.free),
                        "forces_and_stiffness_cpu_s": cpu(
                            lambda b=body, s=start, i=increment: b.respond(s, i, True), options.repeat
                        ),
                        "forces_cpu_s": cpu(
                            lambda b=body, s=start, i=increment: b.respond(s, i, False), options.repeat
                        ),
                        "factorisation_cpu_s": cpu(lambda m=matrix: factorise(m), options.repeat),
                        "gravity_step_cpu_s": cpu(
                            lambda b=body, s=start, w=weight, h=held: equilibrate(b, s, w, h, NewtonOptions()), 1
                        ),
                        "gravity_step_iterations": step.iterations,
                        "machine": platform.processor() or platform.machine(),
                        "threads": 1,
                    }
                ),
                flush=True,
            )


if __name__ == "__main__":
    main()
