"""Penalty contact of surface nodes with a rigid sphere, Coulomb friction with its history."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.scratch.one_point import NORMAL_STORED, TANGENT_STORED, TANGENTIAL


@kernel(error_model="numpy")
def sphere_contact(
    x, step, nodes, stiffness, shear_ratio, tangent, tip, tip_step, radius, friction, force, total, ledger
):
    """Add contact forces [N] to force (n, 3) at `nodes` (c,); total (3,) becomes the force on the specimen.

    stiffness (c,) N/m; the tangential spring is shear_ratio times it; tangent (n, 3) N is the tangential force on
    each node, kept between calls, turned with the surface by projection and capped at friction times the normal
    force. tip (3,) sphere centre [m] and tip_step its last displacement. Work against the tangential springs and the
    energy stored now go to the ledger. Returns the number of nodes in contact.
    """
    for i in range(3):
        total[i] = 0.0
    stored_n, stored_t, work_t = 0.0, 0.0, 0.0
    touching = 0
    for c in range(nodes.shape[0]):
        n = nodes[c]
        rx, ry, rz = x[n, 0] - tip[0], x[n, 1] - tip[1], x[n, 2] - tip[2]
        square = rx * rx + ry * ry + rz * rz
        if square >= radius * radius or square == 0.0:
            tangent[n, 0] = tangent[n, 1] = tangent[n, 2] = 0.0
            continue
        touching += 1
        distance = np.sqrt(square)
        nx, ny, nz = rx / distance, ry / distance, rz / distance
        gap = radius - distance
        normal = stiffness[c] * gap
        kt = shear_ratio * stiffness[c]
        dx, dy, dz = step[n, 0] - tip_step[0], step[n, 1] - tip_step[1], step[n, 2] - tip_step[2]
        along = dx * nx + dy * ny + dz * nz
        dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
        tx, ty, tz = tangent[n, 0], tangent[n, 1], tangent[n, 2]
        out = tx * nx + ty * ny + tz * nz
        tx, ty, tz = tx - out * nx, ty - out * ny, tz - out * nz
        ox, oy, oz = tx, ty, tz
        tx, ty, tz = tx - kt * dx, ty - kt * dy, tz - kt * dz
        size = np.sqrt(tx * tx + ty * ty + tz * tz)
        limit = friction * normal
        if size > limit:
            scale = limit / size
            tx, ty, tz = scale * tx, scale * ty, scale * tz
            size = limit
        work_t -= 0.5 * ((ox + tx) * dx + (oy + ty) * dy + (oz + tz) * dz)
        stored_n += 0.5 * normal * gap
        if kt > 0.0:
            stored_t += 0.5 * size * size / kt
        tangent[n, 0], tangent[n, 1], tangent[n, 2] = tx, ty, tz
        fx, fy, fz = normal * nx + tx, normal * ny + ty, normal * nz + tz
        force[n, 0] += fx
        force[n, 1] += fy
        force[n, 2] += fz
        total[0] += fx
        total[1] += fy
        total[2] += fz
    ledger[TANGENTIAL] += work_t
    ledger[NORMAL_STORED] = stored_n
    ledger[TANGENT_STORED] = stored_t
    return touching
