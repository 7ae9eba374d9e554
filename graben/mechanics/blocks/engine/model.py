"""A block model that can be stepped: properties, masses, constraints and loads around the compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.blocks.contact import search
from graben.mechanics.blocks.contact.joints import RIM_SHARE, STICK, Joint, Pairs, contact_state, joint_table
from graben.mechanics.blocks.contact.nodes import COLUMNS, RIM, TX, TY, node_motion, scatter_nodes
from graben.mechanics.blocks.contact.sleeping import fresh_sleep
from graben.mechanics.blocks.engine import motion
from graben.mechanics.blocks.engine import relaxation as rx
from graben.mechanics.blocks.engine.threads import run_together, share_out
from graben.mechanics.blocks.shape.bodies import Bodies, Skin, chamfered_skin
from graben.mechanics.blocks.shape.partition import cut_into_parts, runs
from graben.mechanics.blocks.zones.elastic import ElasticZones, lame, shape_gradients, stiffness_row_sums, zone_state
from graben.mechanics.blocks.zones.plastic import EQUIVALENT, LOST, PlasticZones, Strength, plastic_zones
from graben.mechanics.blocks.zones.rigid import (
    RigidBlocks,
    block_stress,
    kinetic_energies,
    rigid_blocks,
    stiffest_motion,
)
from graben.mechanics.cache_lines import aligned


@dataclass(frozen=True)
class Damping:
    """How motion is damped.

    ratio : adaptive global damping keeps its power at this ratio to the rate of kinetic energy; negative: the
    coefficient `coefficient` [1/s] stays (0: none). local : share of the unbalanced force, 0 to 1.
    """

    ratio: float = 0.5
    coefficient: float = 0.0
    local: float = 0.0


# Time step over the estimate 2 / omega of the stiffest vertex (row sums bound omega from above).
SAFETY = 0.9


class BlockModel:
    """Deformable blocks with Coulomb joints.

    Parameters: bodies; young [Pa], poisson, density [kg/m3]; joint; rounding [m] of corners.
    dt : time step [s]. Given, masses follow from stiffness so that this step is stable everywhere (density scaling,
    for slow loading); None: true masses, and dt from the estimate.
    gravity : (gx, gy) [m/s2], always with true masses.
    more_joints : sets 1, 2, ... beside `joint`, which is set 0; edge_set : (outline edges of the bodies,) set of each
    edge; set_between : (sets, sets) set that holds between edges of two sets, by default the lower of both.
    strength : at which zones yield; None: elastic
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
    ) -> None:
        kn = min(j.normal_stiffness for j in (joint, *more_joints))
        for name, value in (("young", young), ("density", density), ("kn", kn)):
            if not value > 0.0:
                raise Refused(f"{name} must be positive, found {value}")
        if not -1.0 < poisson < 0.5:
            raise Refused(f"poisson must lie between -1 and 0.5, found {poisson}")
        self.bodies = bodies
        self.joint = joint
        self.joints: tuple[Joint, ...] = (joint, *more_joints)
        self.joint_table = joint_table(self.joints)
        self.damping = damping or Damping()
        self.skin: Skin = chamfered_skin(bodies, rounding)
        self.parts = cut_into_parts(bodies, self.skin)
        nv, nn = len(bodies.position), len(self.skin.first)
        gradient, self.zone_area = shape_gradients(bodies.position, bodies.zone_vertex)
        lam, mu = lame(young, poisson)
        area = self.zone_area
        lam_z, mu_z = np.full(len(area), lam), np.full(len(area), mu)
        self.true_mass = np.bincount(
            bodies.zone_vertex.ravel(), weights=np.repeat(density * area / 3.0, 3), minlength=nv
        )
        elastic = ElasticZones(bodies.zone_vertex.astype(np.int32), gradient, area, lam_z, mu_z)
        law: ElasticZones | PlasticZones | RigidBlocks = elastic
        if rigid:
            law = rigid_blocks(bodies, density, area, runs(bodies.vertex_block)[1])
            owner = np.repeat(np.arange(len(law.place)), np.diff(law.first))
            stiffness = self.true_mass * (self._block_stiffness(law) / law.inertia[:, 0])[owner]
        else:
            stiffness = self._vertex_stiffness(gradient, area, lam_z, mu_z)
        if strength is not None and not rigid:
            law = plastic_zones(elastic, young, poisson, strength)
        if dt is None:
            self.dt = float(SAFETY * np.sqrt(4.0 * self.true_mass / stiffness).min())
            mass = self.true_mass.copy()
        else:
            self.dt = float(dt)
            mass = stiffness * dt**2 / (4.0 * SAFETY**2)
            if isinstance(law, RigidBlocks):
                law.inertia[:, 0] *= (mass / self.true_mass)[law.first[:-1]]
        sets = np.arange(len(self.joints))
        given = np.zeros(len(bodies.edge_from)) if edge_set is None else np.asarray(edge_set)
        between = np.minimum.outer(sets, sets) if set_between is None else np.asarray(set_between)
        if given.shape != bodies.edge_from.shape or not np.isin(given, sets).all():
            raise Refused(f"edge_set: expected {len(bodies.edge_from)} numbers of joint sets (0 to {sets[-1]})")
        if between.shape != (len(sets),) * 2 or not np.isin(between, sets).all() or np.any(between != between.T):
            raise ValueError(f"set_between: expected a symmetric table {len(sets)} x {len(sets)} of joint sets")
        self._edge_material = given.astype(np.int64)[self.skin.edge]
        self._set_of = np.ascontiguousarray(between, dtype=np.int64)
        self.threads = threads
        self.held = np.zeros((nv, 2), dtype=bool)
        self.removed = np.zeros(len(bodies.block_area), dtype=bool)
        self.excavated = 0.0
        self.weight = self.true_mass[:, None] * np.asarray(gravity, dtype=float)[None, :]
        self.mass_ratio = mass / self.true_mass
        self.skeleton = rx.Skeleton(
            law,
            self.skin.first.astype(np.int32),
            self.skin.second.astype(np.int32),
            self.skin.weight,
            self.skin.follow.astype(np.int32),
            mass,
            np.empty((0, 2), dtype=np.int64),
            np.zeros(len(self.parts.node), dtype=np.int64),
            np.zeros((nv, 2)),
            self.weight.copy(),
            np.zeros((nv, 2)),
        )
        size = float(np.sqrt(np.median(bodies.block_area)))
        self.block_size = size
        self.reach = 0.08 * size
        self.near = 0.002 * size
        self.deepest = 0.1 * size
        self.motion = rx.Motion(
            bodies.position.copy(),
            np.zeros((nv, 2)),
            np.zeros((nv, 2)),
            np.zeros((nv, 2)),
            np.zeros((nv, 2)),
            aligned(nn, COLUMNS),
            aligned(nn, 2),
            np.zeros(6),
            np.zeros(3),
            np.zeros(5),
            **fresh_sleep(search.no_pairs(), self.parts, np.zeros((nn, COLUMNS))),
        )
        x, k = bodies.position, self.skin
        point = x[k.first] + k.weight[:, None] * (x[k.second] - x[k.first])
        length = np.linalg.norm(point[k.follow] - point, axis=1)
        self.motion.node[:, RIM] = np.where(k.is_chamfer, RIM_SHARE * length, 0.0)
        self.pairs: Pairs = search.no_pairs()
        self.steps_done = 0
        self.time = 0.0
        self.rebuilds = 0
        # A vertex that crosses a block in a few dozen steps has run away.
        self.fastest = 0.02 * size / self.dt
        self.most_energy = 10.0 * float(np.median(mass)) * self.fastest**2
        self._low = bodies.position.min(axis=0) - size
        self._span = np.ptp(bodies.position, axis=0) + 2.0 * size
        self.motion.drive[rx.DAMPING] = self._first_coefficient(self.damping)
        self.rebuild(first=intact)

    def _first_coefficient(self, damping: Damping) -> float:
        return damping.coefficient if damping.ratio < 0 else 0.01 / self.dt

    def damp(self, damping: Damping) -> None:
        """Change the damping. Its coefficient goes on from where it is if it is adaptive before and after."""
        if damping.ratio < 0 or self.damping.ratio < 0:
            self.motion.drive[rx.DAMPING] = self._first_coefficient(damping)
        self.damping = damping

    def _vertex_stiffness(self, gradient, area, lam, mu) -> np.ndarray:
        """Bound on the stiffness that a vertex sees, from zones and from the joints along its edges [N/m per m]."""
        rows = stiffness_row_sums(gradient, area, lam, mu)
        total = np.bincount(self.bodies.zone_vertex.ravel(), weights=rows.ravel())
        b = self.bodies
        length = np.linalg.norm(b.position[b.edge_to] - b.position[b.edge_from], axis=1)
        # An edge holds half its length at each end, against another block: twice in a row sum. Sliding blocks
        # can face two others, so the half counts in full.
        k = 2.0 * max(max(j.stiffest, j.shear_stiffness) for j in self.joints)
        np.add.at(total, b.edge_from, k * length)
        np.add.at(total, b.edge_to, k * length)
        return total

    def _block_stiffness(self, blocks: RigidBlocks) -> np.ndarray:
        return stiffest_motion(self.bodies, blocks, max(max(j.stiffest, j.shear_stiffness) for j in self.joints))

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
        if self.removed.any():
            gone = self.removed[skin.block]
            keys = keys[~(gone[keys // len(gone)] | gone[keys % len(gone)])]
        self.pairs = search.carry_history(keys, len(s.first), self.pairs, self._edge_material, self._set_of)
        if first and any(j.tension > 0.0 or j.weakens for j in self.joints):
            self._bond()
        self.motion = m._replace(**fresh_sleep(self.pairs, self.parts, m.node, len(self.joints)))
        self.rebuilds += 1

    def _bond(self) -> None:
        """Mark as intact the pairs that face each other without a gap."""
        p, node, follow = self.pairs, self.motion.node, self.skin.follow
        facing = -(node[p.first, TX] * node[p.second, TX] + node[p.first, TY] * node[p.second, TY])
        normal = np.column_stack([node[p.first, TY], -node[p.first, TX]])
        far = np.zeros(len(p.key))
        for end in (p.second, follow[p.second]):
            gap = ((node[end, :2] - node[p.first, :2]) * normal).sum(axis=1)
            far = np.maximum(far, np.abs(gap))
        whole = (facing > 0.9999) & (far < 1e-6 * self.block_size)
        p.intact[whole] = 1
        p.flag[whole] = STICK

    def advance(self, steps: int) -> None:
        """Take `steps` time steps. Raises NumericsFailed when something runs away or blocks overlap too far."""
        left = steps
        threads = min(self.threads, len(self.parts.node) - 1)
        sums = np.zeros((2, len(self.parts.node) - 1, motion.COLUMNS))
        while left > 0:
            m, s = self.motion, self.skeleton
            rx.begin(s, m, self.pairs)
            plan = share_out(self.parts, m.far_start, m.post_start, m.post, threads)
            rest = (
                left,
                s,
                self.parts,
                self.pairs,
                self.joint_table,
                self.dt,
                self.reach,
                self.near,
                max(j.dilation for j in self.joints),
                self.deepest,
                self.damping.ratio,
                0.5 / self.dt,
                self.damping.local,
                self.most_energy,
            )
            own = [m] + [rx.private(m) for _ in range(1, threads)]
            status, done, where = run_together(rx.advance, [(plan, sums, mine, *rest) for mine in own])
            rx.end(m, self.pairs)
            left -= done
            self.steps_done += done
            self.time += done * self.dt
            self._refuse_lost_zones()
            if status == rx.REBUILD:
                if done == 0 and self._stuck():
                    raise NumericsFailed("a position is not finite", step=self.steps_done, advice=_SLOWER)
                self.rebuild()
            elif status == rx.RUNAWAY:
                speed = np.hypot(*self.motion.v.T)
                worst = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
                raise NumericsFailed(
                    f"speed {speed[worst]:.3g} m/s (some {self.fastest:.3g} m/s is the most a step can follow)",
                    where=f"block {self.bodies.vertex_block[worst]}",
                    step=self.steps_done,
                    advice=_SLOWER,
                )
            elif status == rx.DEEP_OVERLAP:
                a, b = (int(self.skin.block[k[where]]) for k in (self.pairs.first, self.pairs.second))
                raise NumericsFailed(
                    f"overlap {self.motion.sums[rx.LARGEST_OVERLAP]:.3g} m (limit {self.deepest:.3g} m)",
                    where=f"blocks {a} and {b}",
                    step=self.steps_done,
                    advice="raise the normal stiffness of the joints or take more steps",
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

    def _stuck(self) -> bool:
        return not bool(np.all(np.isfinite(self.motion.x)))

    def hold(self, vertices: np.ndarray, axis: int, speed: float = 0.0) -> None:
        """Prescribe the velocity [m/s] of vertices (indices or mask) along an axis (0: x, 1: y)."""
        self.held[vertices, axis] = True
        self.skeleton.wall[vertices, axis] = speed
        self._list_held()

    def release(self, vertices: np.ndarray, axis: int) -> None:
        """Let vertices move freely along an axis again."""
        self.held[vertices, axis] = False
        self.skeleton.wall[vertices, axis] = 0.0
        self._list_held()
        self.motion.reaction[vertices, axis] = 0.0

    def _list_held(self) -> None:
        if len(self.skeleton.still) != self.held.sum() or not self.held[tuple(self.skeleton.still.T)].all():
            still = np.argwhere(self.held)
            start = np.searchsorted(still[:, 0], self.parts.vertex).astype(np.int64)
            self.skeleton = self.skeleton._replace(still=still, still_start=start)

    def press(self, edges: np.ndarray, normal_stress: float, rising: bool = False) -> None:
        """Add a normal stress [Pa, tension positive] on outline edges (indices or mask), as steady or rising load.

        The force keeps the direction and the length that the edges have now.
        """
        b, x = self.bodies, self.motion.x
        a, c = b.edge_from[edges], b.edge_to[edges]
        d = x[c] - x[a]
        half = 0.5 * normal_stress * np.column_stack([d[:, 1], -d[:, 0]])
        target = self.skeleton.rising if rising else self.skeleton.steady
        np.add.at(target, a, half)
        np.add.at(target, c, half)

    def boundary_force(self) -> np.ndarray:
        """Forces (vertices, 2) of walls and pressures on the blocks [N/m]; gravity is none of them."""
        s, m = self.skeleton, self.motion
        load = s.steady + m.drive[rx.LOAD] * s.rising - self.weight
        return load + np.where(self.held, m.reaction, 0.0)

    def unbalanced_ratio(self) -> float:
        """Largest unbalanced force on a free vertex over the mean size of zone forces."""
        scale = float(np.abs(self.motion.zone_force).mean())
        return float(np.abs(self.unbalanced_force()).max()) / scale if scale > 0.0 else np.inf

    def unbalanced_force(self) -> np.ndarray:
        """What is left of the forces (vertices, 2) on free vertices [N/m]; of loose blocks nothing, they fly."""
        s, m = self.skeleton, self.motion
        load = s.steady + m.drive[rx.LOAD] * s.rising
        out = self.held | self.loose_blocks()[self.bodies.vertex_block, None]
        return np.where(out, 0.0, m.zone_force + m.joint_force + load)

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

    def contacts(self, nodal: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, float]:
        """Touching pairs: out (n, 13) and ints (n, 2) as in `joints.contact_state`, and the stored energy [J/m].

        nodal : (contact nodes, 2), their forces, added to [N/m]
        """
        s, m = self.skeleton, self.motion
        node_motion(m.x, m.v, s.first, s.second, s.weight, s.follow, m.node, 0, len(m.node))
        n = len(self.pairs.key)
        out, ints = np.zeros((n, 13)), np.zeros((n, 2), dtype=np.int64)
        fn = np.zeros((len(m.node), 2)) if nodal is None else nodal
        count, stored = contact_state(self.pairs, s.follow, m.node, self.joint_table, self.deepest, out, ints, fn)
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
        return float(0.5 * (self.skeleton.mass[there, None] * self.motion.v[there] ** 2).sum())

    def calm_loose_blocks(self) -> np.ndarray:
        """Stop the loose blocks where they are; what they moved with counts as damped. Returns their mask.

        For slow loading without gravity, where a block that is pressed out flies on for ever.
        """
        loose = self.loose_blocks()
        energy = self.kinetic_energy(loose)
        there = loose[self.bodies.vertex_block]
        self.motion.v[there] = 0.0
        if isinstance(self.skeleton.zones, RigidBlocks):
            self.skeleton.zones.stop(there)
        self.motion.tally[rx.KINETIC] -= energy
        self.motion.tally[rx.DAMPED] += energy
        return loose

    def energies(self) -> dict[str, float]:
        """Energy ledger [J per m of thickness]; error = work put in - everything accounted for."""
        m, t = self.motion, self.motion.tally
        e = {
            "kinetic": float(t[rx.KINETIC]),
            "strain": 0.0 if isinstance(self.skeleton.zones, RigidBlocks) else self._zone_state()[1],
            "joint": self.contacts()[2],
            "friction": float(m.sums[rx.FRICTION]),
            "plastic": float(m.sums[rx.PLASTIC]),
            "damping": float(t[rx.DAMPED]),
            "boundary": float(t[rx.WALL_WORK]),
            "external": float(t[rx.LOAD_WORK]),
            "excavated": self.excavated,
        }
        gone = ("kinetic", "strain", "joint", "friction", "plastic", "damping", "excavated")
        e["error"] = e["boundary"] + e["external"] - sum(e[name] for name in gone)
        return e

    def begin_ledger(self) -> None:
        """From now on work and losses count from nothing."""
        self.motion.tally[:] = 0.0
        self.motion.sums[[rx.FRICTION, rx.PLASTIC]] = 0.0


_SLOWER = "take more steps (slower loading or a smaller time step) or look at that block's shape"
