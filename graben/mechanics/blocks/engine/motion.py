"""How the blocks of one part answer to the forces on them, by the law of their zones.

`move_blocks` is compiled for the type of Skeleton.zones alone: a scene pays for no law but its own.
"""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from graben.mechanics.blocks.engine.masses import LIGHTER, NIMBLER, WHOLE
from graben.mechanics.blocks.zones.elastic import ElasticZones, zone_forces
from graben.mechanics.blocks.zones.plastic import PlasticZones, plastic_zone_forces
from graben.mechanics.blocks.zones.rigid import RigidBlocks, move_rigid_blocks
from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span

# Columns of what each part adds up (two cache lines a part): friction work, largest overlap, kinetic energy, powers
# of damping, loads and walls; the pair that overlaps too far; plastic work of the zones; power of the rising load
# per unit of it.
AT_FRICTION, AT_OVERLAP, AT_KINETIC, AT_DAMPED, AT_LOAD, AT_WALL, AT_DEEP, AT_PLASTIC, AT_RISE = range(9)
COLUMNS = 16


@kernel(error_model="numpy")
def _resisted(total, old, local):
    """A force less its local damping, a share of it against the velocity."""
    drag = local * abs(total)
    if old > 0.0:
        return total - drag
    if old < 0.0:
        return total + drag
    return total


@kernel(error_model="numpy")
def move_vertices(p, s, m, parts, load, alpha, local, dt, speed, sums):
    """New velocities and positions in part p; adds up kinetic energy, and the powers of damping, loads and walls.

    Masses are those of `masses.Masses`: each block has a rigid part that is lighter than its vertices.
    """
    x, v, zone, joint, burdened = m.x, m.v, m.zone_force, m.joint_force, s.gains.burdened
    steady, rising, still = s.steady, s.rising, s.still
    mass, first, block, pushes, share = s.mass.vertex, s.mass.first, s.mass.block, s.gains.vertex, s.gains.block
    slow = 1.0 - 0.5 * alpha * dt
    fast = 1.0 / (1.0 + 0.5 * alpha * dt)
    kinetic, damped, load_work, wall_work, rise = 0.0, 0.0, 0.0, 0.0, 0.0
    row = s.still_start[p]
    last_row = s.still_start[p + 1]
    for b in span(parts.block[p], parts.block[p + 1]):
        begin, end = first[b], first[b + 1]
        # Most blocks bear no load: nothing of theirs is read or added.
        loaded = burdened[b] == 1
        fx, fy, moment, cx, cy = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in span(begin, end):
            tx = zone[i, 0] + joint[i, 0]
            ty = zone[i, 1] + joint[i, 1]
            if loaded:
                tx = tx + steady[i, 0] + load * rising[i, 0]
                ty = ty + steady[i, 1] + load * rising[i, 1]
            if local > 0.0:
                tx = _resisted(tx, v[i, 0], local)
                ty = _resisted(ty, v[i, 1], local)
            fx += tx
            fy += ty
            moment += x[i, 0] * ty - x[i, 1] * tx
            cx += mass[i] * x[i, 0]
            cy += mass[i] * x[i, 1]
        cx /= block[b, WHOLE]
        cy /= block[b, WHOLE]
        ax = block[b, LIGHTER] * fx * dt
        ay = block[b, LIGHTER] * fy * dt
        mine = row
        while row < last_row and still[row, 0] < end:
            row += 1
        if row > mine:
            some = _move_held(b, mine, row, s, m, load, alpha, local, dt, speed, ax, ay)
            kinetic += some[0]
            damped += some[1]
            load_work += some[2]
            wall_work += some[3]
            rise += some[4]
            continue
        spin = block[b, NIMBLER] * (moment - (cx * fy - cy * fx)) * dt
        # Sums over the block of mass x velocity and of its moment: of the mean and of the new one.
        qx, qy, qw, px, py, pw = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        square, mean_square, turn = 0.0, 0.0, 0.0
        for i in span(begin, end):
            weight, push = mass[i], pushes[i]
            old_x, old_y = v[i, 0], v[i, 1]
            at_x, at_y = x[i, 0], x[i, 1]
            rx = at_x - cx
            ry = at_y - cy
            tx = zone[i, 0] + joint[i, 0]
            ty = zone[i, 1] + joint[i, 1]
            on_x, on_y = 0.0, 0.0
            if loaded:
                on_x = steady[i, 0] + load * rising[i, 0]
                on_y = steady[i, 1] + load * rising[i, 1]
                tx = tx + on_x
                ty = ty + on_y
            free_x, free_y = tx, ty
            if local > 0.0:
                tx = _resisted(tx, old_x, local)
                ty = _resisted(ty, old_y, local)
            new_x = (old_x * slow + tx * push + ax - spin * ry) * fast
            new_y = (old_y * slow + ty * push + ay + spin * rx) * fast
            mean_x = 0.5 * (old_x + new_x)
            mean_y = 0.5 * (old_y + new_y)
            v[i, 0] = new_x
            v[i, 1] = new_y
            x[i, 0] = at_x + dt * new_x
            x[i, 1] = at_y + dt * new_y
            turn += weight * (rx * rx + ry * ry)
            square += weight * (new_x * new_x + new_y * new_y)
            mean_square += weight * (mean_x * mean_x + mean_y * mean_y)
            px += weight * new_x
            py += weight * new_y
            pw += weight * (rx * new_y - ry * new_x)
            qx += weight * mean_x
            qy += weight * mean_y
            qw += weight * (rx * mean_y - ry * mean_x)
            if local > 0.0:
                damped += (free_x - tx) * mean_x + (free_y - ty) * mean_y
            if loaded:
                load_work += on_x * mean_x + on_y * mean_y
                rise += rising[i, 0] * new_x + rising[i, 1] * new_y
        # What inertia leaves out of the rigid motion, see `masses.inertial_force`.
        less = share[b]
        less_turn = block[b, NIMBLER] / (1.0 + block[b, NIMBLER] * turn)
        kinetic += 0.5 * (square - less * (px * px + py * py) - less_turn * pw * pw)
        damped += alpha * (mean_square - less * (qx * qx + qy * qy) - less_turn * qw * qw)
    sums[p, AT_KINETIC] = kinetic
    sums[p, AT_DAMPED] = damped
    sums[p, AT_LOAD] = load_work
    sums[p, AT_WALL] = wall_work
    sums[p, AT_RISE] = rise


