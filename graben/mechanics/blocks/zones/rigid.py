"""Rigid blocks: three velocities each, exact mass and moment of inertia, no zones.

A step takes the sum of the forces on a block and their moment about its centre of mass to a new velocity and spin,
turns the block by exactly that angle and puts its vertices where they then are, so nothing drifts. Held vertices are
constraints on the three velocities: the block takes those nearest to the free ones (by kinetic energy) that obey
them all, and the reactions are the smallest that make it so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.compiled import kernel

# Columns of `place`: centre, angle turned, velocity of the centre, spin.
_CX, _CY, _ANGLE, _VX, _VY, _SPIN = range(6)
# Columns of `inertia`: mass [kg/m], radius of gyration [m], and mean square of the arms of the vertices [m2].
_MASS, _GYRATION, _SPREAD = range(3)

# A constraint that the others imply but for this share (squared) is left out.
_IMPLIED = 1e-12


class RigidBlocks(NamedTuple):
    """Blocks in order of storage: first vertex of each (blocks + 1,), place (blocks, 6), inertia (blocks, 3).

    arm : (vertices, 2) from the centre of mass, as at the start [m]; share : (vertices,) of the block's mass
    """

    first: np.ndarray
    place: np.ndarray
    inertia: np.ndarray
    arm: np.ndarray
    share: np.ndarray

    def stop(self, vertices: np.ndarray) -> None:
        """Blocks of these vertices (flags) move no more."""
        self.place[vertices[self.first[:-1]], _VX:] = 0.0


def rigid_blocks(bodies: Bodies, density: float, zone_area: np.ndarray, first: np.ndarray) -> RigidBlocks:
    """Blocks at rest with their true masses; first : (blocks + 1,) vertices in order of storage.

    Centre and moment of inertia are those of the block's area, summed over its zones (triangles of thirds).
    """
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))
    count = len(first) - 1
    zone_owner = owner[bodies.zone_vertex[:, 0]]
    corners = bodies.position[bodies.zone_vertex]

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(zone_owner, weights=values, minlength=count)

    area = total(zone_area)
    middle = corners.mean(axis=1)
    centre = np.column_stack([total(zone_area * middle[:, d]) for d in range(2)]) / area[:, None]
    r = corners - centre[zone_owner, None, :]
    # Second moment of a triangle about a point: area / 12 (sum of squared arms + square of their sum).
    polar = total(zone_area / 12.0 * ((r**2).sum(axis=(1, 2)) + (r.sum(axis=1) ** 2).sum(axis=1)))
    thirds = np.bincount(bodies.zone_vertex.ravel(), np.repeat(zone_area / 3.0, 3), len(bodies.position))
    arm = bodies.position - centre[owner]
    share = thirds / area[owner]
    spread = np.bincount(owner, share * (arm**2).sum(axis=1), count)
    place = np.zeros((count, 6))
    place[:, :2] = centre
    inertia = np.column_stack([density * area, np.sqrt(polar / area), spread])
    return RigidBlocks(first.astype(np.int64), place, np.ascontiguousarray(inertia), arm, share)


def stiffest_motion(bodies: Bodies, blocks: RigidBlocks, stiffness: float) -> np.ndarray:
    """Bound (blocks,) on the stiffness [N/m per m] of any motion of a block against its neighbours.

    Springs of `stiffness` [Pa/m] along its edges, twice, since both blocks move ((a - b)^2 <= 2 a^2 + 2 b^2): the
    largest eigenvalue of their matrix over the velocities of the centre and gyration x spin. The largest stiffness
    over mass of all blocks bounds the squared frequency of the whole.
    """
    owner = np.repeat(np.arange(len(blocks.first) - 1), np.diff(blocks.first))
    matrix = np.zeros((len(blocks.place), 3, 3))
    length = np.linalg.norm(bodies.position[bodies.edge_to] - bodies.position[bodies.edge_from], axis=1)
    for end in (bodies.edge_from, bodies.edge_to):
        arm = blocks.arm[end] / blocks.inertia[owner[end], _GYRATION, None]
        for row in (
            np.column_stack([np.ones(len(end)), np.zeros(len(end)), -arm[:, 1]]),
            np.column_stack([np.zeros(len(end)), np.ones(len(end)), arm[:, 0]]),
        ):
            np.add.at(
                matrix, owner[end], (2.0 * stiffness * 0.5 * length)[:, None, None] * row[:, :, None] * row[:, None]
            )
    return np.linalg.eigvalsh(matrix)[:, -1]


def block_stress(blocks: RigidBlocks, x: np.ndarray, force: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Mean stress (blocks in order of storage, 3) xx, yy, xy [Pa] from forces (vertices, 2) of joints, loads, walls.

    Area x stress = sum of force (x) arm about the centre of mass; area : (blocks,) [m2].
    """
    owner = np.repeat(np.arange(len(area)), np.diff(blocks.first))
    arm = x - blocks.place[owner, :2]
    moment = np.zeros((len(area), 2, 2))
    np.add.at(moment, owner, force[:, :, None] * arm[:, None, :])
    shear = 0.5 * (moment[:, 0, 1] + moment[:, 1, 0])
    return np.column_stack([moment[:, 0, 0], moment[:, 1, 1], shear]) / area[:, None]


