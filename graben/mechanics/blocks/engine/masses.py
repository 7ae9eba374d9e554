"""Masses of deformable blocks: vertices for what deforms a block, and the whole block for what moves it.

Slow loading scales masses so that one time step is stable everywhere. Zones are stiff and joints are soft, so a
vertex needs far more mass against its zones than a block needs against its joints. The motion of a block is therefore
split into its rigid part, with a mass and a moment of inertia of its own, and the rest, which the vertices carry:

    a = D^-1 f + (1/M_r - 1/M) R + (1/I_r - 1/I) N x r

with D the masses of the vertices, M and I their sum and moment of inertia, R and N the resultant of the forces f and
its moment about their centre, M_r and I_r the block's own. This is selective mass scaling (Olovsson, Simonsson and
Unosson 2005), block by block. `inertial_force` applies the inverse, by the formula of Sherman and Morrison.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.blocks.shape.partition import runs
from graben.mechanics.blocks.zones.elastic import row_sums, shape_gradients
from graben.mechanics.blocks.zones.rigid import rigid_blocks, stiffest_motion

# Time step over the limit 2 / omega of the stiffest block.
SAFETY = 0.9

# Columns of Masses.block: M of the vertices, and what the rigid part gains, 1/M_r - 1/M and 1/I_r - 1/I.
WHOLE, LIGHTER, NIMBLER = range(3)

# Vertices of a block whose stiffness is looked at as a whole; the row sums bound that of larger ones. Entries of the
# matrices of blocks that are looked at together: 32 MB each.
_LARGEST, _TOGETHER = 64, 4_000_000

# Joints count this much in the masses of the vertices, and 1 / (1 - 1/_SHARE) in those of the blocks: with both, the
# step is stable for any motion made of a rigid part and a rest, (u + w)^2 <= u^2 / (1 - 1/_SHARE) + _SHARE w^2.
_SHARE = 4.0


class Masses(NamedTuple):
    """vertex : (vertices,) [kg/m]; first : (blocks + 1,) first vertex of each block in order of storage

    block : (blocks, 3) columns as above
    """

    vertex: np.ndarray
    first: np.ndarray
    block: np.ndarray

    @property
    def owner(self) -> np.ndarray:
        """Block (vertices,) of each vertex, in order of storage."""
        return np.repeat(np.arange(len(self.block)), np.diff(self.first))

    @property
    def moving(self) -> np.ndarray:
        """Mass (blocks,) that a block moves with [kg/m]."""
        return 1.0 / (self.block[:, LIGHTER] + 1.0 / self.block[:, WHOLE])

    def plain(self, local: float, scaled: bool) -> Masses:
        """Vertices alone, without lighter rigid parts, for a share of local damping.

        It looks at the force on each vertex, so zones in balance would push a whole block. Where velocities turn it
        adds to the force, as stiffer springs would; scaled masses follow.
        """
        heavier = 1.0 + local if scaled else 1.0
        block = self.block.copy()
        block[:, LIGHTER:] = 0.0
        block[:, WHOLE] *= heavier
        return self._replace(block=block, vertex=self.vertex * heavier)

    def held(self, vertices: np.ndarray) -> Masses:
        """The same, where blocks of these held vertices (indices) turn with the inertia of their vertices.

        A held vertex then couples to the others through the sum of forces alone, which has a closed form.
        """
        block = self.block.copy()
        block[np.unique(self.owner[vertices]), NIMBLER] = 0.0
        return self._replace(block=block)


class Gains(NamedTuple):
    """What a step works out for every vertex and block, once for all steps, because divisions are dear.

    vertex : (vertices,) dt / mass; block : (blocks,) what inertia leaves out of the motion of the centre
    burdened : (blocks,) int8, 1 for those under a load (valid while stepping)
    """

    vertex: np.ndarray
    block: np.ndarray
    burdened: np.ndarray


def gains(masses: Masses, dt: float) -> Gains:
    """The gains of masses in steps of dt [s]."""
    less = _left_out(masses.block[:, LIGHTER], masses.block[:, WHOLE])
    return Gains(dt / masses.vertex, less, np.zeros(len(less), dtype=np.int8))


def of_rigid(block: np.ndarray, vertex: np.ndarray, first: np.ndarray) -> Masses:
    """Shares (vertices,) of the masses (blocks,) of rigid blocks, which move by laws of their own."""
    table = np.zeros((len(block), 3))
    table[:, WHOLE] = block
    return Masses(vertex, first, table)


def _resultants(masses: Masses, x: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arms (vertices, 2) from the centres of the blocks at x; resultants (blocks, 2) of forces, and moments."""
    owner, count = masses.owner, len(masses.block)
    whole = np.column_stack([np.bincount(owner, masses.vertex * x[:, d], count) for d in (0, 1)])
    arm = x - (whole / masses.block[:, WHOLE, None])[owner]
    push = np.column_stack([np.bincount(owner, force[:, d], count) for d in (0, 1)])
    return arm, push, np.bincount(owner, arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0], count)


