"""How the blocks of one part answer to the forces on them, by the law of their zones.

`move_blocks` is compiled for the type of Skeleton.zones alone: a scene pays for no law but its own.
"""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from graben.mechanics.blocks.zones.elastic import ElasticZones, zone_forces
from graben.mechanics.blocks.zones.plastic import PlasticZones, plastic_zone_forces
from graben.mechanics.blocks.zones.rigid import RigidBlocks, move_rigid_blocks
from graben.mechanics.compiled import kernel

# Columns of what each part adds up (one cache line a part): friction work, largest overlap, kinetic energy, powers
# of damping, loads and walls; the pair that overlaps too far; plastic work of the zones.
AT_FRICTION, AT_OVERLAP, AT_KINETIC, AT_DAMPED, AT_LOAD, AT_WALL, AT_DEEP, AT_PLASTIC = range(8)
COLUMNS = 8


@kernel(error_model="numpy")
def move_vertices(p, s, m, parts, load, alpha, local, dt, speed, sums):
    """New velocities and positions in part p; adds up kinetic energy, and the powers of damping, loads and walls.

    Vertices of prescribed velocity move freely in the first loop, which knows no exceptions, and are put right after.
    """
    x, v, mass, zone, joint, reaction = m.x, m.v, s.mass, m.zone_force, m.joint_force, m.reaction
    steady, rising, still, wall = s.steady, s.rising, s.still, s.wall
    slow = 1.0 - 0.5 * alpha * dt
    fast = 1.0 / (1.0 + 0.5 * alpha * dt)
    kinetic = 0.0
    damped = 0.0
    load_work = 0.0
    wall_work = 0.0
    for k in range(s.still_start[p], s.still_start[p + 1]):
        i = still[k, 0]
        d = still[k, 1]
        # For now the old velocity is kept here.
        reaction[i, d] = v[i, d]
    for i in range(parts.vertex[p], parts.vertex[p + 1]):
        push = dt / mass[i]
        half = 0.5 * mass[i]
        for d in range(2):
            old = v[i, d]
            applied = steady[i, d] + load * rising[i, d]
            total = zone[i, d] + joint[i, d] + applied
            if local > 0.0:
                drag = local * abs(total)
                if old < 0.0:
                    drag = -drag
                elif old == 0.0:
                    drag = 0.0
                new = (old * slow + (total - drag) * push) * fast
                damped += 0.5 * drag * (old + new)
            else:
                new = (old * slow + total * push) * fast
            mean = 0.5 * (old + new)
            damped += 2.0 * alpha * half * mean * mean
            load_work += applied * mean
            kinetic += half * new * new
            v[i, d] = new
            x[i, d] += dt * new
    for k in range(s.still_start[p], s.still_start[p + 1]):
        i = still[k, 0]
        d = still[k, 1]
        old = reaction[i, d]
        free = v[i, d]
        mean = 0.5 * (old + free)
        applied = steady[i, d] + load * rising[i, d]
        total = zone[i, d] + joint[i, d] + applied
        drag = 0.0
        if local > 0.0 and old != 0.0:
            drag = local * abs(total) if old > 0.0 else -local * abs(total)
        damped -= (alpha * mass[i] * mean + drag) * mean
        load_work -= applied * mean
        new = wall[i, d] * speed
        mean = 0.5 * (old + new)
        # A wall also carries the inertia of what it moves.
        reaction[i, d] = mass[i] * (new - old) / dt - total
        wall_work += reaction[i, d] * mean
        load_work += applied * mean
        kinetic += 0.5 * mass[i] * (new * new - free * free)
        v[i, d] = new
        x[i, d] += dt * (new - free)
    sums[p, AT_KINETIC] = kinetic
    sums[p, AT_DAMPED] = damped
    sums[p, AT_LOAD] = load_work
    sums[p, AT_WALL] = wall_work


@kernel(error_model="numpy")
def _move_elastic(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    force = m.zone_force
    for i in range(parts.vertex[p], parts.vertex[p + 1]):
        for d in range(2):
            force[i, d] = 0.0
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
    force = m.zone_force
    for i in range(parts.vertex[p], parts.vertex[p + 1]):
        for d in range(2):
            force[i, d] = 0.0
    sums[p, AT_PLASTIC] = plastic_zone_forces(m.x, zones, force, parts.zone[p], parts.zone[p + 1])
    move_vertices(p, s, m, parts, load, alpha, local, dt, speed, sums)


@kernel(error_model="numpy")
def _move_rigid(zones, p, s, m, parts, load, alpha, local, dt, speed, sums):
    begin, stop = parts.block[p], parts.block[p + 1]
    still, still_end = s.still_start[p], s.still_start[p + 1]
    kinetic, damped, load_work, wall_work = move_rigid_blocks(
        zones, begin, stop, still, still_end, s, m, load, alpha, local, dt, speed
    )
    sums[p, AT_KINETIC] = kinetic
    sums[p, AT_DAMPED] = damped
    sums[p, AT_LOAD] = load_work
    sums[p, AT_WALL] = wall_work


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
