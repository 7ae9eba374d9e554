"""Explicit motion of all blocks: one compiled loop that returns only to search contacts, to save or on failure."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np

from graben.mechanics.blocks.joints import contact_forces, node_motion, scatter_nodes
from graben.mechanics.blocks.moving import (
    AT_DAMPED,
    AT_DEEP,
    AT_FRICTION,
    AT_KINETIC,
    AT_LOAD,
    AT_OVERLAP,
    AT_PLASTIC,
    AT_WALL,
    COLUMNS,
    move_blocks,
)
from graben.mechanics.blocks.search import follow_blocks, look_again
from graben.mechanics.compiled import kernel

DONE, REBUILD, RUNAWAY, DEEP_OVERLAP = 0, 1, 2, 3

# Places in Motion.tally
KINETIC, DAMPED, LOAD_WORK, WALL_WORK, RATE_SEEN, DAMPED_SEEN = range(6)
# Places in Motion.sums
FRICTION, LARGEST_OVERLAP, PLASTIC = range(3)
# Places in Motion.drive
DAMPING, LOAD, LOAD_STEP, SPEED, SPEED_STEP = range(5)


class Skeleton(NamedTuple):
    """What does not change while stepping: zones, contact nodes, masses, constraints and loads.

    zones : ElasticZones, or another law of moving.py; first, second, weight, follow : contact nodes
    mass : (vertices,) [kg/m]; still : (k, 2) vertex and axis of prescribed velocities, wall : (vertices, 2) [m/s];
    still_start : (parts + 1,) where those of each part begin
    steady, rising : (vertices, 2) forces [N/m]; the load is steady + drive[LOAD] * rising
    """

    zones: Any
    first: np.ndarray
    second: np.ndarray
    weight: np.ndarray
    follow: np.ndarray
    mass: np.ndarray
    still: np.ndarray
    still_start: np.ndarray
    wall: np.ndarray
    steady: np.ndarray
    rising: np.ndarray


class Motion(NamedTuple):
    """What changes: positions and velocities of vertices and of contact nodes, forces, running sums, and the watch.

    x, v, zone_force, joint_force, reaction : (vertices, 2); node : node table (nodes, 8); fn : (nodes, 2)
    From start on, the watch: which candidates are awake, part by part, and when to look at each of them again.
    start : (parts + 1,) first candidate of each part, that of its first edge; awake ones are listed in active, those
    of part p and set of joints s from turn[p, s] to turn[p, s + 1]
    kind : (n,) what a candidate was when last looked at; wake : (n,) path [m] of its blocks at which to look again
    far_start : (parts + 1,), far_of : (n,) row of `far` (rows, 4) through which a pair hands forces on to another
    part, -1 within a part; post_start : (parts + 1,), post : (rows, 2) row and node of the forces handed to each part
    path, gone : (blocks,) bounds on the path of a block's nodes up to the reference and up to now; reference,
    built : (nodes, 2) positions then and at the search; farthest : (parts, 2) squares of distance since, and speed
    due : (1,) steps until the next look at how far nodes went
    """

    x: np.ndarray
    v: np.ndarray
    zone_force: np.ndarray
    joint_force: np.ndarray
    reaction: np.ndarray
    node: np.ndarray
    fn: np.ndarray
    tally: np.ndarray
    sums: np.ndarray
    drive: np.ndarray
    start: np.ndarray
    active: np.ndarray
    turn: np.ndarray
    kind: np.ndarray
    wake: np.ndarray
    far_start: np.ndarray
    far_of: np.ndarray
    far: np.ndarray
    post_start: np.ndarray
    post: np.ndarray
    path: np.ndarray
    gone: np.ndarray
    reference: np.ndarray
    built: np.ndarray
    farthest: np.ndarray
    due: np.ndarray


@kernel(error_model="numpy")
def _press(p, s, m, parts, pairs, joints, deepest, dt, sums):
    """Contact forces of the pairs of part p."""
    fn, far = m.fn, m.far
    for i in range(parts.node[p], parts.node[p + 1]):
        fn[i, 0] = 0.0
        fn[i, 1] = 0.0
    for r in range(m.far_start[p], m.far_start[p + 1]):
        for d in range(4):
            far[r, d] = 0.0
    own = sums[p]
    own[AT_FRICTION] = 0.0
    own[AT_OVERLAP] = 0.0
    own[AT_DEEP] = -1.0
    for k in range(m.turn.shape[1] - 1):
        bad = contact_forces(
            m.active,
            m.turn[p, k],
            m.turn[p, k + 1],
            pairs,
            s.follow,
            m.node,
            joints,
            k,
            deepest,
            dt,
            fn,
            parts.node[p + 1],
            m.far_of,
            far,
            own,
        )
        if bad >= 0:
            own[AT_DEEP] = bad


@kernel(error_model="numpy")
def _yield_to(p, s, m, parts, load, alpha, local, dt, speed, sums):
    """Everything else of a step in part p: forces on vertices, new velocities, positions and contact nodes."""
    fn, far, post, follow = m.fn, m.far, m.post, s.follow
    for k in range(m.post_start[p], m.post_start[p + 1]):
        r = post[k, 0]
        i = post[k, 1]
        j = follow[i]
        fn[i, 0] += far[r, 0]
        fn[i, 1] += far[r, 1]
        fn[j, 0] += far[r, 2]
        fn[j, 1] += far[r, 3]
    joint_force = m.joint_force
    for i in range(parts.vertex[p], parts.vertex[p + 1]):
        for d in range(2):
            joint_force[i, d] = 0.0
    begin = parts.node[p]
    end = parts.node[p + 1]
    scatter_nodes(fn, s.first, s.second, s.weight, joint_force, begin, end)
    move_blocks(s.zones, p, s, m, parts, load, alpha, local, dt, speed, sums)
    node_motion(m.x, m.v, s.first, s.second, s.weight, follow, m.node, begin, end)


@kernel(error_model="numpy")
def _begin(s, m):
    """Node table of the present positions; a look at all of them is due if somebody moved them since."""
    x, v, node = m.x, m.v, m.node
    first, second, weight = s.first, s.second, s.weight
    for i in range(node.shape[0]):
        w = weight[i]
        for d in range(2):
            if node[i, d] != x[first[i], d] + w * (x[second[i], d] - x[first[i], d]):
                m.due[0] = 0
    node_motion(x, v, first, second, weight, s.follow, node, 0, node.shape[0])


@kernel(error_model="numpy")
def _gather(m, sums, damping_ratio, damping_limit, alpha, dt):
    """Add up the parts, always in the same order; returns the kinetic energy."""
    kinetic = 0.0
    damped = 0.0
    load_work = 0.0
    wall_work = 0.0
    largest = 0.0
    for p in range(sums.shape[0]):
        m.sums[FRICTION] += sums[p, AT_FRICTION]
        m.sums[PLASTIC] += sums[p, AT_PLASTIC]
        largest = max(largest, sums[p, AT_OVERLAP])
        kinetic += sums[p, AT_KINETIC]
        damped += sums[p, AT_DAMPED]
        load_work += sums[p, AT_LOAD]
        wall_work += sums[p, AT_WALL]
    m.sums[LARGEST_OVERLAP] = largest
    t = m.tally
    if damping_ratio >= 0.0:
        keep = 0.98
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
    return kinetic


@kernel(error_model="numpy")
def _worst(column):
    """Largest entry; a nan counts as largest."""
    worst = column[0]
    for p in range(column.shape[0]):
        if not column[p] <= worst:
            return column[p] if column[p] > worst else np.inf
    return worst


@kernel(error_model="numpy")
def _deep(sums):
    """The first pair of all parts that overlaps too far, or -1."""
    for p in range(sums.shape[0]):
        if sums[p, AT_DEEP] >= 0.0:
            return int(sums[p, AT_DEEP])
    return -1


@kernel(error_model="numpy")
def _next_look(m, near, dt):
    """Steps to take before the next look: blocks may move by a quarter of `near` until then."""
    most = np.sqrt(_worst(m.farthest[:, 1])) * dt
    return int(min(16.0, max(2.0, 0.25 * near / (most + 1e-300))))


@kernel(error_model="numpy")
def _next_drive(m):
    """Load, wall speed and damping of this step; loads and wall speeds rise evenly within a call."""
    drive = m.drive
    load, speed, alpha = drive[LOAD], drive[SPEED], drive[DAMPING]
    drive[LOAD] = load + drive[LOAD_STEP]
    drive[SPEED] = min(1.0, speed + drive[SPEED_STEP])
    return load, speed, alpha


@kernel(error_model="numpy")
def advance(
    steps, s, m, parts, pairs, joints, dt, skin, near, dilation, deepest, damping_ratio, damping_limit, local, fastest
):
    """Up to `steps` steps of `dt` [s]. Returns (status, steps done, pair concerned).

    s, m, parts : Skeleton, Motion, Parts; joints : table of sets of joints; dilation : largest tangent among them
    skin, near : reach of the candidates and of the awake ones [m]; deepest : overlap limit [m]
    damping_ratio : adaptive global damping holds its power at this ratio to the rate of kinetic energy; below 0
    the damping coefficient in motion.drive stays as it is; damping_limit : its upper bound [1/s]
    local : share of the unbalanced force taken off against the velocity
    fastest : kinetic energy that stops the run [J/m]
    """
    count = parts.node.shape[0] - 1
    sums = np.zeros((count, COLUMNS))
    _begin(s, m)
    for step in range(steps):
        if m.due[0] <= 0:
            for p in range(count):
                follow_blocks(p, parts, m.node, near, m)
            if not _worst(m.farthest[:, 0]) < (0.5 * skin) ** 2:
                return REBUILD, step, -1
            for p in range(count):
                look_again(p, parts, pairs, s.follow, m.node, near, dilation, m)
            m.due[0] = _next_look(m, near, dt)
        m.due[0] -= 1
        load, speed, alpha = _next_drive(m)
        # A pair belongs to the lower of its parts: once all parts up to p are pressed, nobody reads the nodes of p.
        for p in range(count):
            _press(p, s, m, parts, pairs, joints, deepest, dt, sums)
            _yield_to(p, s, m, parts, load, alpha, local, dt, speed, sums)
        bad = _deep(sums)
        if bad >= 0:
            m.sums[LARGEST_OVERLAP] = sums[:, AT_OVERLAP].max()
            return DEEP_OVERLAP, step, bad
        if not _gather(m, sums, damping_ratio, damping_limit, alpha, dt) < fastest:
            return RUNAWAY, step, -1
    return DONE, steps, -1


@kernel(error_model="numpy")
def _share_out(m, count, shares):
    """Parts of each share, and which parts push on another share: these are pressed before anything moves."""
    share = np.empty(shares + 1, dtype=np.int64)
    for k in range(shares + 1):
        share[k] = (k * count) // shares
    of = np.empty(count, dtype=np.int64)
    for k in range(shares):
        of[share[k] : share[k + 1]] = k
    before = np.zeros(count, dtype=np.int64)
    for q in range(count):
        for k in range(m.post_start[q], m.post_start[q + 1]):
            p = np.searchsorted(m.far_start, m.post[k, 0], side="right") - 1
            if of[p] != of[q]:
                before[p] = 1
    return share, before


@kernel(error_model="numpy")
def _work_share(first, stop, before, s, m, parts, pairs, joints, deepest, dt, load, alpha, local, speed, sums):
    """The parts of one share in order, as `advance` takes all parts."""
    for p in range(first, stop):
        if before[p] == 0:
            _press(p, s, m, parts, pairs, joints, deepest, dt, sums)
        _yield_to(p, s, m, parts, load, alpha, local, dt, speed, sums)


@kernel(error_model="numpy", parallel=True)
def advance_together(
    steps,
    s,
    m,
    parts,
    pairs,
    joints,
    dt,
    skin,
    near,
    dilation,
    deepest,
    damping_ratio,
    damping_limit,
    local,
    fastest,
    threads,
):
    """`advance` with parts shared out to threads: the same result, bit for bit."""
    count = parts.node.shape[0] - 1
    sums = np.zeros((count, COLUMNS))
    shares = min(count, threads)
    share, before = _share_out(m, count, shares)
    _begin(s, m)
    for step in range(steps):
        if m.due[0] <= 0:
            for p in numba.prange(count):
                follow_blocks(p, parts, m.node, near, m)
            if not _worst(m.farthest[:, 0]) < (0.5 * skin) ** 2:
                return REBUILD, step, -1
            for p in numba.prange(count):
                look_again(p, parts, pairs, s.follow, m.node, near, dilation, m)
            m.due[0] = _next_look(m, near, dt)
        m.due[0] -= 1
        load, speed, alpha = _next_drive(m)
        for k in numba.prange(count):
            if before[k] == 1:
                _press(k, s, m, parts, pairs, joints, deepest, dt, sums)
        for k in numba.prange(shares):
            _work_share(
                share[k],
                share[k + 1],
                before,
                s,
                m,
                parts,
                pairs,
                joints,
                deepest,
                dt,
                load,
                alpha,
                local,
                speed,
                sums,
            )
        bad = _deep(sums)
        if bad >= 0:
            m.sums[LARGEST_OVERLAP] = sums[:, AT_OVERLAP].max()
            return DEEP_OVERLAP, step, bad
        if not _gather(m, sums, damping_ratio, damping_limit, alpha, dt) < fastest:
            return RUNAWAY, step, -1
    return DONE, steps, -1