def inertial_force(masses: Masses, x: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Forces (vertices, 2) that an acceleration (vertices, 2) takes at positions x: M_eff a."""
    m, block, owner = masses.vertex[:, None], masses.block, masses.owner
    arm, push, moment = _resultants(masses, x, m * acceleration)
    turn = np.bincount(owner, masses.vertex * (arm**2).sum(axis=1), len(block))
    off = (_left_out(block[:, LIGHTER], block[:, WHOLE])[:, None] * push)[owner]
    spin = (_left_out(block[:, NIMBLER], turn) * moment)[owner]
    return m * (acceleration - off - spin[:, None] * np.column_stack([-arm[:, 1], arm[:, 0]]))


def _left_out(gain: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """What inertia leaves out of a rigid motion with a gain 1/M_r - 1/M: 1/M - M_r/M^2."""
    return gain / (1.0 + gain * inertia)


def mobility(masses: Masses, x: np.ndarray, force: np.ndarray) -> float:
    """f . M_eff^-1 f of forces (vertices, 2): what they accelerate along themselves [m/s2 N/m]."""
    block = masses.block
    _, push, moment = _resultants(masses, x, force)
    rigid = block[:, LIGHTER] * (push**2).sum(axis=1) + block[:, NIMBLER] * moment**2
    return float(((force**2).sum(axis=1) / masses.vertex).sum() + rigid.sum())


def rigid_motion(masses: Masses, x: np.ndarray, v: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Velocities (vertices, 2) of the rigid motions of the blocks, along what is held (flags) nothing."""
    m, owner, count = masses.vertex, masses.owner, len(masses.block)
    arm, push, moment = _resultants(masses, x, m[:, None] * v)
    turn = np.bincount(owner, m * (arm**2).sum(axis=1), count)
    fixed = np.column_stack([np.bincount(owner, held[:, d], count) > 0 for d in (0, 1)])
    middle = np.where(fixed, 0.0, push / masses.block[:, WHOLE, None])
    spin = np.where(fixed.any(axis=1), 0.0, moment / turn)[owner]
    return middle[owner] + spin[:, None] * np.column_stack([-arm[:, 1], arm[:, 0]])


def kinetic_energies(masses: Masses, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Kinetic energy (blocks in order of storage,) [J/m]."""
    power = (v * inertial_force(masses, x, v)).sum(axis=1)
    return 0.5 * np.bincount(masses.owner, power, len(masses.block))


def scaled_masses(bodies: Bodies, zone: np.ndarray, joint: float, dt: float) -> Masses:
    """Masses for which the step dt is stable whatever the true ones are.

    Parameters
    ----------
    zone : (zones, 6, 6) stiffness of each zone [N/m per m]
    joint : stiffness of the stiffest joint [Pa/m]
    """
    springs = _springs(bodies, joint)
    vertex = np.bincount(bodies.zone_vertex.ravel(), row_sums(zone).ravel(), len(springs)) + _SHARE * springs
    first = runs(bodies.vertex_block)[1].astype(np.int64)
    r = rigid_blocks(bodies, 1.0, shape_gradients(bodies.position, bodies.zone_vertex)[1], first)
    rigid = stiffest_motion(bodies, r, joint) / (1.0 - 1.0 / _SHARE)
    spin = rigid * r.inertia[:, 1] ** 2
    # Bounds are coarse: the largest stiffness over mass of each block is below one, and scales its masses.
    chosen = _masses(bodies, first, vertex, rigid, spin)
    scale = _largest(bodies, chosen, zone, springs) * (dt / (2.0 * SAFETY)) ** 2
    return _masses(bodies, first, vertex * scale[chosen.owner], rigid * scale, spin * scale)


def true_masses(bodies: Bodies, zone: np.ndarray, joint: float, density: float) -> tuple[Masses, float]:
    """Masses as they are, blocks with the moment of inertia of their area; and the largest stable step [s]."""
    area, first = (
        shape_gradients(bodies.position, bodies.zone_vertex)[1],
        runs(bodies.vertex_block)[1].astype(np.int64),
    )
    third = np.bincount(bodies.zone_vertex.ravel(), np.repeat(density * area / 3.0, 3), len(bodies.position))
    r = rigid_blocks(bodies, density, area, first)
    inertia = r.inertia[:, 0] * r.inertia[:, 1] ** 2
    large = np.diff(first) > _LARGEST
    masses = _masses(bodies, first, third, r.inertia[:, 0], np.where(large, np.inf, inertia))
    springs = _springs(bodies, joint)
    bound = (np.bincount(bodies.zone_vertex.ravel(), row_sums(zone).ravel(), len(springs)) + 2.0 * springs) / third
    omega2 = np.where(large, np.maximum.reduceat(bound, first[:-1]), _largest(bodies, masses, zone, springs))
    return masses, float(2.0 * SAFETY / np.sqrt(omega2.max()))


def _springs(bodies: Bodies, joint: float) -> np.ndarray:
    """Stiffness (vertices,) of the joints along the edges of a block, half of each edge at either end.

    Twice, since both blocks move: (a - b)^2 <= 2 a^2 + 2 b^2.
    """
    b = bodies
    length = np.linalg.norm(b.position[b.edge_to] - b.position[b.edge_from], axis=1)
    springs = np.zeros(len(b.position))
    for end in (b.edge_from, b.edge_to):
        np.add.at(springs, end, 2.0 * joint * 0.5 * length)
    return springs


def _masses(bodies: Bodies, first: np.ndarray, vertex: np.ndarray, rigid: np.ndarray, spin: np.ndarray) -> Masses:
    """Masses of vertices and of blocks (in order of storage); a rigid part is never heavier than its vertices."""
    whole = np.add.reduceat(vertex, first[:-1])
    plain = Masses(vertex, first, np.column_stack([whole, np.zeros((len(whole), 2))]))
    arm = _resultants(plain, bodies.position, np.zeros_like(bodies.position))[0]
    turn = np.add.reduceat(vertex * (arm**2).sum(axis=1), first[:-1])
    lighter = 1.0 / np.minimum(rigid, whole) - 1.0 / whole
    nimbler = 1.0 / np.minimum(spin, turn) - 1.0 / turn
    return plain._replace(block=np.column_stack([whole, lighter, nimbler]))


def _largest(bodies: Bodies, masses: Masses, zone: np.ndarray, springs: np.ndarray) -> np.ndarray:
    """Largest stiffness over mass (blocks,) of each block on the springs of its joints; one for large blocks.

    The largest of all bounds the squared frequency of the whole, because springs between blocks count twice.
    """
    size = np.diff(masses.first)
    result = np.ones(len(size))
    for n in np.unique(size[size <= _LARGEST]):
        alike = np.flatnonzero(size == n)
        for these in np.array_split(alike, -(-len(alike) * 4 * n * n // _TOGETHER)):
            result[these] = _largest_of(bodies, masses, zone, springs, these)
    return result


def _largest_of(
    bodies: Bodies, masses: Masses, zone: np.ndarray, springs: np.ndarray, these: np.ndarray
) -> np.ndarray:
    """As `_largest`, for blocks (numbers in order of storage) of one number of vertices."""
    first, block = masses.first[these], masses.block[these]
    n = int(masses.first[these[0] + 1] - first[0])
    place = np.full(len(masses.block), -1)
    place[these] = np.arange(len(these))
    owner = masses.owner[bodies.zone_vertex[:, 0]]
    mine = np.flatnonzero(place[owner] >= 0)
    corner = bodies.zone_vertex[mine] - masses.first[owner[mine], None]
    dof = (2 * corner[:, :, None] + np.arange(2)).reshape(len(mine), 6)
    stiffness = np.zeros((len(these), 2 * n, 2 * n))
    np.add.at(stiffness, (place[owner[mine], None, None], dof[:, :, None], dof[:, None, :]), zone[mine])
    vertex, both = first[:, None] + np.arange(n), np.arange(2 * n)
    stiffness[:, both, both] += np.repeat(springs[vertex], 2, axis=1)
    m, x = masses.vertex[vertex], bodies.position[vertex]
    r = x - ((m[:, :, None] * x).sum(axis=1) / block[:, WHOLE, None])[:, None, :]
    inverse = np.zeros_like(stiffness)
    inverse[:, both, both] = 1.0 / np.repeat(m, 2, axis=1)
    for d in (0, 1):
        inverse[:, d::2, d::2] += block[:, LIGHTER, None, None]
    arm = np.stack([-r[..., 1], r[..., 0]], axis=-1).reshape(len(these), 2 * n)
    inverse += block[:, NIMBLER, None, None] * arm[:, :, None] * arm[:, None, :]
    # With M_eff^-1 = L L^T the eigenvalues of M_eff^-1 K are those of the symmetric L^T K L.
    lower = np.linalg.cholesky(inverse)
    return np.linalg.eigvalsh(lower.transpose(0, 2, 1) @ stiffness @ lower)[:, -1]
