"""Geometry of a trilinear hexahedron in closed form: volume, its gradient, faces, and the step that it allows."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel

# Node orders that map any corner of the hexahedron to corner 0 (the element's own symmetry group).
ORDER = np.array(
    [
        [0, 1, 2, 3, 4, 5, 6, 7],
        [1, 2, 3, 0, 5, 6, 7, 4],
        [2, 3, 0, 1, 6, 7, 4, 5],
        [3, 0, 1, 2, 7, 4, 5, 6],
        [4, 7, 6, 5, 0, 3, 2, 1],
        [5, 4, 7, 6, 1, 0, 3, 2],
        [6, 5, 4, 7, 2, 1, 0, 3],
        [7, 6, 5, 4, 3, 2, 1, 0],
    ],
    dtype=np.int64,
)
# Hourglass base vectors of the hexahedron: xi eta, eta zeta, zeta xi, xi eta zeta at the corners.
HOURGLASS = np.array(
    [
        [1, -1, 1, -1, 1, -1, 1, -1],
        [1, 1, -1, -1, -1, -1, 1, 1],
        [1, -1, -1, 1, -1, 1, 1, -1],
        [-1, 1, -1, 1, 1, -1, 1, -1],
    ],
    dtype=np.float64,
)
FACE_NODES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]], dtype=np.int64
)


@kernel
def volume_gradient(xe, b):
    """Volume [m3] of a hexahedron with corners xe (8, 3), and b (8, 3) = d volume / d corner [m2].

    b / volume is the mean gradient of the shape functions, exact for any trilinear shape, so that a constant
    stress leaves no force at inner nodes (Flanagan and Belytschko 1981).
    """
    for a in range(8):
        o1, o2, o3 = ORDER[a, 1], ORDER[a, 2], ORDER[a, 3]
        o4, o5, o7 = ORDER[a, 4], ORDER[a, 5], ORDER[a, 7]
        for i in range(3):
            j = i + 1 if i < 2 else 0
            k = j + 1 if j < 2 else 0
            y2, y3, y4 = xe[o1, j], xe[o2, j], xe[o3, j]
            y5, y6, y8 = xe[o4, j], xe[o5, j], xe[o7, j]
            z2, z3, z4 = xe[o1, k], xe[o2, k], xe[o3, k]
            z5, z6, z8 = xe[o4, k], xe[o5, k], xe[o7, k]
            b[a, i] = (
                y2 * ((z6 - z3) - (z4 - z5))
                + y3 * (z2 - z4)
                + y4 * ((z3 - z8) - (z5 - z2))
                + y5 * ((z8 - z6) - (z2 - z4))
                + y6 * (z5 - z2)
                + y8 * (z4 - z5)
            ) / 12.0
    volume = 0.0
    for a in range(8):
        volume += b[a, 0] * xe[a, 0]
    return volume


@kernel
def largest_face(xe):
    """Area [m2] of the largest face of a hexahedron xe (8, 3), from the diagonals of each face."""
    largest = 0.0
    for f in range(6):
        n0, n1, n2, n3 = FACE_NODES[f, 0], FACE_NODES[f, 1], FACE_NODES[f, 2], FACE_NODES[f, 3]
        ax, ay, az = xe[n2, 0] - xe[n0, 0], xe[n2, 1] - xe[n0, 1], xe[n2, 2] - xe[n0, 2]
        bx, by, bz = xe[n3, 0] - xe[n1, 0], xe[n3, 1] - xe[n1, 1], xe[n3, 2] - xe[n1, 2]
        cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        largest = max(largest, 0.5 * np.sqrt(cx * cx + cy * cy + cz * cz))
    return largest


@kernel
def shape_gradient(xe, xi, eta, zeta, g):
    """Jacobian determinant at a point of the parent cube, and g (8, 3) = d shape function / d position [1/m]."""
    jac = np.zeros((3, 3))
    local = np.empty((8, 3))
    for a in range(8):
        s = 1.0 if (a % 4) in (1, 2) else -1.0
        t = 1.0 if (a % 4) >= 2 else -1.0
        u = 1.0 if a >= 4 else -1.0
        local[a, 0] = 0.125 * s * (1.0 + t * eta) * (1.0 + u * zeta)
        local[a, 1] = 0.125 * t * (1.0 + s * xi) * (1.0 + u * zeta)
        local[a, 2] = 0.125 * u * (1.0 + s * xi) * (1.0 + t * eta)
        for i in range(3):
            for j in range(3):
                jac[i, j] += xe[a, i] * local[a, j]
    det = (
        jac[0, 0] * (jac[1, 1] * jac[2, 2] - jac[1, 2] * jac[2, 1])
        - jac[0, 1] * (jac[1, 0] * jac[2, 2] - jac[1, 2] * jac[2, 0])
        + jac[0, 2] * (jac[1, 0] * jac[2, 1] - jac[1, 1] * jac[2, 0])
    )
    inverse = np.empty((3, 3))
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = (jac[i1, j1] * jac[i2, j2] - jac[i1, j2] * jac[i2, j1]) / det
    for a in range(8):
        for i in range(3):
            g[a, i] = local[a, 0] * inverse[0, i] + local[a, 1] * inverse[1, i] + local[a, 2] * inverse[2, i]
    return det