@kernel(error_model="numpy")
def list_burdened(s):
    """Flag the blocks with a load, steady or rising, on some vertex."""
    steady, rising, first, burdened = s.steady, s.rising, s.mass.first, s.gains.burdened
    for b in range(len(burdened)):
        burdened[b] = 0
        for i in range(first[b], first[b + 1]):
            for d in range(2):
                if steady[i, d] != 0.0 or rising[i, d] != 0.0:
                    burdened[b] = 1


@kernel(error_model="numpy")
def _is_held(still, row, last_row, i, d):
    """Whether the velocity of vertex i along axis d is among rows of still."""
    found = False
    for k in span(row, last_row):
        found |= still[k, 0] == i and still[k, 1] == d
    return found


@kernel(error_model="numpy")
def _move_held(b, row, last_row, s, m, load, alpha, local, dt, speed, ax, ay):
    """Move block b, some of whose velocities are prescribed (rows of s.still); returns what `move_vertices` adds up.

    ax, ay : what the rigid part gets beyond its vertices. Held motion is not damped. The impulses J that walls give
    along an axis lie in closed form: those of the vertices alone, less g x their sum, with g of the rigid part.
    """
    x, v, zone, joint, reaction = m.x, m.v, m.zone_force, m.joint_force, m.reaction
    steady, rising, still, wall = s.steady, s.rising, s.still, s.wall
    mass = s.mass.vertex
    begin, end = s.mass.first[b], s.mass.first[b + 1]
    light, less = s.mass.block[b, LIGHTER], s.gains.block[b]
    slow = 1.0 - 0.5 * alpha * dt
    fast = 1.0 / (1.0 + 0.5 * alpha * dt)
    kinetic, damped, load_work, wall_work, rise = 0.0, 0.0, 0.0, 0.0, 0.0
    for d in range(2):
        lift = ax if d == 0 else ay
        tied, short = 0.0, 0.0
        for i in span(begin, end):
            if _is_held(still, row, last_row, i, d):
                total = zone[i, d] + joint[i, d] + steady[i, d] + load * rising[i, d]
                if local > 0.0:
                    total = _resisted(total, v[i, d], local)
                tied += mass[i]
                short += mass[i] * (wall[i, d] * speed - (v[i, d] + (total * dt / mass[i] + lift)))
        shift = light * short / (1.0 + light * tied)
        sum_new, sum_drag, sum_mean = 0.0, 0.0, 0.0
        for i in span(begin, end):
            old = v[i, d]
            total = zone[i, d] + joint[i, d] + steady[i, d] + load * rising[i, d]
            if local > 0.0:
                total = _resisted(total, old, local)
            jump = total * dt / mass[i] + lift
            drag = 0.0
            if _is_held(still, row, last_row, i, d):
                new = wall[i, d] * speed
                # A wall also carries the inertia of what it moves.
                reaction[i, d] = mass[i] * (new - (old + jump) - shift) / dt
                wall_work += reaction[i, d] * 0.5 * (old + new)
            else:
                new = ((old * slow + jump) + shift) * fast
                drag = 0.5 * (old + new)
            mean = 0.5 * (old + new)
            applied = steady[i, d] + load * rising[i, d]
            if local > 0.0:
                total = zone[i, d] + joint[i, d] + applied
                damped += (total - _resisted(total, old, local)) * mean
            sum_new += mass[i] * new
            sum_drag += mass[i] * drag
            sum_mean += mass[i] * mean
            kinetic += 0.5 * mass[i] * new * new
            damped += alpha * mass[i] * drag * mean
            load_work += applied * mean
            rise += rising[i, d] * new
            v[i, d] = new
            x[i, d] += dt * new
        kinetic -= 0.5 * less * sum_new * sum_new
        damped -= alpha * less * sum_drag * sum_mean
    return kinetic, damped, load_work, wall_work, rise


