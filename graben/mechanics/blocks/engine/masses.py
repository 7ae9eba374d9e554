"""Masses of deformable blocks: vertices for what deforms a block, and the whole block for what moves it.

Slow loading scales masses so that one time step is stable everywhere. Zones are stiff and joints are soft, so a
vertex needs far more mass against its zones than a block needs against its joints. The motion of a block is therefore
split into its rigid part, with a mass and a moment of inertia of its own, and the rest, which the vertices carry:

    a = D^-1 f + (1/M_r - 1/M) R + (1/I_r - 1/I) N x r

with D the masses of the vertices, M and I their sum and moment of inertia, R and N the resultant of the forces f and
its moment about their centre, M_r and I_r the block's own. This is selective mass scaling (Olovsson, Simonsson and
Unosson 2005), block by block. `inertial_force` applies the inverse.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.blocks.zones.elastic import row_sums
from graben.mechanics.blocks.zones.rigid import rigid_blocks, stiffest_motion

# Time step over the limit 2 / omega of the stiffest block.
SAFETY = 0.9

# Columns of Masses.block: M and I of the vertices; what the rigid part gains, 1/M_r - 1/M and 1/I_r - 1/I; and what
# inertia leaves out of it, 1/M - M_r/M^2 and 1/I - I_r/I^2.
WHOLE, TURN, LIGHTER, NIMBLER, LESS, LESS_TURN = range(6)

# Vertices of a block whose stiffness is looked at as a whole; the row sums bound that of larger ones.
_LARGEST = 64

# Joints count this much in the masses of the vertices, and 1 / (1 - 1/_SHARE) in those of the blocks: with both, the
# step is stable for any motion made of a rigid part and a rest, (u + w)^2 <= u^2 / (1 - 1/_SHARE) + _SHARE w^2.
_SHARE = 4.0


class Masses(NamedTuple):
    """vertex : (vertices,) [kg/m]; first : (blocks + 1,) first vertex of each block in order of storage

    block : (blocks, 6) columns as above
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
        block = self.block.copy()
        block[:, LIGHTER:] = 0.0
        block[:, :LIGHTER] *= 1.0 + local if scaled else 1.0
        return self._replace(block=block, vertex=self.vertex * (1.0 + local if scaled else 1.0))

    def held(self, vertices: np.ndarray) -> Masses:
        """The same, where blocks of these held vertices (indices) turn with the inertia of their vertices.

        A held vertex then couples to the others through the sum of forces alone, which has a closed form.
        """
        block = self.block.copy()
        block[np.unique(self.owner[vertices])[:, None], [NIMBLER, LESS_TURN]] = 0.0
        return self._replace(block=block)


def of_rigid(block: np.ndarray, vertex: np.ndarray, first: np.ndarray) -> Masses:
    """Shares (vertices,) of the masses (blocks,) of rigid blocks, which move by laws of their own."""
    table = np.zeros((len(block), 6))
    table[:, WHOLE] = block
    table[:, TURN] = 1.0
    return Masses(vertex, first, table)


