"""What can be asked of a model: stresses, contacts, forces, energies, and where its drive stands."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.joints import Joint, Pairs, contact_state
from graben.mechanics.blocks.contact.nodes import node_motion, scatter_nodes
from graben.mechanics.blocks.engine import masses
from graben.mechanics.blocks.engine.records import (
    DAMPED,
    DAMPING,
    FRICTION,
    KINETIC,
    LARGEST_OVERLAP,
    LOAD,
    LOAD_WORK,
    PLASTIC,
    WALL_WORK,
    WAY,
    Motion,
    Skeleton,
)
from graben.mechanics.blocks.shape.bodies import Bodies, Skin
from graben.mechanics.blocks.shape.partition import Parts
from graben.mechanics.blocks.zones.elastic import zone_state
from graben.mechanics.blocks.zones.plastic import EQUIVALENT, PlasticZones
from graben.mechanics.blocks.zones.rigid import RigidBlocks, block_stress, kinetic_energies


class ModelState:
    """The present state of a model; nothing here changes it. See `BlockModel` for what does.

    bodies, skin, parts, joints; skeleton, motion, pairs : records of the compiled loop
    held : (vertices, 2) flags of prescribed velocities; removed : (blocks,) flags; weight : (vertices, 2) [N/m]
    """

    bodies: Bodies
    skin: Skin
    parts: Parts
    joints: tuple[Joint, ...]
    joint_table: np.ndarray
    skeleton: Skeleton
    motion: Motion
    pairs: Pairs
    held: np.ndarray
    removed: np.ndarray
    weight: np.ndarray
    deepest: float
    excavated: float

    @property
    def load_factor(self) -> float:
        """What the rising load is multiplied by now."""
        return float(self.motion.drive[LOAD])

    @property
    def way(self) -> float:
        """Work of the rising load per unit of it [J/m], since the ledger began."""
        return float(self.motion.ledger[WAY])

    @property
    def damping_coefficient(self) -> float:
        """Coefficient of global damping now [1/s]."""
        return float(self.motion.drive[DAMPING])

    @property
    def largest_overlap(self) -> float:
        """Largest overlap of two blocks in the last step [m]."""
        return float(self.motion.ledger[LARGEST_OVERLAP])

    def load(self) -> np.ndarray:
        """Dead loads and weight as they are now (vertices, 2) [N/m]."""
        return self.skeleton.steady + self.motion.drive[LOAD] * self.skeleton.rising

    def boundary_force(self) -> np.ndarray:
        """Forces (vertices, 2) of walls and pressures on the blocks [N/m]; gravity is none of them."""
        return self.load() - self.weight + np.where(self.held, self.motion.reaction, 0.0)

    def unbalanced_ratio(self) -> float:
        """Largest unbalanced force on a free vertex over the mean size of zone forces."""
        scale = float(np.abs(self.motion.zone_force).mean())
        return float(np.abs(self.unbalanced_force()).max()) / scale if scale > 0.0 else np.inf

    def unbalanced_force(self) -> np.ndarray:
        """What is left of the forces (vertices, 2) on free vertices [N/m]; of loose blocks nothing, they fly."""
        m = self.motion
        out = self.held | self.loose_blocks()[self.bodies.vertex_block, None]
        return np.where(out, 0.0, m.zone_force + m.joint_force + self.load())

    def resistance(self, acceleration: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Forces (vertices, 2) that inertia and global damping take up; nothing at prescribed velocities."""
        slowed = acceleration + self.damping_coefficient * velocity
        return np.where(self.held, 0.0, masses.inertial_force(self.skeleton.mass, self.motion.x, slowed))

    def mobility(self) -> float:
        """What the rising load accelerates along itself, per unit of it [1/s2 per unit of way]."""
        return masses.mobility(self.skeleton.mass, self.motion.x, np.where(self.held, 0.0, self.skeleton.rising))

    def block_imbalance(self) -> np.ndarray:
        """Resultant on each block (blocks,) over the sizes of the forces that bear on it; 1 in free fall."""
        return self.block_share(self.motion.joint_force + self.load())

    def block_share(self, force: np.ndarray) -> np.ndarray:
        """Resultants (blocks,) of forces (vertices, 2) [N/m] over the sizes of the forces that bear on the blocks.

        Blocks with a prescribed velocity, and those taken out, count as balanced.
        """
        m, b, count = self.motion, self.bodies, len(self.bodies.block_area)
        load = self.load()
        total = np.hypot(*(np.bincount(b.vertex_block, f, count) for f in force.T))
        size = np.bincount(b.vertex_block, np.hypot(*m.joint_force.T), count)
        size += np.hypot(*(np.bincount(b.vertex_block, f, count) for f in load.T))
        still = np.bincount(b.vertex_block, self.held.any(axis=1), count) > 0
        ratio = np.divide(total, size, out=np.zeros(count), where=size > self.rounding_force)
        return np.where(still | self.removed, 0.0, ratio)

    @property
    def rounding_force(self) -> float:
        """Forces below this [N/m] are rounding errors of positions."""
        return 1e-12 * max(j.stiffest for j in self.joints) * float(self.bodies.block_area.max())

    def contact_force(self, among: np.ndarray | None = None) -> np.ndarray:
        """Forces (vertices, 2) of contacts [N/m], from where the blocks are now; among : as in `contacts`."""
        s, nodal = self.skeleton, np.zeros((len(self.skeleton.first), 2))
        self.contacts(nodal, among)
        force = np.zeros_like(self.motion.x)
        scatter_nodes(nodal, s.first, s.second, s.weight, force, 0, len(nodal))
        return force

    def zone_stress(self) -> np.ndarray:
        """Cauchy stress (zones, 4) as xx, yy, zz, xy [Pa]."""
        stress = self._zone_state()[0]
        if self.removed.any():
            stress[self.removed[self.bodies.zone_block]] = 0.0
        return stress

    def state_of_blocks(self) -> dict[str, np.ndarray]:
        """What the law of the zones leaves at each state, named as in the artifact."""
        z = self.skeleton.zones
        if isinstance(z, RigidBlocks):
            return {"block_stress": self.block_stress()}
        state = {"zone_stress": self.zone_stress()}
        if isinstance(z, PlasticZones):
            state |= {"zone_plastic_strain": z.plastic[:, EQUIVALENT].copy(), "zone_state": z.flag.copy()}
        return state

    def block_stress(self) -> np.ndarray:
        """Mean stress (blocks, 3) of rigid blocks, xx, yy, xy [Pa], from the forces on them."""
        s, z, b = self.skeleton, self.skeleton.zones, self.bodies
        nodal, force = np.zeros((len(s.first), 2)), self.boundary_force() + self.weight
        self.contacts(nodal)
        scatter_nodes(nodal, s.first, s.second, s.weight, force, 0, len(nodal))
        number = b.vertex_block[z.first[:-1]]
        stress = np.empty((len(number), 3))
        stress[number] = block_stress(z, self.motion.x, force, b.block_area[number])
        return stress

    def _zone_state(self) -> tuple[np.ndarray, float]:
        z = self.skeleton.zones
        plastic = z.plastic if isinstance(z, PlasticZones) else None
        return zone_state(self.motion.x, z.triangles, z.gradient, z.area, z.lam, z.mu, plastic)

    def contacts(
        self, nodal: np.ndarray | None = None, among: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Touching pairs: out (n, 13) and ints (n, 2) as in `joints.contact_state`, and the stored energy [J/m].

        nodal : (contact nodes, 2), their forces, added to [N/m]; among : flags of the pairs that count, None: all
        """
        s, m, pairs = self.skeleton, self.motion, self.pairs
        node_motion(m.x, m.v, s.first, s.second, s.weight, s.follow, m.node, 0, len(m.node))
        if among is not None:
            pairs = Pairs(*(np.ascontiguousarray(values[among]) if len(values) else values for values in pairs))
        n = len(pairs.key)
        out, ints = np.zeros((n, 13)), np.zeros((n, 2), dtype=np.int64)
        fn = np.zeros((len(m.node), 2)) if nodal is None else nodal
        count, stored = contact_state(pairs, s.follow, m.node, self.joint_table, self.deepest, out, ints, fn)
        if among is not None:
            ints[:count, 0] = np.flatnonzero(among)[ints[:count, 0]]
        return out[:count], ints[:count], stored

    def loose_blocks(self) -> np.ndarray:
        """Mask (blocks,) of those on which, in the last step, no other block pushed, and that nothing holds."""
        pushed = self.held.any(axis=1) | self.motion.joint_force.any(axis=1)
        return np.bincount(self.bodies.vertex_block[pushed], minlength=len(self.bodies.block_area)) == 0

    def kinetic_energy(self, blocks: np.ndarray) -> float:
        """Kinetic energy [J/m] of the blocks of a mask (blocks,); for instance of all that are not loose."""
        there = blocks[self.bodies.vertex_block]
        z = self.skeleton.zones
        if isinstance(z, RigidBlocks):
            return float(kinetic_energies(z)[there[z.first[:-1]]].sum())
        v = np.where(there[:, None], self.motion.v, 0.0)
        return float(masses.kinetic_energies(self.skeleton.mass, self.motion.x, v).sum())

    def energies(self) -> dict[str, float]:
        """Energy ledger [J per m of thickness]; error = work put in - everything accounted for."""
        t = self.motion.ledger
        e = {
            "kinetic": float(t[KINETIC]),
            "strain": 0.0 if isinstance(self.skeleton.zones, RigidBlocks) else self._zone_state()[1],
            "joint": self.contacts()[2],
            "friction": float(t[FRICTION]),
            "plastic": float(t[PLASTIC]),
            "damping": float(t[DAMPED]),
            "boundary": float(t[WALL_WORK]),
            "external": float(t[LOAD_WORK]),
            "excavated": self.excavated,
        }
        gone = ("kinetic", "strain", "joint", "friction", "plastic", "damping", "excavated")
        e["error"] = e["boundary"] + e["external"] - sum(e[name] for name in gone)
        return e
