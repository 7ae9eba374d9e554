"""Explicit motion of all blocks: one compiled loop that returns only to search contacts, to save or on failure."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from graben.mechanics.blocks.contact.forces import Rows, contact_forces, settle_rows
from graben.mechanics.blocks.contact.nodes import node_motion, scatter_nodes
from graben.mechanics.blocks.contact.sleeping import follow_blocks, line_up, look_again
from graben.mechanics.blocks.engine.motion import (
    AT_DAMPED,
    AT_DEEP,
    AT_FRICTION,
    AT_KINETIC,
    AT_LOAD,
    AT_OVERLAP,
    AT_PLASTIC,
    AT_WALL,
    move_blocks,
)
from graben.mechanics.blocks.engine.threads import all_there, arrive
from graben.mechanics.compiled import kernel

DONE, REBUILD, RUNAWAY, DEEP_OVERLAP, LEFT_ALONE = 0, 1, 2, 3, 4

# Places in Motion.tally
KINETIC, DAMPED, LOAD_WORK, WALL_WORK, RATE_SEEN, DAMPED_SEEN = range(6)
# Places in Motion.sums
FRICTION, LARGEST_OVERLAP, PLASTIC = range(3)
# Places in Motion.drive
DAMPING, LOAD, LOAD_STEP, SPEED, SPEED_STEP = range(5)


class Skeleton(NamedTuple):
    """What does not change while stepping: zones, contact nodes, masses, constraints and loads.

    zones : ElasticZones, or another law of motion.py; first, second, weight, follow : contact nodes
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
    """What changes: positions and velocities of vertices and of contact nodes, forces, running sums, and who sleeps.

    x, v, zone_force, joint_force, reaction : (vertices, 2); node : node table (nodes, 8); fn : (nodes, 2)
    From start on (sleeping.py): which candidates are awake, part by part, and when to look at each of them again.
    start : (parts + 1,) first candidate of each part, that of its first edge; awake ones have rows (valid while
    stepping, between `begin` and `end`), those of part p and set of joints s from turn[p, s] to turn[p, s + 1]
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
    rows: Rows
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


def private(m: Motion) -> Motion:
    """The same motion for another thread: it decides for itself, from numbers of its own."""
    return m._replace(tally=m.tally.copy(), sums=m.sums.copy(), drive=m.drive.copy(), due=m.due.copy())


@kernel(error_model="numpy")
def _press(p, m, parts, joints, deepest, dt, sums):
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
            m.rows,
            m.turn[p, k],
            m.turn[p, k + 1],
            m.node,
            joints,
            k,
            deepest,
            dt,
            fn,
            parts.node[p + 1],
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
def begin(s, m, pairs):
    """Before `advance`: node table and rows of the present state; a look is due if somebody moved nodes since."""
    x, v, node = m.x, m.v, m.node
    first, second, weight = s.first, s.second, s.weight
    for i in range(node.shape[0]):
        w = weight[i]
        for d in range(2):
            if node[i, d] != x[first[i], d] + w * (x[second[i], d] - x[first[i], d]):
                m.due[0] = 0
    node_motion(x, v, first, second, weight, s.follow, node, 0, node.shape[0])
    for p in range(m.turn.shape[0]):
        line_up(p, pairs, s.follow, m)


@kernel(error_model="numpy")
def end(m, pairs):
    """After `advance`: what the rows remember goes back to the pairs."""
    for p in range(m.turn.shape[0]):
        settle_rows(m.rows, m.turn[p, 0], m.turn[p, -1], pairs)


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
            if not column[p] > worst:
                return np.inf
            worst = column[p]
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


@kernel(error_model="numpy", nogil=True)
def advance(
    me,
    board,
    plan,
    sums,
    m,
    steps,
    s,
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
):
    """Up to `steps` steps of `dt` [s] on the parts of thread `me`. Returns (status, steps done, pair concerned).

    board, plan : as in threads.py; sums : (2, parts, motion.COLUMNS) work space shared by all threads
    m, s, parts : Motion, Skeleton, Parts; joints : table of sets of joints; dilation : largest tangent among them.
    Threads share all arrays of m but tally, sums, drive and due: each takes the same decisions from its own.
    skin, near : reach of the candidates and of the awake ones [m]; deepest : overlap limit [m]
    damping_ratio : adaptive global damping holds its power at this ratio to the rate of kinetic energy; below 0
    the damping coefficient in motion.drive stays as it is; damping_limit : its upper bound [1/s]
    local : share of the unbalanced force taken off against the velocity
    fastest : kinetic energy that stops the run [J/m]
    """
    first = plan.first[me]
    stop = plan.first[me + 1]
    pushes, pushed = plan.pushes, plan.pushed
    turn = 0
    for step in range(steps):
        if m.due[0] <= 0:
            for p in range(first, stop):
                follow_blocks(p, parts, m.node, near, m)
            turn += 1
            arrive(board, me, turn)
            if not all_there(board, turn):
                return LEFT_ALONE, step, -1
            if not _worst(m.farthest[:, 0]) < (0.5 * skin) ** 2:
                return REBUILD, step, -1
            for p in range(first, stop):
                look_again(p, parts, pairs, s.follow, m.node, near, dilation, m)
            m.due[0] = _next_look(m, near, dt)
        m.due[0] -= 1
        load, speed, alpha = _next_drive(m)
        # Others may still read the sums of the step before.
        now = sums[step % 2]
        for p in range(first, stop):
            if pushes[p] == 1:
                _press(p, m, parts, joints, deepest, dt, now)
        turn += 1
        arrive(board, me, turn)
        # A pair belongs to the lower of its parts: once all parts up to p are pressed, nobody reads the nodes of p
        # but other threads, and these only if they push on it.
        for p in range(first, stop):
            if pushes[p] == 0:
                _press(p, m, parts, joints, deepest, dt, now)
            if pushed[p] == 0:
                _yield_to(p, s, m, parts, load, alpha, local, dt, speed, now)
        if not all_there(board, turn):
            return LEFT_ALONE, step, -1
        for p in range(first, stop):
            if pushed[p] == 1:
                _yield_to(p, s, m, parts, load, alpha, local, dt, speed, now)
        turn += 1
        arrive(board, me, turn)
        if not all_there(board, turn):
            return LEFT_ALONE, step, -1
        bad = _deep(now)
        if bad >= 0:
            m.sums[LARGEST_OVERLAP] = now[:, AT_OVERLAP].max()
            return DEEP_OVERLAP, step, bad
        if not _gather(m, now, damping_ratio, damping_limit, alpha, dt) < fastest:
            return RUNAWAY, step, -1
    return DONE, steps, -1