def kinetic_energies(blocks: RigidBlocks) -> np.ndarray:
    """Kinetic energy (blocks in order of storage,) [J/m]."""
    turning = blocks.inertia[:, _GYRATION] * blocks.place[:, _SPIN]
    return 0.5 * blocks.inertia[:, _MASS] * ((blocks.place[:, [_VX, _VY]] ** 2).sum(axis=1) + turning**2)


@kernel(error_model="numpy")
def _row(blocks, b, i, axis, c, s, row):
    """Velocity of vertex i along an axis as a row over velocity and gyration x spin; c, s : of the angle turned."""
    u, v = blocks.arm[i, 0], blocks.arm[i, 1]
    over = 1.0 / blocks.inertia[b, _GYRATION]
    row[0] = 1.0 - axis
    row[1] = 1.0 * axis
    row[2] = (c * u - s * v) * over if axis == 1 else -(s * u + c * v) * over


@kernel(error_model="numpy")
def _solve(matrix, right, n):
    """Solve the positive definite matrix[:n, :n] for right[:n], in place of right; matrix stays."""
    a = matrix.copy()
    for k in range(n):
        for r in range(k + 1, n):
            ratio = a[r, k] / a[k, k]
            for c in range(k, n):
                a[r, c] -= ratio * a[k, c]
            right[r] -= ratio * right[k]
    for k in range(n - 1, -1, -1):
        for c in range(k + 1, n):
            right[k] -= a[k, c] * right[c]
        right[k] /= a[k, k]


@kernel(error_model="numpy")
def _constrain(blocks, b, begin, end, s, m, speed, dt, old, force, new, mean, pull, work):
    """Bend the free velocities `new` of block b to its held vertices, rows begin to end of s.still.

    old, new : (3,) velocity and gyration x spin; force : (3,) on them; mean : (3,) loses its held part, since held
    motion is not damped; pull : (3,) gets what the walls add to the force. Returns the power of the walls.
    """
    mass = blocks.inertia[b, _MASS]
    basis, normal, row = work[:3], work[3:6], work[6]
    target, push = work[7], work[8]
    rank = 0
    # Halfway through the step, as far as the old spin tells.
    half = blocks.place[b, _ANGLE] + 0.5 * dt * blocks.place[b, _SPIN]
    c, t = np.cos(half), np.sin(half)
    for k in range(begin, end):
        if rank == 3:
            break
        _row(blocks, b, s.still[k, 0], s.still[k, 1], c, t, row)
        size = row[0] ** 2 + row[1] ** 2 + row[2] ** 2
        for e in range(rank):
            along = row[0] * basis[e, 0] + row[1] * basis[e, 1] + row[2] * basis[e, 2]
            for d in range(3):
                row[d] -= along * basis[e, d]
        left = row[0] ** 2 + row[1] ** 2 + row[2] ** 2
        if left > _IMPLIED * size:
            for d in range(3):
                basis[rank, d] = row[d] / np.sqrt(left)
            rank += 1
    normal[:, :] = 0.0
    target[:] = 0.0
    for k in range(begin, end):
        i, axis = s.still[k, 0], s.still[k, 1]
        _row(blocks, b, i, axis, c, t, row)
        for e in range(rank):
            along = row[0] * basis[e, 0] + row[1] * basis[e, 1] + row[2] * basis[e, 2]
            target[e] += along * s.wall[i, axis] * speed
            for f in range(rank):
                normal[e, f] += along * (row[0] * basis[f, 0] + row[1] * basis[f, 1] + row[2] * basis[f, 2])
    _solve(normal, target, rank)
    power = 0.0
    for e in range(rank):
        before, free, acting, middle = 0.0, 0.0, 0.0, 0.0
        for d in range(3):
            before += basis[e, d] * old[d]
            free += basis[e, d] * new[d]
            acting += basis[e, d] * force[d]
            middle += basis[e, d] * mean[d]
        push[e] = mass * (target[e] - before) / dt - acting
        power += push[e] * 0.5 * (before + target[e])
        for d in range(3):
            new[d] += basis[e, d] * (target[e] - free)
            mean[d] -= basis[e, d] * middle
            pull[d] += basis[e, d] * push[e]
    _solve(normal, push, rank)
    for k in range(begin, end):
        i, axis = s.still[k, 0], s.still[k, 1]
        _row(blocks, b, i, axis, c, t, row)
        carried = 0.0
        for e in range(rank):
            carried += push[e] * (row[0] * basis[e, 0] + row[1] * basis[e, 1] + row[2] * basis[e, 2])
        m.reaction[i, axis] = carried
    return power


