"""8-node hexahedron: trilinear shape functions, volume and mean gradient in closed form, faces, hourglass modes."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel

# Corner offsets in the order of VTK: bottom face counter-clockwise, then the top face.
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=np.int64
)
# Faces as local nodes, counter-clockwise seen from outside.
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]], dtype=np.int64)
# Hourglass base vectors of the hexahedron at its corners: xi eta, eta zeta, zeta xi, xi eta zeta.
HOURGLASS = np.array(
    [
        [1, -1, 1, -1, 1, -1, 1, -1],
        [1, 1, -1, -1, -1, -1, 1, 1],
        [1, -1, -1, 1, -1, 1, 1, -1],
        [-1, 1, -1, 1, 1, -1, 1, -1],
    ],
    dtype=np.float64,
)


@kernel(error_model="numpy")
def _corner(y2, y3, y4, y5, y6, y8, z2, z3, z4, z5, z6, z8):
    """Twelve times d volume / d x1 of a hexahedron; the names count corners from 1 (Flanagan and Belytschko)."""
    return (
        y2 * ((z6 - z3) - (z4 - z5))
        + y3 * (z2 - z4)
        + y4 * ((z3 - z8) - (z5 - z2))
        + y5 * ((z8 - z6) - (z2 - z4))
        + y6 * (z5 - z2)
        + y8 * (z4 - z5)
    )


@kernel(error_model="numpy")
def volume_gradient(xe, b):
    """Volume [m3] of a hexahedron with corners xe (8, 3), and b (8, 3) = d volume / d corner [m2].

    b / volume is the mean gradient of the shape functions, exact for any trilinear shape, so that a constant
    stress leaves no force at inner nodes (Flanagan and Belytschko 1981).
    """
    c = 1.0 / 12.0
    for i in range(3):
        j = i + 1 if i < 2 else 0
        k = j + 1 if j < 2 else 0
        y1, y2, y3, y4 = xe[0, j], xe[1, j], xe[2, j], xe[3, j]
        y5, y6, y7, y8 = xe[4, j], xe[5, j], xe[6, j], xe[7, j]
        z1, z2, z3, z4 = xe[0, k], xe[1, k], xe[2, k], xe[3, k]
        z5, z6, z7, z8 = xe[4, k], xe[5, k], xe[6, k], xe[7, k]
        # the symmetry of the hexahedron turns any corner into the first
        b[0, i] = c * _corner(y2, y3, y4, y5, y6, y8, z2, z3, z4, z5, z6, z8)
        b[1, i] = c * _corner(y3, y4, y1, y6, y7, y5, z3, z4, z1, z6, z7, z5)
        b[2, i] = c * _corner(y4, y1, y2, y7, y8, y6, z4, z1, z2, z7, z8, z6)
        b[3, i] = c * _corner(y1, y2, y3, y8, y5, y7, z1, z2, z3, z8, z5, z7)
        b[4, i] = c * _corner(y8, y7, y6, y1, y4, y2, z8, z7, z6, z1, z4, z2)
        b[5, i] = c * _corner(y5, y8, y7, y2, y1, y3, z5, z8, z7, z2, z1, z3)
        b[6, i] = c * _corner(y6, y5, y8, y3, y2, y4, z6, z5, z8, z3, z2, z4)
        b[7, i] = c * _corner(y7, y6, y5, y4, y3, y1, z7, z6, z5, z4, z3, z1)
    volume = 0.0
    for a in range(8):
        volume += b[a, 0] * xe[a, 0]
    return volume


@kernel(error_model="numpy")
def hourglass_shares(w, out):
    """Projections out (4, 3) of corner values w (8, 3) on the hourglass base vectors."""
    for i in range(3):
        d0, d1, d2, d3 = w[0, i] - w[1, i], w[2, i] - w[3, i], w[4, i] - w[5, i], w[6, i] - w[7, i]
        out[0, i] = d0 + d1 + d2 + d3
        out[1, i] = (w[0, i] + w[1, i]) - (w[2, i] + w[3, i]) - (w[4, i] + w[5, i]) + (w[6, i] + w[7, i])
        out[2, i] = d0 - d1 - d2 + d3
        out[3, i] = d2 + d3 - d0 - d1


@kernel(error_model="numpy")
def largest_face(xe):
    """Area [m2] of the largest face of a hexahedron xe (8, 3), from the diagonals of each face."""
    largest = 0.0
    for f in range(6):
        n0, n1, n2, n3 = FACES[f, 0], FACES[f, 1], FACES[f, 2], FACES[f, 3]
        ax, ay, az = xe[n2, 0] - xe[n0, 0], xe[n2, 1] - xe[n0, 1], xe[n2, 2] - xe[n0, 2]
        bx, by, bz = xe[n3, 0] - xe[n1, 0], xe[n3, 1] - xe[n1, 1], xe[n3, 2] - xe[n1, 2]
        cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        largest = max(largest, 0.5 * np.sqrt(cx * cx + cy * cy + cz * cz))
    return largest


@kernel(error_model="numpy")
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
