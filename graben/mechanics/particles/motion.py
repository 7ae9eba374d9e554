"""Walls, gravity and the leapfrog: velocity at half steps, position at full steps."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.particles.contacts import pair_forces, rub
from graben.mechanics.particles.dispatch import normal, shear, shear_energy
from graben.mechanics.particles.records import DASHPOTS, DRAG, FRICTION, TIME, WALL_WORK
from graben.mechanics.particles.walls import drift, mark_near, push_piston, steer


@kernel(error_model="numpy")
def move(bodies, walls, slip, near, loads, start, law, drive, dt, level, after, damp, ledger):
    """Add wall and body forces, kick, drift; returns the largest squared distance from `start`, m2.

    near (n,): from `mark_near`; level (w,) m and after (w, 3) m/s: from `steer`. damp (w,) receives what dashpots
    push on each wall, N.
    """
    x, v, spin = bodies.position, bodies.velocity, bodies.spin
    radius, mass, kind = bodies.radius, bodies.mass, bodies.kind
    facing, before, wall_kind, push = walls.normal, walls.velocity, walls.kind, walls.push
    force = loads.force
    g0, g1, g2, drag, piston = drive.gravity[0], drive.gravity[1], drive.gravity[2], drive.drag, drive.piston
    rows = level.shape[0]
    far = lost = rubbed = dragged = work = 0.0
    for w in range(rows):
        push[w] = damp[w] = 0.0
        for a in range(3):
            walls.rub[w, a] = 0.0
    on = np.zeros(3)
    for i in range(x.shape[0]):
        c, m, r = kind[i], mass[i], radius[i]
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        force[i, 0] += m * g0
        force[i, 1] += m * g1
        force[i, 2] += m * g2
        on[0] = on[1] = on[2] = 0.0
        for w in range(rows if near[i] else 0):
            n0, n1, n2 = facing[w, 0], facing[w, 1], facing[w, 2]
            overlap = r - (n0 * x0 + n1 * x1 + n2 * x2 - level[w])
            if overlap > 0.0:
                k = wall_kind[w]
                u0, u1, u2 = before[w, 0], before[w, 1], before[w, 2]
                v0, v1, v2 = v[i, 0] - u0, v[i, 1] - u1, v[i, 2] - u2
                spring, total = normal(law, c, k, overlap, v0 * n0 + v1 * n1 + v2 * n2)
                f0, f1, f2 = n0 * total, n1 * total, n2 * total
                push[w] += total
                on[0] += n0 * (total - spring)
                on[1] += n1 * (total - spring)
                on[2] += n2 * (total - spring)
                damp[w] += total - spring
                if slip is not None:
                    arm = r - overlap
                    # the wall's velocity relative to the surface of the body; 0 - n points to the wall
                    t0, t1, t2 = 0.0 - n0, 0.0 - n1, 0.0 - n2
                    p0 = -v0 - arm * (spin[i, 1] * t2 - spin[i, 2] * t1)
                    p1 = -v1 - arm * (spin[i, 2] * t0 - spin[i, 0] * t2)
                    p2 = -v2 - arm * (spin[i, 0] * t1 - spin[i, 1] * t0)
                    kt, ct, limit = shear(law, c, k, overlap, total)
                    s0, s1, s2, q0, q1, q2, gone = rub(
                        t0, t1, t2, p0, p1, p2, slip[i, w, 0], slip[i, w, 1], slip[i, w, 2], kt, ct, limit, dt
                    )
                    rubbed += gone
                    slip[i, w, 0] = s0
                    slip[i, w, 1] = s1
                    slip[i, w, 2] = s2
                    f0 += q0
                    f1 += q1
                    f2 += q2
                    walls.rub[w, 0] -= q0
                    walls.rub[w, 1] -= q1
                    walls.rub[w, 2] -= q2
                    torque = loads.torque
                    torque[i, 0] += arm * (t1 * q2 - t2 * q1)
                    torque[i, 1] += arm * (t2 * q0 - t0 * q2)
                    torque[i, 2] += arm * (t0 * q1 - t1 * q0)
                force[i, 0] += f0
                force[i, 1] += f1
                force[i, 2] += f2
                if w != piston:
                    work += (f0 * (u0 + after[w, 0]) + f1 * (u1 + after[w, 1]) + f2 * (u2 + after[w, 2])) * 0.5 * dt
            elif slip is not None:
                size2 = slip[i, w, 0] ** 2 + slip[i, w, 1] ** 2 + slip[i, w, 2] ** 2
                if size2 > 0.0:  # the spring of a contact that opened
                    rubbed += shear_energy(law, c, wall_kind[w], overlap, size2)
                    slip[i, w, 0] = slip[i, w, 1] = slip[i, w, 2] = 0.0
        move2 = 0.0
        for a in range(3):
            old = v[i, a]
            pull = drag * m * old
            force[i, a] -= pull
            new = old + force[i, a] / m * dt
            middle = 0.5 * (old + new)
            dragged += pull * middle * dt
            lost -= on[a] * middle * dt
            v[i, a] = new
            x[i, a] += new * dt
            move2 += (x[i, a] - start[i, a]) ** 2
        if slip is not None:
            inertia = 0.4 * m * r * r
            for a in range(3):
                spin[i, a] += loads.torque[i, a] / inertia * dt
        far = max(far, move2)
    for w in range(rows):  # the walls' share of the opening velocity
        opening = 0.0
        for a in range(3):
            opening += facing[w, a] * (before[w, a] + after[w, a])
        lost += damp[w] * 0.5 * opening * dt
    ledger[DASHPOTS] += lost
    ledger[FRICTION] += rubbed
    ledger[DRAG] += dragged
    ledger[WALL_WORK] += work
    return far


@kernel(error_model="numpy")
def advance(steps, dt, bodies, contacts, walls, loads, laws, drive, clock, ledger, period):
    """Run up to `steps` steps; stop early when a body has moved half a skin. Returns the steps done."""
    rows = walls.push.shape[0]
    level, damp, after = np.empty(rows), np.empty(rows), np.empty((rows, 3))
    skin = contacts.skin
    limit = 0.25 * skin * skin
    near = np.empty(bodies.mass.shape[0], np.bool_)
    closed = np.inf  # way of the walls since bodies near them were marked, m
    for step in range(steps):
        lost, rubbed = pair_forces(bodies, contacts, contacts.slip, loads, laws.pairs, period, dt)
        ledger[FRICTION] += rubbed
        ledger[DASHPOTS] += lost
        steer(walls, drive, clock, dt, level, after)
        if not closed <= 0.5 * skin:  # bodies move by less than a skin: half on either side of `start`
            mark_near(bodies, walls, walls.slip, 1.5 * skin, near)
            closed = 0.0
        far = move(
            bodies, walls, walls.slip, near, loads, contacts.start, laws.walls, drive, dt, level, after, damp, ledger
        )
        if drive.piston >= 0:
            push_piston(walls, drive, clock, dt, damp, after, ledger)
        closed += drift(walls, after, dt)
        clock[TIME] += dt
        if far > limit:
            return step + 1
    return steps
