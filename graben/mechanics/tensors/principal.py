"""Principal values of a stress given by components, and the way back for stress and tangent.

An isotropic law needs to be written only in principal values sorted from largest to smallest (most tensile first):
its tangent there is a full 3 x 3 block and three shear moduli, which `back_*` turns to the axes of the
components. The block is handed over in tangent[:3, :3], so nothing is allocated.

Plane components are (xx, yy, zz, xy): zz is principal, the plane needs one rotation. Space components are
(xx, yy, zz, xy, yz, zx): cyclic Jacobi.
"""

from __future__ import annotations

import math

import numpy as np

from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def split_plane(xx, yy, zz, xy):
    """Sorted principal values s1 >= s2 >= s3, cosine and sine of the first in-plane axis, and the rank of zz."""
    half = 0.5 * (xx - yy)
    mean = 0.5 * (xx + yy)
    if xy == 0.0:
        c, s = (1.0, 0.0) if half >= 0.0 else (0.0, 1.0)
        radius = abs(half)
    else:
        radius = math.hypot(half, xy)
        # the larger of c and s is taken from the sum that does not cancel
        if half >= 0.0:
            c = math.sqrt(0.5 * (1.0 + half / radius))
            s = 0.5 * xy / (radius * c)
        else:
            s = math.sqrt(0.5 * (1.0 - half / radius))
            c = 0.5 * xy / (radius * s)
    a, b = mean + radius, mean - radius
    if zz >= a:
        return zz, a, b, c, s, 0
    if zz >= b:
        return a, zz, b, c, s, 1
    return a, b, zz, c, s, 2


@kernel(error_model="numpy")
def back_plane_stress(s1, s2, s3, c, s, rank, sig):
    """Write sorted principal values back to components (xx, yy, zz, xy) of sig."""
    if rank == 0:
        a, b, z = s2, s3, s1
    elif rank == 1:
        a, b, z = s1, s3, s2
    else:
        a, b, z = s1, s2, s3
    sig[0] = c * c * a + s * s * b
    sig[1] = s * s * a + c * c * b
    sig[2] = z
    sig[3] = c * s * (a - b)


@kernel(error_model="numpy")
def back_plane_tangent(c, s, rank, g12, g13, g23, tangent):
    """Turn the sorted principal block in tangent[:3, :3] and shear moduli g_ij into the (4, 4) tangent, in place."""
    if rank == 0:
        i, j, k, g = 1, 2, 0, g23
    elif rank == 1:
        i, j, k, g = 0, 2, 1, g13
    else:
        i, j, k, g = 0, 1, 2, g12
    aa, ab, az = tangent[i, i], tangent[i, j], tangent[i, k]
    ba, bb, bz = tangent[j, i], tangent[j, j], tangent[j, k]
    za, zb, zz = tangent[k, i], tangent[k, j], tangent[k, k]
    if s == 0.0 or c == 0.0:
        if c == 0.0:
            aa, bb, ab, ba = bb, aa, ba, ab
            az, bz, za, zb = bz, az, zb, za
        tangent[0, 0], tangent[0, 1], tangent[0, 2], tangent[0, 3] = aa, ab, az, 0.0
        tangent[1, 0], tangent[1, 1], tangent[1, 2], tangent[1, 3] = ba, bb, bz, 0.0
        tangent[2, 0], tangent[2, 1], tangent[2, 2], tangent[2, 3] = za, zb, zz, 0.0
        tangent[3, 0], tangent[3, 1], tangent[3, 2], tangent[3, 3] = 0.0, 0.0, 0.0, g
        return
    cc, ss, cs = c * c, s * s, c * s
    # strain along the axes a, b, a-b from components: rows of the rotation; tangent = R^T T R
    rows = (
        (cc, ss, 0.0, cs),
        (ss, cc, 0.0, -cs),
        (0.0, 0.0, 1.0, 0.0),
        (-2.0 * cs, 2.0 * cs, 0.0, cc - ss),
    )
    for q in range(4):
        a, b, z, w = rows[0][q], rows[1][q], rows[2][q], rows[3][q]
        va = aa * a + ab * b + az * z
        vb = ba * a + bb * b + bz * z
        vz = za * a + zb * b + zz * z
        vw = g * w
        tangent[0, q] = cc * va + ss * vb - 2.0 * cs * vw
        tangent[1, q] = ss * va + cc * vb + 2.0 * cs * vw
        tangent[2, q] = vz
        tangent[3, q] = cs * (va - vb) + (cc - ss) * vw


