"""Forces between spheres: H (4.1)-(4.8) with dashpots H (4.9)-(4.10), one kernel without and one with friction.

The dashpot never pulls: normal force = max(0, K U + c dU/dt). The work of the dashpots is accounted with the mean of
the velocities before and after each kick, which is exact for the leapfrog; hence `dash`, the dashpot force of the
last step, per pair.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def smooth_forces(x, v, radius, kind, first, partner, dash, kn, cn, width, periodic, half_dt, force):
    """Add frictionless contact forces to force (n, 3); return the energy taken by the dashpots, J."""
    lost = 0.0
    wx, wy = width[0], width[1]
    hx, hy = 0.5 * wx, 0.5 * wy
    for i in range(x.shape[0]):
        xi, yi, zi = x[i, 0], x[i, 1], x[i, 2]
        ui, vi, wi = v[i, 0], v[i, 1], v[i, 2]
        ri, ci = radius[i], kind[i]
        fx = fy = fz = 0.0
        for k in range(first[i], first[i + 1]):
            j = partner[k]
            gx, gy, gz = x[j, 0] - xi, x[j, 1] - yi, x[j, 2] - zi
            if periodic:
                if gx > hx:
                    gx -= wx
                elif gx < -hx:
                    gx += wx
                if gy > hy:
                    gy -= wy
                elif gy < -hy:
                    gy += wy
            d2 = gx * gx + gy * gy + gz * gz
            rr = ri + radius[j]
            if d2 < rr * rr:
                d = np.sqrt(d2)
                inv = 1.0 / d
                gx *= inv
                gy *= inv
                gz *= inv
                opening = (v[j, 0] - ui) * gx + (v[j, 1] - vi) * gy + (v[j, 2] - wi) * gz
                spring = kn[ci, kind[j]] * (rr - d)
                total = spring - cn[ci, kind[j]] * opening
                if total < 0.0:
                    total = 0.0
                damp = total - spring
                lost -= half_dt * (dash[k] + damp) * opening
                dash[k] = damp
                fx -= total * gx
                fy -= total * gy
                fz -= total * gz
                force[j, 0] += total * gx
                force[j, 1] += total * gy
                force[j, 2] += total * gz
            elif dash[k] != 0.0:
                inv = 1.0 / np.sqrt(d2)
                opening = ((v[j, 0] - ui) * gx + (v[j, 1] - vi) * gy + (v[j, 2] - wi) * gz) * inv
                lost -= half_dt * dash[k] * opening
                dash[k] = 0.0
        force[i, 0] += fx
        force[i, 1] += fy
        force[i, 2] += fz
    return lost


@kernel(error_model="numpy")
def close_ledger(x, v, first, partner, dash, width, periodic, half_dt):
    """Account the second half of the last dashpot work and forget it (before a list is rebuilt); returns J."""
    lost = 0.0
    for i in range(x.shape[0]):
        for k in range(first[i], first[i + 1]):
            if dash[k] != 0.0:
                j = partner[k]
                d2 = 0.0
                opening = 0.0
                for a in range(3):
                    g = x[j, a] - x[i, a]
                    if periodic and a < 2:
                        if g > 0.5 * width[a]:
                            g -= width[a]
                        elif g < -0.5 * width[a]:
                            g += width[a]
                    d2 += g * g
                    opening += g * (v[j, a] - v[i, a])
                lost -= half_dt * dash[k] * opening / np.sqrt(d2)
                dash[k] = 0.0
    return lost


@kernel(error_model="numpy")
def rub(nx, ny, nz, px, py, pz, sx, sy, sz, kt, ct, limit, dt):
    """One tangential spring with Coulomb limit H (4.7)-(4.8) and dashpot.

    n: unit normal; p: velocity of the other body relative to this one at the contact; s: spring force on this body
    before the step. Returns spring force (3), total tangential force (3) on this body and the energy taken, J.
    """
    pn = px * nx + py * ny + pz * nz
    px -= pn * nx
    py -= pn * ny
    pz -= pn * nz
    # the stored force turns with the contact plane and keeps its size
    before2 = sx * sx + sy * sy + sz * sz
    if before2 > 0.0:
        sn = sx * nx + sy * ny + sz * nz
        sx -= sn * nx
        sy -= sn * ny
        sz -= sn * nz
        after2 = sx * sx + sy * sy + sz * sz
        if after2 > 0.0:
            scale = np.sqrt(before2 / after2)
            sx *= scale
            sy *= scale
            sz *= scale
    ox, oy, oz = sx, sy, sz
    sx += kt * px * dt
    sy += kt * py * dt
    sz += kt * pz * dt
    size2 = sx * sx + sy * sy + sz * sz
    if size2 > limit * limit:
        scale = limit / np.sqrt(size2)
        sx *= scale
        sy *= scale
        sz *= scale
        # work of the leapfrog (mean of old and new force) less what the spring kept
        work = 0.5 * ((ox + sx) * px + (oy + sy) * py + (oz + sz) * pz) * dt
        lost = work - 0.5 * (limit * limit - before2) / kt
        return sx, sy, sz, sx, sy, sz, lost
    tx, ty, tz = sx + ct * px, sy + ct * py, sz + ct * pz
    total2 = tx * tx + ty * ty + tz * tz
    if total2 > limit * limit:  # the dashpot may not carry more than friction allows
        scale = limit / np.sqrt(total2)
        tx *= scale
        ty *= scale
        tz *= scale
    lost = ((tx - sx) * px + (ty - sy) * py + (tz - sz) * pz) * dt
    return sx, sy, sz, tx, ty, tz, lost


@kernel(error_model="numpy")
def rough_forces(
    x,
    v,
    spin,
    radius,
    kind,
    first,
    partner,
    dash,
    slip,
    kn,
    cn,
    kt,
    ct,
    friction,
    width,
    periodic,
    half_dt,
    force,
    torque,
):
    """Add contact forces (n, 3) and torques (n, 3) with friction; slip (pairs, 3) holds the tangential springs.

    Returns the energies taken by the normal dashpots and by friction with the tangential dashpots, J.
    """
    lost = 0.0
    rubbed = 0.0
    dt = 2.0 * half_dt
    wx, wy = width[0], width[1]
    hx, hy = 0.5 * wx, 0.5 * wy
    for i in range(x.shape[0]):
        xi, yi, zi = x[i, 0], x[i, 1], x[i, 2]
        ui, vi, wi = v[i, 0], v[i, 1], v[i, 2]
        pi, qi, si = spin[i, 0], spin[i, 1], spin[i, 2]
        ri, ci = radius[i], kind[i]
        sumx = sumy = sumz = turnx = turny = turnz = 0.0
        for k in range(first[i], first[i + 1]):
            j = partner[k]
            gx, gy, gz = x[j, 0] - xi, x[j, 1] - yi, x[j, 2] - zi
            if periodic:
                if gx > hx:
                    gx -= wx
                elif gx < -hx:
                    gx += wx
                if gy > hy:
                    gy -= wy
                elif gy < -hy:
                    gy += wy
            d2 = gx * gx + gy * gy + gz * gz
            rj = radius[j]
            rr = ri + rj
            if d2 < rr * rr:
                cj = kind[j]
                d = np.sqrt(d2)
                inv = 1.0 / d
                gx *= inv
                gy *= inv
                gz *= inv
                px, py, pz = v[j, 0] - ui, v[j, 1] - vi, v[j, 2] - wi
                opening = px * gx + py * gy + pz * gz
                overlap = rr - d
                spring = kn[ci, cj] * overlap
                total = spring - cn[ci, cj] * opening
                if total < 0.0:
                    total = 0.0
                damp = total - spring
                lost -= half_dt * (dash[k] + damp) * opening
                dash[k] = damp
                # lever arms to the contact point H (4.4)
                ai, aj = ri - 0.5 * overlap, rj - 0.5 * overlap
                ox = ai * pi + aj * spin[j, 0]
                oy = ai * qi + aj * spin[j, 1]
                oz = ai * si + aj * spin[j, 2]
                px -= oy * gz - oz * gy
                py -= oz * gx - ox * gz
                pz -= ox * gy - oy * gx
                sx, sy, sz, tx, ty, tz, gone = rub(
                    gx, gy, gz, px, py, pz, slip[k, 0], slip[k, 1], slip[k, 2], kt[ci, cj], ct[ci, cj],
                    friction * total, dt,
                )  # fmt: skip
                rubbed += gone
                slip[k, 0] = sx
                slip[k, 1] = sy
                slip[k, 2] = sz
                fx, fy, fz = tx - total * gx, ty - total * gy, tz - total * gz
                sumx += fx
                sumy += fy
                sumz += fz
                force[j, 0] -= fx
                force[j, 1] -= fy
                force[j, 2] -= fz
                mx, my, mz = gy * tz - gz * ty, gz * tx - gx * tz, gx * ty - gy * tx
                turnx += ai * mx
                turny += ai * my
                turnz += ai * mz
                torque[j, 0] += aj * mx
                torque[j, 1] += aj * my
                torque[j, 2] += aj * mz
            else:
                if dash[k] != 0.0:
                    opening = (v[j, 0] - ui) * gx + (v[j, 1] - vi) * gy + (v[j, 2] - wi) * gz
                    lost -= half_dt * dash[k] * opening / np.sqrt(d2)
                    dash[k] = 0.0
                s2 = slip[k, 0] ** 2 + slip[k, 1] ** 2 + slip[k, 2] ** 2
                if s2 > 0.0:  # the spring of a contact that opened
                    rubbed += 0.5 * s2 / kt[ci, kind[j]]
                    slip[k, 0] = slip[k, 1] = slip[k, 2] = 0.0
        force[i, 0] += sumx
        force[i, 1] += sumy
        force[i, 2] += sumz
        torque[i, 0] += turnx
        torque[i, 1] += turny
        torque[i, 2] += turnz
    return lost, rubbed
