"""Internal forces and stiffness of plane-strain quads, scattered straight into the sparse value array."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.materials.laws import update


@kernel
def assemble(
    dofs: np.ndarray,
    strain_matrix: np.ndarray,
    weight: np.ndarray,
    length: np.ndarray,
    material: np.ndarray,
    law_ids: np.ndarray,
    parameters: np.ndarray,
    increment: np.ndarray,
    stress_old: np.ndarray,
    state_old: np.ndarray,
    stress: np.ndarray,
    state: np.ndarray,
    force: np.ndarray,
    slot: np.ndarray,
    values: np.ndarray,
) -> int:
    """Update every Gauss point from the last converged state; add up forces and stiffness.

    Parameters
    ----------
    dofs (e, 8): see `body.Body`; strain_matrix (e, 4, 3, 8), weight (e, 4), length (e,): `PlaneElements`
    material : (e,) row of `law_ids` (m,) and `parameters` (m, k)
    increment : (2 n,) displacement since the last converged state, m
    stress_old (e, 4, 4), state_old (e, 4, s) : converged values; stress, state : overwritten, same shapes
    force : (2 n,) overwritten with the internal forces, N/m
    slot : (e, 8, 8) from `pattern.pattern_of`; values : overwritten; an empty array skips the stiffness

    Returns
    -------
    -1, or 4 * element + point of the first Gauss point at which the law found no admissible stress
    """
    stiff = values.size > 0
    force[:] = 0.0
    values[:] = 0.0
    tangent = np.zeros((4, 4)) if stiff else np.zeros((0, 0))
    strain = np.zeros(4)
    element_force = np.zeros(8)
    element_stiffness = np.zeros((8, 8))
    product = np.zeros((3, 8))
    for e in range(dofs.shape[0]):
        m = material[e]
        element_force[:] = 0.0
        element_stiffness[:, :] = 0.0
        for g in range(4):
            b = strain_matrix[e, g]
            xx = 0.0
            yy = 0.0
            xy = 0.0
            for a in range(8):
                u = increment[dofs[e, a]]
                xx += b[0, a] * u
                yy += b[1, a] * u
                xy += b[2, a] * u
            strain[0], strain[1], strain[2], strain[3] = xx, yy, 0.0, xy
            s = stress[e, g]
            s[:] = stress_old[e, g]
            q = state[e, g]
            q[:] = state_old[e, g]
            if update(law_ids[m], strain, s, q, parameters[m], length[e], tangent) != 0:
                return 4 * e + g
            w = weight[e, g]
            for a in range(8):
                element_force[a] += w * (b[0, a] * s[0] + b[1, a] * s[1] + b[2, a] * s[3])
            if stiff:
                for a in range(8):
                    for i in range(3):
                        r = 3 if i == 2 else i
                        product[i, a] = w * (
                            tangent[r, 0] * b[0, a] + tangent[r, 1] * b[1, a] + tangent[r, 3] * b[2, a]
                        )
                for a in range(8):
                    for c in range(8):
                        element_stiffness[a, c] += (
                            b[0, a] * product[0, c] + b[1, a] * product[1, c] + b[2, a] * product[2, c]
                        )
        for a in range(8):
            force[dofs[e, a]] += element_force[a]
        if stiff:
            for a in range(8):
                for c in range(8):
                    values[slot[e, a, c]] += element_stiffness[a, c]
    return -1
