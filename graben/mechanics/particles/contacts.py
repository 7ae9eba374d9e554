"""Forces between spheres: H (4.1)-(4.8) with dashpots H (4.9)-(4.10), one loop over all pairs.

The work of the normal dashpots is accounted with the mean of the velocities before and after each kick, which is
exact for the leapfrog; hence `dash`, the dashpot force of the last step, per pair.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.particles.dispatch import normal, shear, shear_energy


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
def pair_forces(bodies, contacts, slip, loads, law, period, dt):
    """Set force and torque of `loads` to the sums over pairs, and go on with dash and slip of `contacts`.

    slip (pairs, 3) or None without friction; period (2,) m of the sides or None; law: table of a type in
    `dispatch.LAWS`. Returns the energies taken by the normal dashpots and by friction with the tangential ones, J.
    """
    x, v, spin, radius, kind = bodies.position, bodies.velocity, bodies.spin, bodies.radius, bodies.kind
    first, partner, dash, force = contacts.first, contacts.partner, contacts.dash, loads.force
    for i in range(x.shape[0]):
        for a in range(3):
            force[i, a] = 0.0
    if slip is not None:
        torque = loads.torque
        for i in range(x.shape[0]):
            for a in range(3):
                torque[i, a] = 0.0
    if period is not None:
        wx, wy = period[0], period[1]
        hx, hy = 0.5 * wx, 0.5 * wy
    half = 0.5 * dt
    lost = rubbed = 0.0
    for i in range(x.shape[0]):
        xi, yi, zi = x[i, 0], x[i, 1], x[i, 2]
        ui, vi, wi = v[i, 0], v[i, 1], v[i, 2]
        ri, ci = radius[i], kind[i]
        sumx = sumy = sumz = 0.0
        if slip is not None:
            pi, qi, si = spin[i, 0], spin[i, 1], spin[i, 2]
            turnx = turny = turnz = 0.0
        for k in range(first[i], first[i + 1]):
            j = partner[k]
            gx, gy, gz = x[j, 0] - xi, x[j, 1] - yi, x[j, 2] - zi
            if period is not None:
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
                spring, total = normal(law, ci, cj, overlap, opening)
                damp = total - spring
                lost -= half * (dash[k] + damp) * opening
                dash[k] = damp
                fx, fy, fz = -total * gx, -total * gy, -total * gz
                if slip is not None:
                    # lever arms to the contact point H (4.4)
                    ai, aj = ri - 0.5 * overlap, rj - 0.5 * overlap
                    ox = ai * pi + aj * spin[j, 0]
                    oy = ai * qi + aj * spin[j, 1]
                    oz = ai * si + aj * spin[j, 2]
                    px -= oy * gz - oz * gy
                    py -= oz * gx - ox * gz
                    pz -= ox * gy - oy * gx
                    kt, ct, limit = shear(law, ci, cj, overlap, total)
                    sx, sy, sz, tx, ty, tz, gone = rub(
                        gx, gy, gz, px, py, pz, slip[k, 0], slip[k, 1], slip[k, 2], kt, ct, limit, dt
                    )
                    rubbed += gone
                    slip[k, 0] = sx
                    slip[k, 1] = sy
                    slip[k, 2] = sz
                    fx += tx
                    fy += ty
                    fz += tz
                    mx, my, mz = gy * tz - gz * ty, gz * tx - gx * tz, gx * ty - gy * tx
                    turnx += ai * mx
                    turny += ai * my
                    turnz += ai * mz
                    torque[j, 0] += aj * mx
                    torque[j, 1] += aj * my
                    torque[j, 2] += aj * mz
                sumx += fx
                sumy += fy
                sumz += fz
                force[j, 0] -= fx
                force[j, 1] -= fy
                force[j, 2] -= fz
            else:
                if dash[k] != 0.0:
                    opening = (v[j, 0] - ui) * gx + (v[j, 1] - vi) * gy + (v[j, 2] - wi) * gz
                    lost -= half * dash[k] * opening / np.sqrt(d2)
                    dash[k] = 0.0
                if slip is not None:
                    size2 = slip[k, 0] ** 2 + slip[k, 1] ** 2 + slip[k, 2] ** 2
                    if size2 > 0.0:  # the spring of a contact that opened
                        rubbed += shear_energy(law, ci, kind[j], rr - np.sqrt(d2), size2)
                        slip[k, 0] = slip[k, 1] = slip[k, 2] = 0.0
        force[i, 0] += sumx
        force[i, 1] += sumy
        force[i, 2] += sumz
        if slip is not None:
            torque[i, 0] += turnx
            torque[i, 1] += turny
            torque[i, 2] += turnz
    return lost, rubbed


@kernel(error_model="numpy")
def close_ledger(bodies, contacts, period, half_dt):
    """Account the second half of the last dashpot work and forget it (before a list is rebuilt); returns J."""
    x, v, first, partner, dash = bodies.position, bodies.velocity, contacts.first, contacts.partner, contacts.dash
    lost = 0.0
    for i in range(x.shape[0]):
        for k in range(first[i], first[i + 1]):
            if dash[k] != 0.0:
                j = partner[k]
                d2 = 0.0
                opening = 0.0
                for a in range(3):
                    g = x[j, a] - x[i, a]
                    if period is not None:  # noqa: SIM102  (numba drops a branch on this alone)
                        if a < 2:
                            if g > 0.5 * period[a]:
                                g -= period[a]
                            elif g < -0.5 * period[a]:
                                g += period[a]
                    d2 += g * g
                    opening += g * (v[j, a] - v[i, a])
                lost -= half_dt * dash[k] * opening / np.sqrt(d2)
                dash[k] = 0.0
    return lost
