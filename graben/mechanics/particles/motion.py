"""Walls, gravity and the leapfrog: velocity at half steps, position at full steps.

Walls, in this order: sides x = 0, x = width, y = 0, y = width (hard box only), floor, piston. The floor may move by
a prescribed harmonic; the piston is a rigid plate with mass, pushed down by a force.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.particles.contacts import rough_forces, rub, smooth_forces

FLOOR, PISTON, WALLS = 4, 5, 6
# entries of the ledger, J; losses count positive, works are those done on the particles and the piston
DASHPOTS, FRICTION, DRAG, FLOOR_WORK, PISTON_WORK, PISTON_DASHPOT, ENTRIES = 0, 1, 2, 3, 4, 5, 6
# entries of the drive: the numbers that steer floor and piston
(
    GRAVITY,
    DRAG_RATE,
    SHAKE_AMPLITUDE,
    SHAKE_OMEGA,
    SHAKE_START,
    PISTON_ON,
    PISTON_MASS,
    PISTON_DAMPING,
    PISTON_FORCE,
    PISTON_RATE,
    DRIVES,
) = range(11)
# entries of the moving scalars
TIME, PISTON_PUSH, SCALARS = 0, 1, 2


@kernel(error_model="numpy")
def move(
    x,
    v,
    spin,
    radius,
    kind,
    mass,
    wall_kn,
    wall_cn,
    wall_kt,
    wall_ct,
    wall_friction,
    rubs,
    periodic,
    dt,
    gravity,
    drag,
    piston_on,
    place,
    speed_before,
    speed_after,
    wall_slip,
    start,
    force,
    torque,
    wall_force,
    damp_sum,
    ledger,
):
    """Add wall and body forces, kick, drift; returns the largest squared distance from `start`, m2.

    place, speed_before, speed_after (6,): wall coordinates along their axis and velocities over the drifts before
    and after this kick. wall_force (6,) receives the push on each wall, N, positive.
    """
    far = 0.0
    for w in range(6):
        wall_force[w] = 0.0
        damp_sum[w] = 0.0
    lost = rubbed = dragged = floor_work = 0.0
    damp = np.zeros(3)
    first_wall = 4 if periodic else 0
    end_wall = 6 if piston_on else 5
    for i in range(x.shape[0]):
        c = kind[i]
        m, r = mass[c], radius[i]
        force[i, 2] -= m * gravity
        v0, v1, v2 = v[i, 0], v[i, 1], v[i, 2]
        damp[0] = damp[1] = damp[2] = 0.0
        for w in range(first_wall, end_wall):
            a = w // 2
            s = 1.0 if w % 2 == 0 else -1.0
            overlap = r - s * (x[i, a] - place[w])
            if overlap > 0.0:
                spring = wall_kn[c] * overlap
                total = spring - wall_cn[c] * s * (v[i, a] - speed_before[w])
                if total < 0.0:
                    total = 0.0
                force[i, a] += s * total
                wall_force[w] += total
                damp[a] += s * (total - spring)
                damp_sum[w] += s * (total - spring)
                if w == FLOOR:
                    floor_work += total * 0.5 * (speed_before[w] + speed_after[w]) * dt
                if rubs:
                    nx = ny = nz = 0.0  # from this particle to the wall
                    if a == 0:
                        nx = -s
                    elif a == 1:
                        ny = -s
                    else:
                        nz = -s
                    arm = r - overlap
                    # the wall's velocity relative to the particle's surface
                    px = -v0 - arm * (spin[i, 1] * nz - spin[i, 2] * ny)
                    py = -v1 - arm * (spin[i, 2] * nx - spin[i, 0] * nz)
                    pz = -v2 - arm * (spin[i, 0] * ny - spin[i, 1] * nx)
                    sx, sy, sz, tx, ty, tz, gone = rub(
                        nx, ny, nz, px, py, pz, wall_slip[i, w, 0], wall_slip[i, w, 1], wall_slip[i, w, 2],
                        wall_kt[c], wall_ct[c], wall_friction * total, dt,
                    )  # fmt: skip
                    rubbed += gone
                    wall_slip[i, w, 0] = sx
                    wall_slip[i, w, 1] = sy
                    wall_slip[i, w, 2] = sz
                    force[i, 0] += tx
                    force[i, 1] += ty
                    force[i, 2] += tz
                    torque[i, 0] += arm * (ny * tz - nz * ty)
                    torque[i, 1] += arm * (nz * tx - nx * tz)
                    torque[i, 2] += arm * (nx * ty - ny * tx)
            elif rubs:
                s2 = wall_slip[i, w, 0] ** 2 + wall_slip[i, w, 1] ** 2 + wall_slip[i, w, 2] ** 2
                if s2 > 0.0:
                    rubbed += 0.5 * s2 / wall_kt[c]
                    wall_slip[i, w, 0] = wall_slip[i, w, 1] = wall_slip[i, w, 2] = 0.0
        move2 = 0.0
        for a in range(3):
            old = v[i, a]
            pull = drag * m * old
            force[i, a] -= pull
            new = old + force[i, a] / m * dt
            middle = 0.5 * (old + new)
            dragged += pull * middle * dt
            lost -= damp[a] * middle * dt
            v[i, a] = new
            x[i, a] += new * dt
            move2 += (x[i, a] - start[i, a]) ** 2
        if rubs:
            inertia = 0.4 * m * r * r
            for a in range(3):
                spin[i, a] += torque[i, a] / inertia * dt
        far = max(far, move2)
    for w in range(first_wall, end_wall):  # the walls' share of the opening velocity
        lost += damp_sum[w] * 0.5 * (speed_before[w] + speed_after[w]) * dt
    ledger[DASHPOTS] += lost
    ledger[FRICTION] += rubbed
    ledger[DRAG] += dragged
    ledger[FLOOR_WORK] += floor_work
    return far


@kernel(error_model="numpy")
def advance(
    steps,
    dt,
    x,
    v,
    spin,
    radius,
    kind,
    first,
    partner,
    dash,
    slip,
    wall_slip,
    start,
    force,
    torque,
    mass,
    kn,
    cn,
    kt,
    ct,
    friction,
    wall_kn,
    wall_cn,
    wall_kt,
    wall_ct,
    wall_friction,
    rubs,
    periodic,
    width,
    drive,
    place,
    speed,
    scalars,
    skin,
    wall_force,
    ledger,
):
    """Run up to `steps` steps; stop early when a particle has moved half a skin. Returns the steps done."""
    n = x.shape[0]
    damp_sum = np.zeros(6)
    after = np.zeros(6)
    limit = 0.25 * skin * skin
    half = 0.5 * dt
    gravity, drag = drive[GRAVITY], drive[DRAG_RATE]
    piston_on = drive[PISTON_ON] > 0.0
    for step in range(steps):
        for i in range(n):
            for a in range(3):
                force[i, a] = 0.0
        if rubs:
            for i in range(n):
                for a in range(3):
                    torque[i, a] = 0.0
            lost, rubbed = rough_forces(
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
                half,
                force,
                torque,
            )
            ledger[FRICTION] += rubbed
        else:
            lost = smooth_forces(x, v, radius, kind, first, partner, dash, kn, cn, width, periodic, half, force)
        ledger[DASHPOTS] += lost
        time = scalars[TIME]
        for w in range(6):
            after[w] = speed[w]
        if drive[SHAKE_AMPLITUDE] > 0.0:
            new_place = drive[SHAKE_AMPLITUDE] * np.sin(drive[SHAKE_OMEGA] * (time + dt - drive[SHAKE_START]))
            after[FLOOR] = (new_place - place[FLOOR]) / dt
        far = move(
            x,
            v,
            spin,
            radius,
            kind,
            mass,
            wall_kn,
            wall_cn,
            wall_kt,
            wall_ct,
            wall_friction,
            rubs,
            periodic,
            dt,
            gravity,
            drag,
            piston_on,
            place,
            speed,
            after,
            wall_slip,
            start,
            force,
            torque,
            wall_force,
            damp_sum,
            ledger,
        )
        if piston_on:
            push = min(drive[PISTON_FORCE], scalars[PISTON_PUSH] + drive[PISTON_RATE] * dt)
            scalars[PISTON_PUSH] = push
            old = speed[PISTON]
            new = old + (wall_force[PISTON] - push - drive[PISTON_DAMPING] * old) / drive[PISTON_MASS] * dt
            middle = 0.5 * (old + new)
            ledger[PISTON_WORK] -= push * middle * dt
            ledger[PISTON_DASHPOT] += drive[PISTON_DAMPING] * old * middle * dt
            ledger[DASHPOTS] += (
                damp_sum[PISTON] * 0.5 * (new - old) * dt
            )  # `after` above did not know the new velocity
            after[PISTON] = new
        for w in range(6):
            speed[w] = after[w]
            place[w] += after[w] * dt
        scalars[TIME] = time + dt
        if far > limit:
            return step + 1
    return steps
