"""Walls: a table of planes, the five of an open box for one, and how floor and piston move."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from graben.errors import Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.particles.records import DASHPOTS, PISTON_DASHPOT, PISTON_PUSH, PISTON_WORK, TIME, Floats, Walls


def planes(
    point: ArrayLike, normal: ArrayLike, velocity: ArrayLike | None = None, kind: ArrayLike | None = None
) -> Walls:
    """A table of w planes.

    Parameters
    ----------
    point : (w, 3) m, on each plane; normal : (w, 3) towards the bodies, of any length
    velocity : (w, 3) m/s, 0 unless given; kind : (w,) law class, 0 unless given

    Raises
    ------
    Refused : rows that do not fit, or a normal without length
    """
    p, n = np.array(point, dtype=np.float64), np.array(normal, dtype=np.float64)
    v = np.zeros_like(p) if velocity is None else np.array(velocity, dtype=np.float64)
    k = np.zeros(len(p), np.int64) if kind is None else np.array(kind, dtype=np.int64)
    if not (p.ndim == 2 and p.shape[1] == 3 and p.shape == n.shape == v.shape and k.shape == p.shape[:1]):
        raise Refused(
            f"walls: expected rows (w, 3), (w, 3), (w, 3), (w,), found {p.shape, n.shape, v.shape, k.shape}"
        )
    length = np.linalg.norm(n, axis=1)
    if not (np.all(np.isfinite(p)) and np.all(np.isfinite(v)) and np.all(np.isfinite(length) & (length > 0.0))):
        raise Refused("walls: expected finite points and velocities, and normals with a length")
    return Walls(p, n / length[:, None], v, k, np.zeros(len(p)), np.zeros_like(p), None)


def box_walls(width: Floats, periodic: bool) -> Walls:
    """Four sides (none where the box is periodic) and, last, the floor z = 0 of the box [0, width)."""
    point = [[0.0, 0.0, 0.0], [width[0], 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, width[1], 0.0], [0.0, 0.0, 0.0]]
    normal = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    return planes(point[4 if periodic else 0 :], normal[4 if periodic else 0 :])


def with_slip(walls: Walls, bodies: int) -> Walls:
    """The same rows, with tangential springs (bodies, w, 3) at rest."""
    return walls._replace(slip=np.zeros((bodies, len(walls.point), 3)))


def joined(walls: Walls, more: Walls) -> Walls:
    """The rows of one table, then those of another; springs of the new rows are at rest."""
    rows = {name: np.concatenate([getattr(walls, name), getattr(more, name)]) for name in Walls._fields[:-1]}
    slip = walls.slip
    if slip is not None:
        slip = np.concatenate([slip, np.zeros((len(slip), len(more.point), 3))], axis=1)
    return Walls(**rows, slip=slip)


def level_of(walls: Walls, row: int) -> float:
    """Where a plane stands along its normal, m."""
    return float(np.sum(walls.normal[row] * walls.point[row]))


@kernel
def mark_near(bodies, walls, slip, margin, near):
    """Fill near (n,): may a body touch a wall before both have closed in by margin, m, or has it a spring on one?"""
    x, facing, point = bodies.position, walls.normal, walls.point
    for i in range(x.shape[0]):
        near[i] = False
        for w in range(facing.shape[0]):
            gap = -bodies.radius[i]
            for a in range(3):
                gap += facing[w, a] * (x[i, a] - point[w, a])
            if gap < margin:
                near[i] = True
            if slip is not None:  # noqa: SIM102  (numba drops a branch on this alone)
                if slip[i, w, 0] != 0.0 or slip[i, w, 1] != 0.0 or slip[i, w, 2] != 0.0:
                    near[i] = True


@kernel
def steer(walls, drive, clock, dt, level, after):
    """Fill level (w,) m, where the planes stand along their normals, and after (w, 3) m/s over the next drift.

    For a normal along an axis each product is exact, and the level is the coordinate with its sign.
    """
    point, normal = walls.point, walls.normal
    for w in range(level.shape[0]):
        level[w] = normal[w, 0] * point[w, 0] + normal[w, 1] * point[w, 1] + normal[w, 2] * point[w, 2]
        for a in range(3):
            after[w, a] = walls.velocity[w, a]
    if drive.shake_amplitude > 0.0:
        w = drive.floor
        phase = drive.shake_omega * (clock[TIME] + dt - drive.shake_start)
        speed = (drive.shake_home + drive.shake_amplitude * np.sin(phase) - level[w]) / dt
        for a in range(3):
            after[w, a] = speed * normal[w, a]


@kernel(error_model="numpy")
def push_piston(walls, drive, clock, dt, damp, after, ledger):
    """Kick the piston: its velocity over the next drift goes to after (w, 3); damp (w,) N, dashpots on each wall."""
    w = drive.piston
    normal, velocity = walls.normal, walls.velocity
    push = min(drive.piston_force, clock[PISTON_PUSH] + drive.piston_rate * dt)
    clock[PISTON_PUSH] = push
    # speeds count against the normal, away from the bodies
    old = -(normal[w, 0] * velocity[w, 0] + normal[w, 1] * velocity[w, 1] + normal[w, 2] * velocity[w, 2])
    new = old + (walls.push[w] - push - drive.piston_damping * old) / drive.piston_mass * dt
    middle = 0.5 * (old + new)
    ledger[PISTON_WORK] -= push * middle * dt
    ledger[PISTON_DASHPOT] += drive.piston_damping * old * middle * dt
    ledger[DASHPOTS] -= damp[w] * 0.5 * (new - old) * dt  # `motion.move` did not know the new velocity
    for a in range(3):
        after[w, a] = -new * normal[w, a]


@kernel
def drift(walls, after, dt):
    """Move all planes with the velocities `after` (w, 3), which become theirs; returns the longest way, m."""
    far2 = 0.0
    for w in range(after.shape[0]):
        way2 = 0.0
        for a in range(3):
            way = after[w, a] * dt
            walls.velocity[w, a] = after[w, a]
            walls.point[w, a] += way
            way2 += way * way
        far2 = max(far2, way2)
    return np.sqrt(far2)
