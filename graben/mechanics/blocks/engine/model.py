"""A block model that can be stepped: constraints, strength and damping around the compiled loop.

It owns its state: what changes it is a method here, or of its loads in drive.py, and slots of the records are read
and written in this room only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graben.errors import NumericsFailed
from graben.mechanics.blocks.contact import search
from graben.mechanics.blocks.contact.joints import Joint, Pairs, joint_table
from graben.mechanics.blocks.contact.nodes import node_motion
from graben.mechanics.blocks.contact.sleeping import fresh_sleep
from graben.mechanics.blocks.engine import masses, motion, relaxation, setup
from graben.mechanics.blocks.engine.drive import DrivenModel
from graben.mechanics.blocks.engine.records import (
    DAMPED,
    DAMPING,
    KINETIC,
    LARGEST_OVERLAP,
    Rules,
    private,
)
from graben.mechanics.blocks.engine.threads import run_together, share_out
from graben.mechanics.blocks.shape.bodies import Bodies, chamfered_skin
from graben.mechanics.blocks.shape.partition import cut_into_parts
from graben.mechanics.blocks.zones.elastic import ElasticZones
from graben.mechanics.blocks.zones.plastic import LOST, PlasticZones, Strength, plastic_zones
from graben.mechanics.blocks.zones.rigid import RigidBlocks


@dataclass(frozen=True)
class Damping:
    """How motion is damped.

    ratio : adaptive global damping keeps its power at this ratio to the rate of kinetic energy; negative: the
    coefficient `coefficient` [1/s] stays (0: none). local : share of the unbalanced force, 0 to 1.
    """

    ratio: float = 0.5
    coefficient: float = 0.0
    local: float = 0.0


class BlockModel(DrivenModel):
    """Deformable blocks with Coulomb joints.

    Parameters: bodies; young [Pa], poisson, density [kg/m3]; joint; rounding [m] of corners.
    dt : time step [s]. Given, masses follow from stiffness so that this step is stable everywhere (density scaling,
    for slow loading); None: true masses, and dt from the estimate.
    gravity : (gx, gy) [m/s2], always with true masses.
    more_joints : sets 1, 2, ... beside `joint`, which is set 0; edge_set : (outline edges of the bodies,) set of each
    edge; set_between : (sets, sets) set that holds between edges of two sets, by default the lower of both.
    strength : at which zones yield; None: elastic
    platen_rock : Young's modulus [Pa] and Poisson's ratio of the platens among the bodies; None: those of the rock
    rigid : blocks do not deform; young, poisson and strength then count for nothing
    threads : more than 1 shares the work out to as many threads, with bitwise the same result.
    """

    def __init__(
        self,
        bodies: Bodies,
        *,
        young: float,
        poisson: float,
        density: float,
        joint: Joint,
        rounding: float,
        dt: float | None = None,
        gravity: tuple[float, float] = (0.0, 0.0),
        damping: Damping | None = None,
        intact: bool = True,
        threads: int = 1,
        more_joints: Sequence[Joint] = (),
        edge_set: np.ndarray | None = None,
        set_between: np.ndarray | None = None,
        strength: Strength | None = None,
        rigid: bool = False,
        platen_rock: tuple[float, float] | None = None,
    ) -> None:
        self.joints = self._given_joints = (joint, *more_joints)
        self._factor, self._spared = 1.0, False
        self.joint_table = joint_table(self.joints)
        rock = self._rock = setup.Rock(young, poisson, density, strength, rigid, platen_rock)
        setup.refuse_unsound(rock, self.joints)
        self.damping = damping or Damping()
        made = setup.zones_and_masses(bodies, rock, self.joints, dt, self.damping.local)
        given, self._set_of = setup.sets_of_edges(bodies, self.joints, edge_set, set_between)
        self.bodies = bodies
        self.skin = chamfered_skin(bodies, rounding)
        self.parts = cut_into_parts(bodies, self.skin)
        self._edge_material = given[self.skin.edge]
        self.threads = threads
        self.dt = made.dt
        self.zone_area, self.true_mass = made.area, made.true_mass
        self.masses, self.scaled = made.mass, dt is not None
        self.mass_ratio = made.mass.moving / np.add.reduceat(made.true_mass, made.mass.first[:-1])
        self.held = np.zeros((len(bodies.position), 2), dtype=bool)
        self.removed = np.zeros(len(bodies.block_area), dtype=bool)
        self.flown_at = np.full(len(bodies.block_area), np.inf)
        self.excavated = 0.0
        self.weight = self.true_mass[:, None] * np.asarray(gravity, dtype=float)[None, :]
        self.skeleton = setup.unloaded(self.skin, self.parts, made, self.weight)
        size = float(np.sqrt(np.median(bodies.block_area[: bodies.rock])))
        self.block_size = size
        self.reach = 0.08 * size
        self.near = 0.002 * size
        self.deepest = 0.1 * size
        # A vertex that crosses a block in a few dozen steps has run away.
        self.fastest = 0.02 * size / self.dt
        self.most_energy = 10.0 * float(np.median(made.mass.vertex)) * self.fastest**2
        self._low = bodies.position.min(axis=0) - size
        self._span = np.ptp(bodies.position, axis=0) + 2.0 * size
        self.motion = setup.at_rest(bodies, self.skin, self.parts)
        self.pairs: Pairs = search.no_pairs()
        self.steps_done = 0
        self.time = 0.0
        self.rebuilds = 0
        self._weigh()
        self.motion.drive[DAMPING] = self._first_coefficient(self.damping)
        self.rebuild(first=intact)

    def _first_coefficient(self, damping: Damping) -> float:
        return damping.coefficient if damping.ratio < 0 else 0.01 / self.dt

    def damp(self, damping: Damping) -> None:
        """Change the damping. Its coefficient goes on from where it is if it is adaptive before and after."""
        if damping.ratio < 0 or self.damping.ratio < 0:
            self.motion.drive[DAMPING] = self._first_coefficient(damping)
        self.damping = damping
        self._weigh()

    def rebuild(self, first: bool = False) -> None:
        """Find the candidate contacts anew; joints found at the `first` call are intact."""
        m, s, skin = self.motion, self.skeleton, self.skin
        node_motion(m.x, m.v, s.first, s.second, s.weight, s.follow, m.node, 0, len(m.node))
        if not np.all(np.isfinite(m.node)):
            raise NumericsFailed("a position is not finite", step=self.steps_done, advice=_SLOWER)
        slid = float(np.abs(self.pairs.slip).max()) if len(self.pairs.slip) else 0.0
        held = max(j.dilation * min(slid, j.dilation_limit) for j in self.joints)
        held += max(0.0, float(self.pairs.seat.max())) if len(self.pairs.seat) else 0.0
        cell = max(self.block_size, float(np.sqrt(self._span.prod() / (4.0 * len(s.first)))))
        nx, ny = (int(n) for n in np.maximum(1, np.ceil(self._span / cell)))
        keys = search.find_keys(
            m.node,
            s.follow,
            skin.block,
            self.reach + held,
            self.deepest,
            self._low,
            cell,
            nx,
            ny,
            self.pairs.key,
            self.pairs.live,
        )
        if self.bodies.platens:
            # Platens pass one another: those at the sides reach beyond the ends that move.
            platen, n = skin.block >= self.bodies.rock, len(skin.block)
            keys = keys[~(platen[keys // n] & platen[keys % n])]
        if self.removed.any():
            gone = self.removed[skin.block]
            keys = keys[~(gone[keys // len(gone)] | gone[keys % len(gone)])]
        self.pairs = search.carry_history(keys, len(s.first), self.pairs, self._edge_material, self._set_of)
        if first and any(j.tension > 0.0 or j.weakens for j in self.joints):
            search.bond_touching(self.pairs, m.node, skin.follow, 1e-6 * self.block_size)
        self.motion = m._replace(**fresh_sleep(self.pairs, self.parts, m.node, len(self.joints)))
        self.rebuilds += 1

    def advance(self, steps: int) -> None:
        """Take `steps` time steps. Raises NumericsFailed when something runs away or blocks overlap too far."""
        left = steps
        threads = min(self.threads, len(self.parts.node) - 1)
        sums = np.zeros((2, len(self.parts.node) - 1, motion.COLUMNS))
        while left > 0:
            m, s = self.motion, self.skeleton
            relaxation.begin(s, m, self.pairs)
            plan = share_out(self.parts, m.far_start, m.post_start, m.post, threads)
            rest = (left, s, self.parts, self.pairs, self.joint_table, self._rules())
            own = [m] + [private(m) for _ in range(1, threads)]
            status, done, where = run_together(relaxation.advance, [(plan, sums, mine, *rest) for mine in own])
            relaxation.end(m, self.pairs)
            left -= done
            self.steps_done += done
            self.time += done * self.dt
            self._refuse_lost_zones()
            if status == relaxation.REBUILD:
                if done == 0 and not np.isfinite(self.motion.x).all():
                    raise NumericsFailed("a position is not finite", step=self.steps_done, advice=_SLOWER)
                self._stop_flying()
                self.rebuild()
            elif status == relaxation.RUNAWAY:
                flew = self._stop_flying()
                speed = np.hypot(*self.motion.v.T)
                if flew and speed.max() < self.fastest:
                    continue
                worst = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
                raise NumericsFailed(
                    f"speed {speed[worst]:.3g} m/s (some {self.fastest:.3g} m/s is the most a step can follow)",
                    where=f"block {self.bodies.vertex_block[worst]}",
                    step=self.steps_done,
                    advice=_SLOWER,
                )
            elif status == relaxation.DEEP_OVERLAP:
                a, b = (int(self.skin.block[k[where]]) for k in (self.pairs.first, self.pairs.second))
                raise NumericsFailed(
                    f"overlap {self.largest_overlap:.3g} m (limit {self.deepest:.3g} m)",
                    where=f"blocks {a} and {b}",
                    step=self.steps_done,
                    advice="raise the normal stiffness of the joints or take more steps",
                )

    def _rules(self) -> Rules:
        return Rules(
            dt=self.dt,
            reach=self.reach,
            near=self.near,
            dilation=float(max(j.dilation for j in self.joints)),
            deepest=self.deepest,
            most_energy=self.most_energy,
            damping_ratio=float(self.damping.ratio),
            damping_limit=0.5 / self.dt,
            local=float(self.damping.local),
        )

    def _refuse_lost_zones(self) -> None:
        z = self.skeleton.zones
        if isinstance(z, PlasticZones) and (z.flag == LOST).any():
            block = self.bodies.zone_block[int(np.argmax(z.flag == LOST))]
            raise NumericsFailed(
                "no stress within the strength of a zone",
                where=f"block {block}",
                step=self.steps_done,
                advice=_SLOWER,
            )

    def hold(self, vertices: np.ndarray, axis: int, speed: float = 0.0) -> None:
        """Prescribe the velocity [m/s] of vertices (indices or mask) along an axis (0: x, 1: y)."""
        self.held[vertices, axis] = True
        self.skeleton.wall[vertices, axis] = speed
        self.list_held()

    def weaken(self, factor: float) -> None:
        """Strength of joints and zones as given, over a factor: tan(friction), cohesion and tension.

        Dilation stays, but for what exceeds the friction: such joints would give energy away.
        """
        self._factor = factor
        self._set_joints()
        zones, strength = self.skeleton.zones, self._rock.strength
        if isinstance(zones, PlasticZones) and strength is not None:
            young, poisson = self._rock.young, self._rock.poisson
            like = plastic_zones(ElasticZones(*zones[:5]), young, poisson, strength.weaker(factor))
            self.skeleton = self.skeleton._replace(zones=zones._replace(par=like.par, bounds=like.bounds))

    def spare_joints(self, spared: bool) -> None:
        """While spared, joints keep their first strength: they weaken from the first state on.

        A body that is put under its loads has joints without stress, which any force would break.
        """
        self._spared = spared
        self._set_joints()

    def _set_joints(self) -> None:
        joints = [j.weaker(self._factor) for j in self._given_joints]
        if self._spared:
            joints = [j._replace(residual_friction=-1.0, residual_cohesion=-1.0) for j in joints]
        self.joints = tuple(joints)
        self.joint_table = joint_table(self.joints)

    def release(self, vertices: np.ndarray, axis: int) -> None:
        """Let vertices move freely along an axis again."""
        self.held[vertices, axis] = False
        self.skeleton.wall[vertices, axis] = 0.0
        self.list_held()
        self.motion.reaction[vertices, axis] = 0.0

    def list_held(self) -> None:
        """After `held` changed: vertices and axes in the order of the parts."""
        if len(self.skeleton.still) != self.held.sum() or not self.held[tuple(self.skeleton.still.T)].all():
            still = np.argwhere(self.held)
            start = np.searchsorted(still[:, 0], self.parts.vertex).astype(np.int64)
            self.skeleton = self.skeleton._replace(still=still, still_start=start)
            self._weigh()

    def _weigh(self) -> None:
        """Masses by constraints and damping; local damping looks at vertices, not at blocks."""
        local = self.damping.local
        mass = self.masses.plain(local, self.scaled) if local > 0.0 else self.masses.held(self.skeleton.still[:, 0])
        self.skeleton = self.skeleton._replace(mass=mass, gains=masses.gains(mass, self.dt))

    def add_time(self, seconds: float) -> None:
        """Time of loading that the last steps stood for beyond their own."""
        self.time += seconds

    def put_stress(self, gradient: np.ndarray, area: np.ndarray, pairs: Pairs) -> None:
        """Zones and joints carry stress from the start.

        gradient : (zones, 3, 2) [1/m], area : (zones,) [m2] of the unstressed zones; pairs : candidates with stress
        """
        z = self.skeleton.zones
        self.skeleton = self.skeleton._replace(zones=z._replace(gradient=gradient, area=area))
        self.pairs = pairs
        self.rebuild()

    def remove(self, blocks: np.ndarray) -> np.ndarray:
        """Take out blocks (flags); returns the forces (vertices, 2) [N/m] with which they held the others until now.

        They lose zones, contacts, loads and weight, and stay behind as fixed ghosts: numbers of blocks, zones and
        vertices do not change. What they stored and moved with leaves the ledger as `excavated`.
        """
        m, s = self.motion, self.skeleton
        there = blocks[self.bodies.vertex_block]
        forces, stored, kinetic = self.contact_force(), self._stored(), self.kinetic_energy(blocks)
        self.removed |= blocks
        self.forget_removed()
        m.v[there] = 0.0
        m.ledger[KINETIC] -= kinetic
        for force in (s.steady, s.rising, m.zone_force, m.joint_force):
            force[there] = 0.0
        for axis in (0, 1):
            self.hold(there, axis)
        m.reaction[there] = 0.0
        self.rebuild()
        self.excavated += stored - self._stored() + kinetic
        forces -= self.contact_force()
        forces[there] = 0.0
        self.motion.joint_force[:] -= forces
        return forces

    def forget_removed(self) -> None:
        """Zones and weight of removed blocks count for nothing."""
        self.skeleton.zones.area[self.removed[self.bodies.zone_block]] = 0.0
        self.weight[self.removed[self.bodies.vertex_block]] = 0.0

    def _stored(self) -> float:
        e = self.energies()
        return e["strain"] + e["joint"]

    def calm_loose_blocks(self) -> np.ndarray:
        """Stop the loose blocks where they are; what they moved with counts as damped. Returns their mask.

        For slow loading without gravity, where a block that is pressed out flies on for ever.
        """
        loose = self.loose_blocks()
        self._stop(loose)
        return loose

    def _stop(self, blocks: np.ndarray) -> None:
        """Stop blocks (flags) where they are; what they moved with counts as damped.

        Only their rigid motion is taken: a vibration close to the limit of the step, stopped over and over, grows.
        """
        energy = self.kinetic_energy(blocks)
        there = blocks[self.bodies.vertex_block]
        self.motion.v[there] -= self._rigid_motion()[there]
        if isinstance(self.skeleton.zones, RigidBlocks):
            self.skeleton.zones.stop(there)
        energy -= self.kinetic_energy(blocks)
        self.motion.ledger[KINETIC] -= energy
        self.motion.ledger[DAMPED] += energy

    def _rigid_motion(self) -> np.ndarray:
        m = self.motion
        if isinstance(self.skeleton.zones, RigidBlocks):
            return m.v.copy()
        return masses.rigid_motion(self.skeleton.mass, m.x, m.v, self.held)

    def _stop_flying(self) -> bool:
        """Whether blocks without weight flew off, and were stopped: dead loads alone drive them.

        No other block touches them, and they are free along an axis at least: rollers guide some.
        """
        if self.weight.any():
            return False
        block, count = self.bodies.vertex_block, len(self.removed)
        touched = self.motion.joint_force.any(axis=1) | self.held.all(axis=1)
        fast = np.hypot(*self._rigid_motion().T) > _FLIGHT * self.fastest
        flying = (np.bincount(block, fast, count) > 0) & (np.bincount(block, touched, count) == 0)
        if flying.any():
            self._stop(flying)
            self.flown_at[flying] = np.minimum(self.flown_at[flying], self.time)
        return bool(flying.any())

    def begin_ledger(self) -> None:
        """From now on work and losses count from nothing."""
        overlap = self.largest_overlap
        self.motion.ledger[:] = 0.0
        self.motion.ledger[LARGEST_OVERLAP] = overlap


# Share of the speed that a step can follow; walls of a slow test move a hundred times slower.
_FLIGHT = 0.1

_SLOWER = "take more steps (slower loading or a smaller time step) or look at that block's shape"
