"""An assembly of spheres between walls: its records, neighbour list and time stepping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import NumericsFailed, Refused
from graben.mechanics.particles import motion, records
from graben.mechanics.particles.contacts import close_ledger
from graben.mechanics.particles.law import LinearLaw, critical_step
from graben.mechanics.particles.measures import list_contacts, survey
from graben.mechanics.particles.neighbours import carry_history, cell_order, grid_shape, half_list, wrap
from graben.mechanics.particles.records import Bodies, Contacts, Drive, Loads, Walls
from graben.mechanics.particles.walls import box_walls, joined, level_of, planes, with_slip

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
    """Spheres in [0, width_x) x [0, width_y), floor at z = 0, open top or piston; or between walls of any table.

    Parameters
    ----------
    position : (n, 3) m; kind : (n,) class index into the tables of `law`
    width : (2,) m; periodic : sides repeat (True) or are hard walls
    gravity : m/s2, acts along -z, or a vector (3,)
    safety : time step over the estimated critical one
    skin : extra reach of the neighbour list over the smallest radius. It adapts while running, within [0.02, 0.4],
        so that lists live some fifty steps while grains fly and stay tight once they rest.
    walls : a table made by `walls.planes`, sides first and the floor last, in place of those of the box

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
        gravity: float | Floats = 9.81,
        safety: float = 0.4,
        skin: float = 0.2,
        walls: Walls | None = None,
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
        self.law, self.safety = law, float(safety)
        self.width = np.array(width, dtype=np.float64)
        self.period = self.width if periodic else None
        radius = law.radius[kind]
        reach = 2.0 * float(radius.max()) + 0.4 * float(law.radius.min())
        if periodic and self.width.min() < 3.0 * reach:
            raise Refused(
                f"width: a periodic box needs at least {3.0 * reach:.6g} m (three of its largest grains), "
                f"found {self.width.min():.6g} m"
            )
        still = np.zeros((n, 3))
        self.bodies = Bodies(position, still, still.copy(), radius, law.mass[kind], kind, np.arange(n))
        self.walls = box_walls(self.width, periodic) if walls is None else walls
        if not 0 <= self.walls.kind.min() <= self.walls.kind.max() < law.walls.kn.shape[1]:
            raise ValueError(f"walls: expected law classes below {law.walls.kn.shape[1]}, found {self.walls.kind}")
        if law.rubs:
            self.walls = with_slip(self.walls, n)
        self.loads = Loads(np.zeros((n, 3)), np.zeros((n, 3)) if law.rubs else None)
        none = np.zeros((0, 3)) if law.rubs else None
        skin = float(skin) * float(law.radius.min())
        self.contacts = Contacts(
            np.zeros(n + 1, np.int64), np.zeros(0, np.uint32), np.zeros(0), none, position.copy(), skin
        )
        down = np.array([0.0, 0.0, -gravity]) if np.ndim(gravity) == 0 else np.array(gravity, dtype=np.float64)
        floor = len(self.walls.point) - 1
        self.drive = Drive(down, floor, shake_home=level_of(self.walls, floor))
        self.clock, self.ledger = np.zeros(records.HANDS), np.zeros(records.ENTRIES)
        self.dt = self.safety * critical_step(law)
        self.steps = 0
        self.rebuilds = 0
        self._steps_at_rebuild = 0
        self._capacity = 12 * n
        self._rebuild()

    # ---- neighbour list ----

    @property
    def pairs(self) -> int:
        """Pairs in the neighbour list."""
        return int(self.contacts.first[-1])

    def _rebuild(self) -> None:
        self._close_ledger()
        x, old = self.bodies.position, self.contacts
        if not np.all(np.isfinite(x)):
            raise NumericsFailed("positions are not finite", step=self.steps, advice="lower the time step safety")
        if self.period is not None:
            wrap(x, self.period)
        skin = self._next_skin()
        cutoff = 2.0 * float(self.bodies.radius.max()) + skin
        low, high = x.min(axis=0), x.max(axis=0)
        if self.period is not None:
            low[:2], high[:2] = 0.0, self.period
        reach = high - low
        if np.any(reach > 1e4 * cutoff * x.shape[0] ** (1 / 3) + np.append(self.width, 0.0)):
            raise NumericsFailed(
                f"a particle flew {reach.max():.3g} m away", step=self.steps, advice="lower the time step safety"
            )
        counts = grid_shape(reach, cutoff)
        order, start = cell_order(x, low, np.where(reach > 0.0, reach, cutoff) / counts, counts)
        old_identity = self.bodies.identity
        bodies = self.bodies = self.bodies.sorted(order)
        torque = self.loads.torque
        self.loads = Loads(self.loads.force[order], None if torque is None else torque[order])
        if self.walls.slip is not None:
            self.walls = self.walls._replace(slip=self.walls.slip[order])
        n = x.shape[0]
        first = np.empty(n + 1, np.int64)
        while True:
            partner = np.empty(self._capacity, np.uint32)
            found = half_list(bodies, self.period, start, counts, skin, first, partner)
            if found <= self._capacity:
                break
            self._capacity = found + found // 4
        slip = None
        if old.slip is not None:
            slip = np.zeros((self._capacity, 3))
            place = np.empty(n, np.int64)
            place[old_identity] = np.arange(n)
            carry_history(old, place, bodies.identity, first, partner, slip)
        self.contacts = Contacts(first, partner, np.zeros(self._capacity), slip, bodies.position.copy(), skin)
        self._steps_at_rebuild = self.steps
        self.rebuilds += 1

    def _next_skin(self) -> float:
        """m, from how long the last list lasted."""
        skin, smallest = self.contacts.skin, float(self.law.radius.min())
        lasted = self.steps - self._steps_at_rebuild
        if self.rebuilds > 0:
            if lasted < 25:
                return min(1.5 * skin, 0.4 * smallest)
            if lasted > 100:
                return max(0.7 * skin, 0.02 * smallest)
        return skin

    def _close_ledger(self) -> None:
        if self.pairs:
            self.ledger[records.DASHPOTS] += close_ledger(self.bodies, self.contacts, self.period, 0.5 * self.dt)

    # ---- running ----

    def advance(self, steps: int) -> None:
        """Run `steps` time steps."""
        left = int(steps)
        while left > 0:
            done = motion.advance(
                left, self.dt, self.bodies, self.contacts, self.walls, self.loads, self.law.tables, self.drive,
                self.clock, self.ledger, self.period,
            )  # fmt: skip
            left -= done
            self.steps += done
            self._rebuild_if_moved()

    def _rebuild_if_moved(self) -> None:
        moved = self.bodies.position - self.contacts.start
        if not float(np.max(np.einsum("ij,ij->i", moved, moved))) <= 0.25 * self.contacts.skin**2:
            self._rebuild()

    @property
    def time(self) -> float:
        return float(self.clock[records.TIME])

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
        """Move the floor along its normal as amplitude sin(2 pi frequency t); amplitude 0 stops it where it began."""
        self.drive = self.drive._replace(
            shake_amplitude=float(amplitude), shake_omega=2.0 * np.pi * frequency, shake_start=self.time
        )
        if amplitude == 0.0:
            floor, walls = self.drive.floor, self.walls
            walls.point[floor] += (self.drive.shake_home - level_of(walls, floor)) * walls.normal[floor]
            walls.velocity[floor] = 0.0

    def brake(self, rate: float) -> None:
        """Slow all bodies by a force of rate (1/s) times mass and velocity."""
        self.drive = self.drive._replace(drag=float(rate))

    def set_piston(self, height: float, mass: float, damping: float, force: float, rate: float) -> None:
        """Put a plate at `height` above the floor, pushed by a force that grows at `rate` (N/s) up to `force` (N).

        height m along the floor's normal; mass kg and damping N s/m are those of the plate: they steer how it finds
        its place, not where.
        """
        if not (mass > 0.0 and damping >= 0.0 and rate > 0.0):
            raise ValueError(f"piston: expected mass > 0, damping >= 0, rate > 0, found {mass}, {damping}, {rate}")
        up, row = self.walls.normal[self.drive.floor], self.drive.piston
        if row < 0:
            row = len(self.walls.point)
            self.walls = joined(self.walls, planes([height * up], [-up]))
        self.walls.point[row], self.walls.velocity[row] = height * up, 0.0
        self.drive = self.drive._replace(
            piston=row, piston_mass=float(mass), piston_damping=float(damping), piston_force=float(force),
            piston_rate=float(rate),
        )  # fmt: skip
        self.clock[records.PISTON_PUSH] = 0.0

    @property
    def piston_push(self) -> float:
        """Force that pushes the piston now, N."""
        return float(self.clock[records.PISTON_PUSH])

    @property
    def piston_height(self) -> float:
        """Place of the piston along the floor's normal, m; 0 without one."""
        row = self.drive.piston
        return -level_of(self.walls, row) if row >= 0 else 0.0

    # ---- measures ----

    def survey(self) -> tuple[Survey, Floats, Ints]:
        """Sums of the present state, the floor force of each particle (n,) N and its contacts (n,)."""
        n, law = len(self.bodies.radius), self.law
        floor_force, coordination, hardest = np.empty(n), np.empty(n, np.int64), np.empty(n)
        out = survey(
            self.bodies, self.contacts, self.contacts.slip, self.walls, self.walls.slip, self.loads.force, law.tables,
            self.drive, self.period, floor_force, coordination, hardest,
        )  # fmt: skip
        over = self._step_over_critical(hardest)
        kinetic, spinning, elastic, potential, mean, net, count, overlap, floor, piston, walls = map(float, out)
        found = Survey(
            kinetic, spinning, elastic, potential, mean, net, int(count), overlap, floor, piston, walls, float(over),
        )  # fmt: skip
        return found, floor_force, coordination

    def _step_over_critical(self, hardest: Floats) -> float:
        """The time step over the stable one, from the largest stiffness (n,) N/m that its contacts give each body.

        Rows of M^-1 (dt^2 K / 4 + dt C / 2) sum to at most one where the step is stable (Gershgorin). Each body has
        its own dashpots: those of the largest grains would slow the smallest ones' step for nothing.
        """
        law = self.law
        omega = np.sqrt(2.0 * hardest / self.bodies.mass * (1.0 + 7.0 * law.shear_ratio if law.rubs else 1.0))
        dashpot = (law.pairs.cn / law.pairs.kn).max(axis=1)[self.bodies.kind]
        xi = 0.5 * omega * dashpot
        return float(np.max(0.5 * self.dt * omega / (np.sqrt(1.0 + xi * xi) - xi)))

    def touching(self) -> tuple[Ints, Floats, Floats]:
        """Touching pairs as identities (m, 2), unit normals first to second (m, 3), spring forces (m,) N."""
        m = self.pairs
        pair, normal, push = np.empty((m, 2), np.int64), np.empty((m, 3)), np.empty(m)
        m = list_contacts(self.bodies, self.contacts, self.law.pairs, self.period, pair, normal, push)
        return self.bodies.identity[pair[:m]], normal[:m], push[:m]

    def contact_forces(self) -> ContactForces:
        """All contacts of the present state with spheres and walls, by identity: springs only, friction included."""
        law, x, radius, kind = self.law, self.bodies.position, self.bodies.radius, self.bodies.kind
        identity, slip, walls = self.bodies.identity, self.contacts.slip, self.walls
        i = np.repeat(np.arange(x.shape[0]), np.diff(self.contacts.first))
        j = self.contacts.partner[: self.pairs].astype(np.int64)
        branch = x[j] - x[i]
        if self.period is not None:
            branch[:, :2] -= self.period * np.rint(branch[:, :2] / self.period)
        distance = np.sqrt(np.einsum("ij,ij->i", branch, branch))
        overlap = radius[i] + radius[j] - distance
        touch = overlap > 0.0
        i, j, overlap = i[touch], j[touch], overlap[touch]
        shear = 0.0 if slip is None else slip[: self.pairs][touch]
        normal = branch[touch] / distance[touch, None]
        pair = [np.stack([identity[i], identity[j]], axis=1)]
        force = [shear - (law.pairs.kn[kind[i], kind[j]] * overlap)[:, None] * normal]
        arm = [(radius[i] - 0.5 * overlap)[:, None] * normal]
        for w in range(len(walls.point)):
            overlap = radius - (x - walls.point[w]) @ walls.normal[w]
            i = np.flatnonzero(overlap > 0.0)
            normal = np.broadcast_to(0.0 - walls.normal[w], (i.size, 3))
            shear = 0.0 if walls.slip is None else walls.slip[i, w]
            pair.append(np.stack([identity[i], np.full(i.size, -1)], axis=1))
            force.append(shear - (law.walls.kn[kind[i], walls.kind[w]] * overlap[i])[:, None] * normal)
            arm.append((radius[i] - overlap[i])[:, None] * normal)
        return ContactForces(*(np.concatenate(part) for part in (pair, force, arm)))

    def energy(self) -> dict[str, float]:
        """Every entry of the energy balance, J; `total` stays constant when the steps are exact."""
        self._close_ledger()
        s, _, _ = self.survey()
        ledger, row = self.ledger, self.drive.piston
        plate = 0.5 * self.drive.piston_mass * float(np.sum(self.walls.velocity[row] ** 2)) if row >= 0 else 0.0
        kinetic = s.kinetic + s.spinning + plate
        lost = {
            "dashpots": ledger[records.DASHPOTS],
            "friction": ledger[records.FRICTION],
            "drag": ledger[records.DRAG] + ledger[records.PISTON_DASHPOT],
        }
        work = {"floor_work": ledger[records.WALL_WORK], "piston_work": ledger[records.PISTON_WORK]}
        total = kinetic + s.elastic + s.potential + sum(lost.values()) - sum(work.values())
        out = {"kinetic": kinetic, "elastic": s.elastic, "potential": s.potential, **lost, **work, "total": total}
        return {name: float(value) for name, value in out.items()}

    def by_identity(self, values: NDArray) -> NDArray:
        """Values (n, ...) in the present cell order, put back into the order in which particles were given."""
        out = np.empty_like(values)
        out[self.bodies.identity] = values
        return out
