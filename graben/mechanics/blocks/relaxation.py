"""Explicit motion of all blocks: one compiled loop that returns only to search contacts, to save or on failure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.joints import contact_forces, node_motion, scatter_nodes
from graben.mechanics.blocks.search import choose_active
from graben.mechanics.blocks.zones import zone_forces
from graben.mechanics.compiled import kernel

DONE, REBUILD, RUNAWAY, DEEP_OVERLAP = 0, 1, 2, 3

# Places in Motion.tally
KINETIC, DAMPED, LOAD_WORK, WALL_WORK, RATE_SEEN, DAMPED_SEEN = range(6)
# Places in Motion.sums (kept by the contact kernel)
FRICTION, LARGEST_OVERLAP = range(2)
# Places in Motion.drive
DAMPING, LOAD, LOAD_STEP, SPEED, SPEED_STEP = range(5)


class Skeleton(NamedTuple):
    """What does not change while stepping: zones, contact nodes, masses, constraints and loads.

    triangles, gradient, area, lam, mu : zones; first, second, weight, follow : contact nodes
    mass : (vertices,) [kg/m]; still : (k, 2) vertex and axis of prescribed velocities, wall : (vertices, 2) [m/s]
    steady, rising : (vertices, 2) forces [N/m]; the load is steady + drive[LOAD] * rising
    """

    triangles: np.ndarray
    gradient: np.ndarray
    area: np.ndarray
    lam: np.ndarray
    mu: np.ndarray
    first: np.ndarray
    second: np.ndarray
    weight: np.ndarray
    follow: np.ndarray
    mass: np.ndarray
    still: np.ndarray
    wall: np.ndarray
    steady: np.ndarray
    rising: np.ndarray


class Motion(NamedTuple):
    """What changes: positions and velocities of vertices and of contact nodes, forces, running sums.

    x, v, zone_force, joint_force, reaction : (vertices, 2); node : node table (nodes, 8); fn : (nodes, 2)
    built, chosen : (nodes, 2) node positions at the last search and at the last choice of active pairs
    """

    x: np.ndarray
    v: np.ndarray
    zone_force: np.ndarray
    joint_force: np.ndarray
    reaction: np.ndarray
    node: np.ndarray
    fn: np.ndarray
    built: np.ndarray
    chosen: np.ndarray
    active: np.ndarray
    active_count: np.ndarray
    tally: np.ndarray
    sums: np.ndarray
    drive: np.ndarray


@kernel(error_model="numpy")
def _moved(node, since):
    """Largest squared distance that a node moved."""
    largest = 0.0
    for i in range(node.shape[0]):
        dx = node[i, 0] - since[i, 0]
        dy = node[i, 1] - since[i, 1]
        d = dx * dx + dy * dy
        # Written so that a nan counts as far.
        if not d <= largest:
            largest = d
    return largest


@kernel(error_model="numpy")
def _move(x, v, mass, zone, joint, steady, rising, load, alpha, local, dt, still, wall, speed, reaction):
    """New velocities and positions; returns kinetic energy, and the powers of damping, loads and walls.

    still : (k, 2) vertex and axis of each prescribed velocity; they move freely in the first loop, which knows no
    exceptions, and are put right after it.
    """
    slow = 1.0 - 0.5 * alpha * dt
    fast = 1.0 / (1.0 + 0.5 * alpha * dt)
    kinetic = 0.0
    damped = 0.0
    load_work = 0.0
    wall_work = 0.0
    for k in range(still.shape[0]):
        i = still[k, 0]
        d = still[k, 1]
        # For now the old velocity is kept here.
        reaction[i, d] = v[i, d]
    for i in range(x.shape[0]):
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
    for k in range(still.shape[0]):
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
    return kinetic, damped, load_work, wall_work


@kernel(error_model="numpy")
def advance(
    steps, skeleton, motion, pairs, joint, dt, skin, near, deepest, damping_ratio, damping_limit, local, fastest
):
    """Up to `steps` steps of `dt` [s]. Returns (status, steps done, pair concerned).

    skin, near : reach of the candidates and of the active ones [m]; deepest : overlap limit [m]
    damping_ratio : adaptive global damping holds its power at this ratio to the rate of kinetic energy; below 0
    the damping coefficient in motion.drive stays as it is; damping_limit : its upper bound [1/s]
    local : share of the unbalanced force taken off against the velocity
    fastest : kinetic energy that stops the run [J/m]
    """
    s = skeleton
    m = motion
    x = m.x
    v = m.v
    rebuild_at = (0.5 * skin) ** 2
    choose_at = (0.5 * near) ** 2
    keep = 0.98
    check = 0
    for step in range(steps):
        node_motion(x, v, s.first, s.second, s.weight, s.follow, m.node)
        # How far nodes went is looked at every few steps; the speed cap makes that safe.
        if check == 0:
            far = _moved(m.node, m.chosen)
            if not far < choose_at:
                far = _moved(m.node, m.built)
                if not far < rebuild_at:
                    return REBUILD, step, -1
                m.active_count[0] = choose_active(pairs, s.follow, m.node, near, joint.dilation, m.active)
                m.chosen[:] = m.node[:, :2]
            check = 4
        check -= 1
        m.fn[:] = 0.0
        m.joint_force[:] = 0.0
        m.zone_force[:] = 0.0
        bad = contact_forces(
            m.active[: m.active_count[0]],
            pairs,
            s.follow,
            m.node,
            joint,
            deepest,
            dt,
            m.fn,
            m.sums,
        )
        if bad >= 0:
            return DEEP_OVERLAP, step, bad
        scatter_nodes(m.fn, s.first, s.second, s.weight, m.joint_force)
        zone_forces(x, s.triangles, s.gradient, s.area, s.lam, s.mu, m.zone_force)
        # Loads and wall speeds rise evenly within a call.
        load = m.drive[LOAD]
        m.drive[LOAD] = load + m.drive[LOAD_STEP]
        speed = m.drive[SPEED]
        m.drive[SPEED] = min(1.0, speed + m.drive[SPEED_STEP])
        alpha = m.drive[DAMPING]
        kinetic, damped, load_work, wall_work = _move(
            x,
            v,
            s.mass,
            m.zone_force,
            m.joint_force,
            s.steady,
            s.rising,
            load,
            alpha,
            local,
            dt,
            s.still,
            s.wall,
            speed,
            m.reaction,
        )
        if not kinetic < fastest:
            return RUNAWAY, step, -1
        t = m.tally
        if damping_ratio >= 0.0:
            t[RATE_SEEN] = keep * t[RATE_SEEN] + (1.0 - keep) * abs(kinetic - t[KINETIC])
            t[DAMPED_SEEN] = keep * t[DAMPED_SEEN] + (1.0 - keep) * damped * dt
            if t[DAMPED_SEEN] < damping_ratio * t[RATE_SEEN]:
                m.drive[DAMPING] = min(alpha * 1.02, damping_limit)
            else:
                m.drive[DAMPING] = max(alpha / 1.02, 1e-6 * damping_limit)
        t[KINETIC] = kinetic
        t[DAMPED] += damped * dt
        t[LOAD_WORK] += load_work * dt
        t[WALL_WORK] += wall_work * dt
    return DONE, steps, -1