@kernel(error_model="numpy")
def _cleared(p, m, parts):
    """Zone forces, none yet on the vertices of part p."""
    force = m.zone_force
    for i in span(parts.vertex[p], parts.vertex[p + 1]):
        for d in range(2):
            force[i, d] = 0.0
    return force


@kernel(error_model="numpy")
def _move_elastic(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    force = _cleared(p, m, parts)
    zone_forces(
        m.x,
        zones.triangles,
        zones.gradient,
        zones.area,
        zones.lam,
        zones.mu,
        force,
        parts.zone[p],
        parts.zone[p + 1],
    )
    move_vertices(p, s, m, parts, load, alpha, local, dt, speed, sums)


@kernel(error_model="numpy")
def _move_plastic(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    force = _cleared(p, m, parts)
    sums[p, AT_PLASTIC] = plastic_zone_forces(m.x, zones, force, parts.zone[p], parts.zone[p + 1])
    move_vertices(p, s, m, parts, load, alpha, local, dt, speed, sums)


@kernel(error_model="numpy")
def _move_rigid(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    begin, stop = parts.block[p], parts.block[p + 1]
    still, still_end = s.still_start[p], s.still_start[p + 1]
    kinetic, damped, load_work, wall_work, rise = move_rigid_blocks(
        zones, begin, stop, still, still_end, s, m, load, alpha, local, dt, speed
    )
    sums[p, AT_KINETIC] = kinetic
    sums[p, AT_DAMPED] = damped
    sums[p, AT_LOAD] = load_work
    sums[p, AT_WALL] = wall_work
    sums[p, AT_RISE] = rise


_LAWS = {ElasticZones: _move_elastic, PlasticZones: _move_plastic, RigidBlocks: _move_rigid}


def move_blocks(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    """Forces of the zones of part p, new velocities and positions; adds up energies in row p of sums."""
    _LAWS[type(zones)](zones, p, s, m, parts, load, alpha, local, dt, speed, sums)


@overload(move_blocks)
def _compiled_move_blocks(zones, p, s, m, parts, load, alpha, local, dt, speed, sums) -> Any:
    law = _LAWS[zones.instance_class]

    def move(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
        law(zones, p, s, m, parts, load, alpha, local, dt, speed, sums)

    return move