@kernel(error_model="numpy")
def move_rigid_blocks(blocks, begin, stop, still, still_end, s, m, load, alpha, local, dt, speed):
    """New velocities and places of blocks begin to stop; returns kinetic energy, and powers of damping, loads, walls
    and of the rising load per unit of it.

    still to still_end : rows of s.still of these blocks. m.zone_force gets what holds each vertex in its block.
    """
    x, v, joint, held = m.x, m.v, m.joint_force, m.zone_force
    steady, rising, first, place, inertia = s.steady, s.rising, blocks.first, blocks.place, blocks.inertia
    arms, shares, rows = blocks.arm, blocks.share, s.still
    slow = 1.0 - 0.5 * alpha * dt
    fast = 1.0 / (1.0 + 0.5 * alpha * dt)
    old, new, mean, pull, force = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    applied, work = np.empty(3), np.empty((9, 3))
    kinetic, damped, load_work, wall_work, rise = 0.0, 0.0, 0.0, 0.0, 0.0
    for b in range(begin, stop):
        mass, gyration = inertia[b, _MASS], inertia[b, _GYRATION]
        cx, cy = place[b, _CX], place[b, _CY]
        for d in range(3):
            force[d] = applied[d] = pull[d] = 0.0
        for i in range(first[b], first[b + 1]):
            px = steady[i, 0] + load * rising[i, 0]
            py = steady[i, 1] + load * rising[i, 1]
            rx = x[i, 0] - cx
            ry = x[i, 1] - cy
            applied[0] += px
            applied[1] += py
            applied[2] += rx * py - ry * px
            force[0] += joint[i, 0]
            force[1] += joint[i, 1]
            force[2] += rx * joint[i, 1] - ry * joint[i, 0]
        applied[2] /= gyration
        force[2] /= gyration
        old[0], old[1], old[2] = place[b, _VX], place[b, _VY], place[b, _SPIN] * gyration
        for d in range(3):
            force[d] += applied[d]
            drag = local * abs(force[d])
            if old[d] < 0.0:
                drag = -drag
            elif old[d] == 0.0:
                drag = 0.0
            new[d] = (old[d] * slow + (force[d] - drag) * dt / mass) * fast
            mean[d] = 0.5 * (old[d] + new[d])
        mine = still
        while still < still_end and rows[still, 0] < first[b + 1]:
            still += 1
        if still > mine:
            wall_work += _constrain(blocks, b, mine, still, s, m, speed, dt, old, force, new, mean, pull, work)
        for d in range(3):
            drag = local * abs(force[d])
            if old[d] < 0.0:
                drag = -drag
            elif old[d] == 0.0:
                drag = 0.0
            damped += (drag + alpha * mass * mean[d]) * mean[d]
            load_work += applied[d] * 0.5 * (old[d] + new[d])
            kinetic += 0.5 * mass * new[d] * new[d]
            force[d] += pull[d]
        spin = new[2] / gyration
        place[b, _VX], place[b, _VY], place[b, _SPIN] = new[0], new[1], spin
        place[b, _CX] = cx + dt * new[0]
        place[b, _CY] = cy + dt * new[1]
        angle = place[b, _ANGLE] + dt * spin
        place[b, _ANGLE] = angle
        c, t = np.cos(angle), np.sin(angle)
        twist = force[2] * gyration / inertia[b, _SPREAD]
        for i in range(first[b], first[b + 1]):
            ox = x[i, 0] - cx
            oy = x[i, 1] - cy
            share = shares[i]
            held[i, 0] = share * (force[0] - twist * oy) - joint[i, 0] - (steady[i, 0] + load * rising[i, 0])
            held[i, 1] = share * (force[1] + twist * ox) - joint[i, 1] - (steady[i, 1] + load * rising[i, 1])
            ux, uy = arms[i, 0], arms[i, 1]
            rx = c * ux - t * uy
            ry = t * ux + c * uy
            v[i, 0] = new[0] - 0.5 * spin * (oy + ry)
            v[i, 1] = new[1] + 0.5 * spin * (ox + rx)
            x[i, 0] = place[b, _CX] + rx
            x[i, 1] = place[b, _CY] + ry
            rise += rising[i, 0] * v[i, 0] + rising[i, 1] * v[i, 1]
    return kinetic, damped, load_work, wall_work, rise