@kernel(error_model="numpy")
def split_space(sig, vectors):
    """Sorted principal values of (xx, yy, zz, xy, yz, zx); vectors (3, 3) gets the axes as columns."""
    a = np.empty((3, 3))
    a[0, 0], a[1, 1], a[2, 2] = sig[0], sig[1], sig[2]
    a[0, 1] = a[1, 0] = sig[3]
    a[1, 2] = a[2, 1] = sig[4]
    a[0, 2] = a[2, 0] = sig[5]
    vectors[:, :] = 0.0
    for i in range(3):
        vectors[i, i] = 1.0
    size = 0.0
    for i in range(6):
        size += abs(sig[i])
    for _sweep in range(30):
        off = abs(a[0, 1]) + abs(a[1, 2]) + abs(a[0, 2])
        if off <= 1e-16 * size:
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                ratio = 0.5 * (a[q, q] - a[p, p]) / a[p, q]
                if abs(ratio) > 1e150:
                    t = 0.5 / ratio
                else:
                    t = 1.0 / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
                    if ratio < 0.0:
                        t = -t
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = t * c
                for k in range(3):
                    u, v = a[k, p], a[k, q]
                    a[k, p] = c * u - s * v
                    a[k, q] = s * u + c * v
                for k in range(3):
                    u, v = a[p, k], a[q, k]
                    a[p, k] = c * u - s * v
                    a[q, k] = s * u + c * v
                a[p, q] = a[q, p] = 0.0
                for k in range(3):
                    u, v = vectors[k, p], vectors[k, q]
                    vectors[k, p] = c * u - s * v
                    vectors[k, q] = s * u + c * v
    for i in range(2):  # sort, largest first
        for j in range(2 - i):
            if a[j, j] < a[j + 1, j + 1]:
                a[j, j], a[j + 1, j + 1] = a[j + 1, j + 1], a[j, j]
                for k in range(3):
                    vectors[k, j], vectors[k, j + 1] = vectors[k, j + 1], vectors[k, j]
    return a[0, 0], a[1, 1], a[2, 2]


@kernel(error_model="numpy")
def back_space_stress(s1, s2, s3, vectors, sig):
    """Write sorted principal values back to the six components of sig."""
    for m in range(6):
        i = m if m < 3 else m - 3
        j = i if m < 3 else (i + 1) % 3
        sig[m] = (
            s1 * vectors[i, 0] * vectors[j, 0]
            + s2 * vectors[i, 1] * vectors[j, 1]
            + s3 * vectors[i, 2] * vectors[j, 2]
        )


@kernel(error_model="numpy")
def back_space_tangent(vectors, g12, g13, g23, tangent):
    """Turn the sorted principal block in tangent[:3, :3] and shear moduli g_ij into the (6, 6) tangent, in place."""
    rotation = np.empty((6, 6))
    for m in range(6):
        i = m if m < 3 else m - 3
        j = i if m < 3 else (i + 1) % 3
        for q in range(6):
            k = q if q < 3 else q - 3
            l = k if q < 3 else (k + 1) % 3
            if m < 3:
                # normal strain along axis m; an engineering shear q enters once
                rotation[m, q] = vectors[k, m] * vectors[l, m]
            else:
                value = vectors[k, i] * vectors[l, j] + vectors[l, i] * vectors[k, j]
                rotation[m, q] = value if q >= 3 else 2.0 * vectors[k, i] * vectors[k, j]
    local = np.zeros((6, 6))
    for i in range(3):
        for j in range(3):
            local[i, j] = tangent[i, j]
    local[3, 3], local[4, 4], local[5, 5] = g12, g23, g13
    for i in range(6):
        for j in range(6):
            total = 0.0
            for m in range(6):
                if m < 3:
                    for q in range(3):
                        total += rotation[m, i] * local[m, q] * rotation[q, j]
                else:
                    total += rotation[m, i] * local[m, m] * rotation[m, j]
            tangent[i, j] = total


@kernel(error_model="numpy")
def shear_modulus(stress_i, stress_j, trial_i, trial_j, t_ii, t_ij, scale, shear):
    """Tangent shear modulus between two principal axes: shear (s_i - s_j) / (trial_i - trial_j), or its limit.

    t_ii, t_ij: entries of the principal block; scale: a stress to tell equal from different; shear: elastic modulus.
    """
    gap = trial_i - trial_j
    if abs(gap) > 1e-9 * scale:
        return shear * (stress_i - stress_j) / gap
    return 0.5 * (t_ii - t_ij)
