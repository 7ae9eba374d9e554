"""Explicit motion of all blocks: one compiled loop that returns only to search contacts, to save or on failure."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.forces import contact_forces, settle_rows
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
    AT_RISE,
    AT_WALL,
    list_burdened,
    move_blocks,
)
from graben.mechanics.blocks.engine.records import (
    BRAKE,
    DAMPED,
    DAMPED_SEEN,
    DAMPING,
    FRICTION,
    KINETIC,
    LARGEST_OVERLAP,
    LOAD,
    LOAD_STEP,
    LOAD_WORK,
    PLASTIC,
    RATE_SEEN,
    SPEED,
    SPEED_STEP,
    WALL_WORK,
    WAY,
)
from graben.mechanics.blocks.engine.threads import all_there, arrive
from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span

DONE, REBUILD, RUNAWAY, DEEP_OVERLAP, LEFT_ALONE = 0, 1, 2, 3, 4


@kernel(error_model="numpy")
def _press(p, m, parts, joints, deepest, dt, sums):
    """Contact forces of the pairs of part p."""
    fn, far = m.fn, m.far
    for i in span(parts.node[p], parts.node[p + 1]):
        fn[i, 0] = 0.0
        fn[i, 1] = 0.0
    for r in span(m.far_start[p], m.far_start[p + 1]):
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
    for i in span(parts.vertex[p], parts.vertex[p + 1]):
        for d in range(2):
            joint_force[i, d] = 0.0
    begin = parts.node[p]
    end = parts.node[p + 1]
    scatter_nodes(fn, s.first, s.second, s.weight, joint_force, begin, end)
    move_blocks(s.zones, p, s, m, parts, load, alpha, local, dt, speed, sums)
    node_motion(m.x, m.v, s.first, s.second, s.weight, follow, m.node, begin, end)


@kernel(error_model="numpy")
def begin(s, m, pairs):
    """Before `advance`: node table, rows and loaded blocks of the present state; a look is due if somebody moved
    nodes since."""
    list_burdened(s)
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
    rise = 0.0
    largest = 0.0
    for p in range(sums.shape[0]):
        m.ledger[FRICTION] += sums[p, AT_FRICTION]
        m.ledger[PLASTIC] += sums[p, AT_PLASTIC]
        largest = max(largest, sums[p, AT_OVERLAP])
        kinetic += sums[p, AT_KINETIC]
        damped += sums[p, AT_DAMPED]
        load_work += sums[p, AT_LOAD]
        wall_work += sums[p, AT_WALL]
        rise += sums[p, AT_RISE]
    m.ledger[LARGEST_OVERLAP] = largest
    t = m.ledger
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
    t[WAY] += rise * dt
    # A spring between the loaded ground and a frame that moves evenly. It answers at once, so it cannot feed swings.
    m.drive[LOAD] -= m.drive[BRAKE] * rise * dt
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


@kernel(error_model="numpy", nogil=True, pairing=True)
def advance(me, board, plan, sums, m, steps, s, parts, pairs, joints, rules):
    """Up to `steps` steps on the parts of thread `me`. Returns (status, steps done, pair concerned).

    board, plan : as in threads.py; sums : (2, parts, motion.COLUMNS) work space shared by all threads
    m, s, parts, rules : Motion, Skeleton, Parts, Rules; joints : table of sets of joints
    Threads share all arrays of m but ledger, drive and due: each takes the same decisions from its own.
    """
    dt, near, dilation, deepest, local = rules.dt, rules.near, rules.dilation, rules.deepest, rules.local
    damping_ratio, damping_limit = rules.damping_ratio, rules.damping_limit
    skin, fastest = rules.reach, rules.most_energy
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
            m.ledger[LARGEST_OVERLAP] = _worst(now[:, AT_OVERLAP])
            return DEEP_OVERLAP, step, bad
        if not _gather(m, now, damping_ratio, damping_limit, alpha, dt) < fastest:
            return RUNAWAY, step, -1
    return DONE, steps, -1
