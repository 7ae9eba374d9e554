"""An assembly of spheres in a box with floor, sides and piston: state, neighbour list and time stepping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import NumericsFailed, Refused
from graben.mechanics.particles import motion
from graben.mechanics.particles.contacts import close_ledger
from graben.mechanics.particles.law import LinearLaw, critical_step
from graben.mechanics.particles.measures import list_contacts, survey
from graben.mechanics.particles.neighbours import carry_history, cell_order, grid_shape, half_list, wrap

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Survey:
    """Sums of the present state: energies in J, forces in N."""

    kinetic: float
    spinning: float
    elastic: float
    potential: float
    mean_contact_force: float
    mean_net_force: float
    contacts: int
    overlap: float  # largest overlap over the radius of the smaller body
    floor_push: float
    piston_push: float
    wall_lift: float  # vertical friction of the side walls on the particles
    step_over_critical: float

    @property
    def unbalanced(self) -> float:
        """Mean net force on a particle over the mean contact force; 0 in equilibrium."""
        return self.mean_net_force / self.mean_contact_force if self.mean_contact_force > 0.0 else np.inf


@dataclass(frozen=True)
class ContactForces:
    """pair (m, 2) identities, -1 in the second place for a wall; force (m, 3) N on the first; arm (m, 3) m from the
    centre of the first to the middle of the overlap (walls: to the wall)."""

    pair: Ints
    force: Floats
    arm: Floats


class Assembly:
    """Spheres in [0, width_x) x [0, width_y), floor at z = 0, open top or piston.

    Parameters
    ----------
    position : (n, 3) m; kind : (n,) class index into the tables of `law`
    width : (2,) m; periodic : sides repeat (True) or are hard walls
    gravity : m/s2, acts along -z; safety : time step over the estimated critical one
    skin : extra reach of the neighbour list over the smallest radius. It adapts while running, within [0.02, 0.4],
        so that lists live some fifty steps while grains fly and stay tight once they rest.

    Raises
    ------
    ValueError : arrays of wrong shape, no particle, particles outside, or a periodic box too narrow for its grains
    """

    def __init__(
        self,
        law: LinearLaw,
        position: Floats,
        kind: Ints,
        width: tuple[float, float],
        *,
        periodic: bool = True,
        gravity: float = 9.81,
        safety: float = 0.4,
        skin: float = 0.2,
    ) -> None:
        position = np.array(position, dtype=np.float64, order="C")
        kind = np.array(kind, dtype=np.int64)
        n = position.shape[0] if position.ndim == 2 else 0
        if position.shape != (n, 3) or n == 0:
            raise ValueError(f"position: expected shape (n, 3) with n >= 1, found {position.shape}")
        if kind.shape != (n,) or kind.min() < 0 or kind.max() >= law.radius.size:
            raise ValueError(f"kind: expected {n} class indices below {law.radius.size}, found shape {kind.shape}")
        if not np.all(np.isfinite(position)):
            raise ValueError("position: expected finite values")
        if not (0.0 < safety <= 1.0):
            raise ValueError(f"safety: expected a value in (0, 1], found {safety}")
        self.law, self.periodic, self.safety = law, bool(periodic), float(safety)
        self.width = np.array(width, dtype=np.float64)
        self.kind, self.radius = kind, np.ascontiguousarray(law.radius[kind])
        self._skin = float(skin) * float(law.radius.min())
        reach = 2.0 * float(self.radius.max()) + 0.4 * float(law.radius.min())
        if self.periodic and self.width.min() < 3.0 * reach:
            raise Refused(
                f"width: a periodic box needs at least {3.0 * reach:.6g} m (three of its largest grains), "
                f"found {self.width.min():.6g} m"
            )
        self.x, self.v, self.spin = position, np.zeros((n, 3)), np.zeros((n, 3))
        self.identity = np.arange(n)
        self.dt = self.safety * critical_step(law)
        self.drive = np.zeros(motion.DRIVES)
        self.drive[motion.GRAVITY] = gravity
        self.scalars = np.zeros(motion.SCALARS)
        self.ledger = np.zeros(motion.ENTRIES)
        self.place = np.array([0.0, self.width[0], 0.0, self.width[1], 0.0, 0.0])
        self.speed = np.zeros(motion.WALLS)
        self.wall_force = np.zeros(motion.WALLS)
        self.force, self.torque = np.zeros((n, 3)), np.zeros((n, 3) if law.rubs else (0, 3))
        self.wall_slip = np.zeros((n if law.rubs else 0, motion.WALLS, 3))
        self.first = np.zeros(n + 1, np.int64)
        self.partner = np.zeros(0, np.uint32)
        self.dash, self.slip = np.zeros(0), np.zeros((0, 3))
        self.start = self.x.copy()
        self.steps = 0
        self.rebuilds = 0
        self.pairs = 0
        self._steps_at_rebuild = 0
        self._capacity = 12 * n
        self._rebuild()

    # ---- neighbour list ----

    def _rebuild(self) -> None:
        self._close_ledger()
        if not np.all(np.isfinite(self.x)):
            raise NumericsFailed("positions are not finite", step=self.steps, advice="lower the time step safety")
        if self.periodic:
            wrap(self.x, self.width)
        lasted = self.steps - self._steps_at_rebuild
        smallest = float(self.law.radius.min())
        if self.rebuilds > 0:
            if lasted < 25:
                self._skin = min(1.5 * self._skin, 0.4 * smallest)
            elif lasted > 100:
                self._skin = max(0.7 * self._skin, 0.02 * smallest)
        cutoff = 2.0 * float(self.radius.max()) + self._skin
        low, high = self.x.min(axis=0), self.x.max(axis=0)
        if self.periodic:
            low[:2], high[:2] = 0.0, self.width
        reach = high - low
        if reach[2] > 1e4 * cutoff * self.x.shape[0] ** (1 / 3):
            raise NumericsFailed(
                f"a particle flew {reach[2]:.3g} m away", step=self.steps, advice="lower the time step safety"
            )
        counts = grid_shape(reach, cutoff)
        size = np.where(reach > 0.0, reach, cutoff) / counts
        order, start = cell_order(self.x, low, size, counts)
        old_first, old_partner, old_slip, old_identity = self.first, self.partner, self.slip, self.identity
        for name in ("x", "v", "radius", "kind", "identity", "force"):
            setattr(self, name, np.ascontiguousarray(getattr(self, name)[order]))
        if self.law.rubs:
            for name in ("spin", "wall_slip", "torque"):
                setattr(self, name, np.ascontiguousarray(getattr(self, name)[order]))
        n = self.x.shape[0]
        first = np.empty(n + 1, np.int64)
        while True:
            partner = np.empty(self._capacity, np.uint32)
            found = half_list(
                self.x, self.radius, self.width, self.periodic, start, counts, self._skin, first, partner
            )
            if found <= self._capacity:
                break
            self._capacity = found + found // 4
        self.first, self.partner, self.pairs = first, partner, int(found)
        self.dash = np.zeros(self._capacity)
        if self.law.rubs:
            self.slip = np.zeros((self._capacity, 3))
            place = np.empty(n, np.int64)
            place[old_identity] = np.arange(n)
            carry_history(old_first, old_partner, old_slip, place, self.identity, first, partner, self.slip)
        self.start = self.x.copy()
        self._steps_at_rebuild = self.steps
        self.rebuilds += 1

    def _close_ledger(self) -> None:
        if self.pairs:
            self.ledger[motion.DASHPOTS] += close_ledger(
                self.x, self.v, self.first, self.partner, self.dash, self.width, self.periodic, 0.5 * self.dt
            )

    # ---- running ----

    def advance(self, steps: int) -> None:
        """Run `steps` time steps."""
        law = self.law
        left = int(steps)
        while left > 0:
            done = motion.advance(
                left, self.dt, self.x, self.v, self.spin, self.radius, self.kind, self.first, self.partner, self.dash,
                self.slip, self.wall_slip, self.start, self.force, self.torque,
                law.mass, law.pair_kn, law.pair_cn, law.pair_kt, law.pair_ct, law.friction,
                law.wall_kn, law.wall_cn, law.wall_kt, law.wall_ct, law.wall_friction,
                law.rubs, self.periodic, self.width, self.drive, self.place, self.speed, self.scalars, self._skin,
                self.wall_force, self.ledger,
            )  # fmt: skip
            left -= done
            self.steps += done
            self._rebuild_if_moved()

    def _rebuild_if_moved(self) -> None:
        moved = float(np.max(np.einsum("ij,ij->i", self.x - self.start, self.x - self.start)))
        if not moved <= 0.25 * self._skin**2:
            self._rebuild()

    @property
    def time(self) -> float:
        return float(self.scalars[motion.TIME])

    def change_law(self, law: LinearLaw) -> None:
        """Go on with another law of the same classes (other damping, say); the time step follows."""
        if not np.array_equal(law.radius, self.law.radius) or law.rubs != self.law.rubs:
            raise ValueError("change_law: expected the same radii and friction either on or off in both laws")
        self._close_ledger()
        self.law = law
        self.dt = self.safety * critical_step(law)

    def shorten_step(self, factor: float) -> None:
        """Multiply the time step by a factor below 1."""
        if not 0.0 < factor < 1.0:
            raise ValueError(f"factor: expected a value between 0 and 1, found {factor}")
        self._close_ledger()
        self.dt *= factor

    # ---- drives ----

    def shake_floor(self, amplitude: float, frequency: float) -> None:
        """Move the floor as amplitude sin(2 pi frequency t) from now on; amplitude 0 stops it at z = 0."""
        self.drive[motion.SHAKE_AMPLITUDE] = amplitude
        self.drive[motion.SHAKE_OMEGA] = 2.0 * np.pi * frequency
        self.drive[motion.SHAKE_START] = self.time
        if amplitude == 0.0:
            self.place[motion.FLOOR] = self.speed[motion.FLOOR] = 0.0

    def set_piston(self, height: float, mass: float, damping: float, force: float, rate: float) -> None:
        """Put a plate at `height` that is pushed down by a force growing at `rate` (N/s) up to `force` (N).

        mass kg and damping N s/m are those of the plate: they steer how it finds its place, not where.
        """
        if not (mass > 0.0 and damping >= 0.0 and rate > 0.0):
            raise ValueError(f"piston: expected mass > 0, damping >= 0, rate > 0, found {mass}, {damping}, {rate}")
        d = self.drive
        d[motion.PISTON_ON], d[motion.PISTON_MASS], d[motion.PISTON_DAMPING] = 1.0, mass, damping
        d[motion.PISTON_FORCE], d[motion.PISTON_RATE] = force, rate
        self.scalars[motion.PISTON_PUSH] = 0.0
        self.place[motion.PISTON], self.speed[motion.PISTON] = height, 0.0

    # ---- measures ----

    def survey(self) -> tuple[Survey, Floats, Ints]:
        """Sums of the present state, the floor force of each particle (n,) N and its contacts (n,)."""
        n, law = self.x.shape[0], self.law
        floor_force, coordination, stiffness = np.empty(n), np.empty(n, np.int64), np.empty(n)
        out = survey(
            self.x, self.v, self.spin, self.radius, self.kind, law.mass, self.first, self.partner, self.slip,
            self.force, law.pair_kn, law.pair_kt, law.wall_kn, law.wall_kt, self.wall_slip, law.rubs, self.periodic,
            self.width, self.place, self.drive[motion.GRAVITY], self.drive[motion.PISTON_ON] > 0.0,
            floor_force, coordination, stiffness,
        )  # fmt: skip
        highest = 2.0 * float(np.max(stiffness / law.mass[self.kind]))
        if law.rubs:
            highest *= 1.0 + 7.0 * law.shear_ratio
        over = 0.0
        if highest > 0.0:
            omega = np.sqrt(highest)
            ratio = law.pair_cn / law.pair_kn
            xi = 0.5 * omega * float(ratio.max())
            over = self.dt / (2.0 / omega * (np.sqrt(1.0 + xi * xi) - xi))
        kinetic, spinning, elastic, potential, mean, net, count, overlap, floor, piston, walls = map(float, out)
        found = Survey(
            kinetic, spinning, elastic, potential, mean, net, int(count), overlap, floor, piston, walls, float(over),
        )  # fmt: skip
        return found, floor_force, coordination

    def contacts(self) -> tuple[Ints, Floats, Floats]:
        """Touching pairs as identities (m, 2), unit normals first to second (m, 3), spring forces (m,) N."""
        m = self.pairs
        pair, normal, push = np.empty((m, 2), np.int64), np.empty((m, 3)), np.empty(m)
        m = list_contacts(
            self.x, self.radius, self.kind, self.first, self.partner, self.law.pair_kn, self.width, self.periodic,
            pair, normal, push,
        )  # fmt: skip
        return self.identity[pair[:m]], normal[:m], push[:m]

    def contact_forces(self) -> ContactForces:
        """All contacts of the present state with spheres and walls, by identity: springs only, friction included."""
        law, pairs = self.law, self.pairs
        i = np.repeat(np.arange(self.x.shape[0]), np.diff(self.first))
        j = self.partner[:pairs].astype(np.int64)
        branch = self.x[j] - self.x[i]
        if self.periodic:
            branch[:, :2] -= self.width * np.rint(branch[:, :2] / self.width)
        distance = np.sqrt(np.einsum("ij,ij->i", branch, branch))
        overlap = self.radius[i] + self.radius[j] - distance
        touch = overlap > 0.0
        i, j, overlap, shear = i[touch], j[touch], overlap[touch], self.slip[:pairs][touch] if law.rubs else 0.0
        normal = branch[touch] / distance[touch, None]
        pair = [np.stack([self.identity[i], self.identity[j]], axis=1)]
        force = [shear - (law.pair_kn[self.kind[i], self.kind[j]] * overlap)[:, None] * normal]
        arm = [(self.radius[i] - 0.5 * overlap)[:, None] * normal]
        walls = range(4 if self.periodic else 0, 6 if self.drive[motion.PISTON_ON] > 0.0 else 5)
        for w in walls:
            axis, side = w // 2, 1.0 if w % 2 == 0 else -1.0
            overlap = self.radius - side * (self.x[:, axis] - self.place[w])
            i = np.flatnonzero(overlap > 0.0)
            normal = np.zeros((i.size, 3))
            normal[:, axis] = -side
            shear = self.wall_slip[i, w] if law.rubs else 0.0
            pair.append(np.stack([self.identity[i], np.full(i.size, -1)], axis=1))
            force.append(shear - (law.wall_kn[self.kind[i]] * overlap[i])[:, None] * normal)
            arm.append((self.radius[i] - overlap[i])[:, None] * normal)
        return ContactForces(*(np.concatenate(part) for part in (pair, force, arm)))

    def energy(self) -> dict[str, float]:
        """Every entry of the energy balance, J; `total` stays constant when the steps are exact."""
        self._close_ledger()
        s, _, _ = self.survey()
        plate = 0.5 * self.drive[motion.PISTON_MASS] * self.speed[motion.PISTON] ** 2
        kinetic = s.kinetic + s.spinning + plate
        lost = {
            "dashpots": self.ledger[motion.DASHPOTS],
            "friction": self.ledger[motion.FRICTION],
            "drag": self.ledger[motion.DRAG] + self.ledger[motion.PISTON_DASHPOT],
        }
        work = {"floor_work": self.ledger[motion.FLOOR_WORK], "piston_work": self.ledger[motion.PISTON_WORK]}
        total = kinetic + s.elastic + s.potential + sum(lost.values()) - sum(work.values())
        out = {"kinetic": kinetic, "elastic": s.elastic, "potential": s.potential, **lost, **work, "total": total}
        return {name: float(value) for name, value in out.items()}

    def by_identity(self, values: NDArray) -> NDArray:
        """Values (n, ...) in the present cell order, put back into the order in which particles were given."""
        out = np.empty_like(values)
        out[self.identity] = values
        return out
