"""Evidence that a load cannot be exceeded: how soft the body has become in its softest direction."""

from __future__ import annotations

import numpy as np
import scipy.sparse.linalg as spla

from graben.mechanics.fem.body import Body, State
from graben.mechanics.fem.newton import factorise


def softest_stiffness(
    body: Body, state: State, increment: np.ndarray | None = None, before: State | None = None
) -> float:
    """Smallest absolute eigenvalue of the stiffness, N/m per metre, by Arnoldi's iteration on the inverse.

    Without `before`, of the stiffness that a vanishing increment meets (elastic). With `before` and
    `increment`, of the consistent tangent of that last step: it nears zero at a limit load. Returns 0 where the
    matrix is singular.
    """
    start = state if before is None else before
    move = np.zeros(body.pattern.size) if increment is None else increment
    response = body.respond(start, move, True)
    if response.failed_point >= 0:
        return 0.0
    matrix = body.free_block.matrix(response.values)
    size = len(body.free)
    if size < 8:  # too few for Arnoldi's iteration
        return float(np.abs(np.linalg.eigvals(matrix.toarray())).min())
    try:
        solver = factorise(matrix)
        inverse = spla.LinearOperator((size, size), matvec=solver.solve, dtype=np.float64)
        # A fixed start with all shapes in it, so that the number repeats.
        first = 1.0 + 0.1 * np.cos(np.arange(size))
        found = spla.eigs(matrix, k=1, sigma=0.0, OPinv=inverse, v0=first, tol=1e-4, return_eigenvectors=False)
    except (RuntimeError, spla.ArpackError):
        return 0.0
    return float(np.abs(found[0]))
