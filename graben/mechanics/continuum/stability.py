"""Evidence that a load cannot be exceeded: how soft the body has become in its softest direction."""

from __future__ import annotations

import numpy as np

from graben.mechanics.continuum.body import Body, State
from graben.mechanics.continuum.newton import factorise


def softest_stiffness(
    body: Body, state: State, increment: np.ndarray | None = None, before: State | None = None, rounds: int = 60
) -> float:
    """Smallest absolute eigenvalue of the stiffness, N/m per metre, by inverse iteration.

    Without `before`, of the stiffness that a vanishing increment meets (elastic). With `before` and
    `increment`, of the consistent tangent of that last step: it nears zero at a limit load. Returns 0 where the
    matrix is singular.
    """
    start = state if before is None else before
    move = np.zeros(body.pattern.size) if increment is None else increment
    response = body.respond(start, move, True)
    if response.failed_point >= 0:
        return 0.0
    try:
        solver = factorise(body.free_block.matrix(response.values))
    except RuntimeError:
        return 0.0
    # A fixed start with all shapes in it: smooth plus a deterministic ripple.
    vector = 1.0 + 0.1 * np.cos(np.arange(len(body.free)))
    vector /= np.linalg.norm(vector)
    eigenvalue = np.inf
    for _ in range(rounds):
        image = solver.solve(vector)
        size = float(np.linalg.norm(image))
        if not np.isfinite(size) or size == 0.0:
            return 0.0
        vector = image / size
        if abs(1.0 / size - eigenvalue) <= 1e-3 * eigenvalue:
            return 1.0 / size
        eigenvalue = 1.0 / size
    return eigenvalue