def inertial_force(masses: Masses, x: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Forces (vertices, 2) that an acceleration (vertices, 2) takes at positions x: M_eff a."""
    m, block, owner, count = masses.vertex, masses.block, masses.owner, len(masses.block)
    whole = block[:, WHOLE]

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(owner, values, count)

    centre = np.column_stack([total(m * x[:, d]) / whole for d in (0, 1)])
    push = np.column_stack([total(m * acceleration[:, d]) for d in (0, 1)])
    r = x - centre[owner]
    moment = total(m * (r[:, 0] * acceleration[:, 1] - r[:, 1] * acceleration[:, 0]))
    off = (block[:, LESS, None] * push)[owner]
    spin = (block[:, LESS_TURN] * moment)[owner]
    return m[:, None] * (acceleration - off - spin[:, None] * np.column_stack([-r[:, 1], r[:, 0]]))


def mobility(masses: Masses, x: np.ndarray, force: np.ndarray) -> float:
    """f . M_eff^-1 f of forces (vertices, 2): what they accelerate along themselves [m/s2 N/m]."""
    m, block, owner, count = masses.vertex, masses.block, masses.owner, len(masses.block)

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(owner, values, count)

    centre = np.column_stack([total(m * x[:, d]) / block[:, WHOLE] for d in (0, 1)])
    r = x - centre[owner]
    push = np.column_stack([total(force[:, d]) for d in (0, 1)])
    moment = total(r[:, 0] * force[:, 1] - r[:, 1] * force[:, 0])
    rigid = block[:, LIGHTER] * (push**2).sum(axis=1) + block[:, NIMBLER] * moment**2
    return float(((force**2).sum(axis=1) / m).sum() + rigid.sum())


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
    r = rigid_blocks(bodies, 1.0, _areas(bodies), _first(bodies))
    rigid = stiffest_motion(bodies, r, joint) / (1.0 - 1.0 / _SHARE)
    # Stiffness over mass of what was chosen is below one: bounds are coarse. What it is block by block scales masses.
    chosen = _masses(bodies, vertex, rigid, rigid * r.inertia[:, 1] ** 2)
    scale = _largest(bodies, chosen, zone, springs) * (dt / (2.0 * SAFETY)) ** 2
    return _masses(bodies, vertex * scale[chosen.owner], rigid * scale, rigid * r.inertia[:, 1] ** 2 * scale)


def true_masses(bodies: Bodies, zone: np.ndarray, joint: float, density: float) -> tuple[Masses, float]:
    """Masses as they are, blocks with the moment of inertia of their area; and the largest stable step [s]."""
    area = _areas(bodies)
    third = np.bincount(bodies.zone_vertex.ravel(), np.repeat(density * area / 3.0, 3), len(bodies.position))
    r = rigid_blocks(bodies, density, area, _first(bodies))
    inertia = r.inertia[:, 0] * r.inertia[:, 1] ** 2
    large = np.diff(_first(bodies)) > _LARGEST
    masses = _masses(bodies, third, r.inertia[:, 0], np.where(large, np.inf, inertia))
    springs = _springs(bodies, joint)
    omega2 = _largest(bodies, masses, zone, springs)
    bound = (np.bincount(bodies.zone_vertex.ravel(), row_sums(zone).ravel(), len(springs)) + 2.0 * springs) / third
    omega2 = np.where(large, np.maximum.reduceat(bound, _first(bodies)[:-1]), omega2)
    return masses, float(2.0 * SAFETY / np.sqrt(omega2.max()))


def _first(bodies: Bodies) -> np.ndarray:
    block = bodies.vertex_block
    return np.append(np.flatnonzero(np.append(True, block[1:] != block[:-1])), len(block)).astype(np.int64)


def _areas(bodies: Bodies) -> np.ndarray:
    p = bodies.position[bodies.zone_vertex]
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


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


def _masses(bodies: Bodies, vertex: np.ndarray, rigid: np.ndarray, spin: np.ndarray) -> Masses:
    """Masses of vertices and of blocks (in order of storage); a rigid part is never heavier than its vertices."""
    first = _first(bodies)
    count = len(first) - 1
    owner = np.repeat(np.arange(count), np.diff(first))
    whole = np.bincount(owner, vertex, count)
    centre = np.column_stack([np.bincount(owner, vertex * bodies.position[:, d], count) / whole for d in (0, 1)])
    turn = np.bincount(owner, vertex * ((bodies.position - centre[owner]) ** 2).sum(axis=1), count)
    rigid, spin = np.minimum(rigid, whole), np.minimum(spin, turn)
    block = np.column_stack(
        [
            whole,
            turn,
            1.0 / rigid - 1.0 / whole,
            1.0 / spin - 1.0 / turn,
            (1.0 - rigid / whole) / whole,
            (1.0 - spin / turn) / turn,
        ]
    )
    return Masses(vertex, first, np.ascontiguousarray(block))


def _largest(bodies: Bodies, masses: Masses, zone: np.ndarray, springs: np.ndarray) -> np.ndarray:
    """Largest stiffness over mass (blocks,) of each block on the springs of its joints; one for large blocks.

    The largest of all bounds the squared frequency of the whole, because springs between blocks count twice.
    """
    owner, first, x = masses.owner, masses.first, bodies.position
    size = np.diff(first)
    zone_owner = owner[bodies.zone_vertex[:, 0]]
    result = np.ones(len(size))
    for n in np.unique(size[size <= _LARGEST]):
        these = np.flatnonzero(size == n)
        place = np.full(len(size), -1)
        place[these] = np.arange(len(these))
        k = np.zeros((len(these), 2 * n, 2 * n))
        mine = np.flatnonzero(place[zone_owner] >= 0)
        corner = bodies.zone_vertex[mine] - first[zone_owner[mine], None]
        dof = (2 * corner[:, :, None] + np.arange(2)).reshape(len(mine), 6)
        np.add.at(k, (place[zone_owner[mine], None, None], dof[:, :, None], dof[:, None, :]), zone[mine])
        vertex = first[these, None] + np.arange(n)
        both = np.arange(2 * n)
        k[:, both, both] += np.repeat(springs[vertex], 2, axis=1)
        m = masses.vertex[vertex]
        block = masses.block[these]
        r = x[vertex] - ((m[:, :, None] * x[vertex]).sum(axis=1) / block[:, WHOLE, None])[:, None, :]
        # M_eff^-1 = L L^T is not needed: its eigenvalues with K are those of S K S, with S^2 the inverse.
        inverse = np.zeros_like(k)
        inverse[:, both, both] = 1.0 / np.repeat(m, 2, axis=1)
        for d in (0, 1):
            inverse[:, d::2, d::2] += block[:, LIGHTER, None, None]
        arm = np.stack([-r[..., 1], r[..., 0]], axis=-1).reshape(len(these), 2 * n)
        inverse += block[:, NIMBLER, None, None] * arm[:, :, None] * arm[:, None, :]
        lower = np.linalg.cholesky(inverse)
        result[these] = np.linalg.eigvalsh(lower.transpose(0, 2, 1) @ k @ lower)[:, -1]
    return result
