"""The specimen while it moves: all arrays of a run, its time step, its surface, and what was removed from it."""

from __future__ import annotations

import time as clock_module

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.elements.hex8 import shape_gradient, volume_gradient
from graben.mechanics.scratch.contact import sphere_contact
from graben.mechanics.scratch.eight_points import forces_eight_points
from graben.mechanics.scratch.frame import Snapshot, stress_in_space
from graben.mechanics.scratch.mesh import Floats, HexMesh
from graben.mechanics.scratch.motion import tip_position
from graben.mechanics.scratch.one_point import EXTERNAL, KINETIC, LEDGER_SIZE, forces_one_point
from graben.mechanics.scratch.setup import Damage, Numerics, Tip
from graben.mechanics.scratch.stepping import kick_and_drift, kinetic_energy, refresh
from graben.mechanics.scratch.surface import bared_supports, contact_stiffness, exposed_faces
from graben.mechanics.stored import Arrays, like, listed, within

# What steps change; `_step` fills the rest before it is read, and the surface follows from what is alive.
_ARRAYS = (
    "x", "v", "force", "tangent", "alive", "vol", "rot", "sig", "state", "hour", "node_mass", "scaled", "clock",
    "tip", "contact_force", "mean_force", "ledger", "par",
)  # fmt: skip
_NUMBERS = (
    "work_before", "damping", "loop_seconds", "first_step", "smallest_step", "added_share", "largest_factor",
)  # fmt: skip
_COUNTS = ("steps", "updates", "touching")


def elastic_moduli(par: Floats) -> tuple[float, float]:
    """Bulk and shear modulus [Pa]; every law keeps Young's modulus and Poisson's ratio in its first two slots."""
    young, nu = float(par[0]), float(par[1])
    return young / (3.0 * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu))


@kernel(error_model="numpy")
def reference_gradients(points, cells, g0, vol):
    """Gradients of the shape functions in the first shape, g0 (e, p, 8, 3) for p = 1 (mean) or 8, and volumes."""
    xe, b = np.empty((8, 3)), np.empty((8, 3))
    root = 1.0 / np.sqrt(3.0)
    for e in range(cells.shape[0]):
        for n in range(8):
            for i in range(3):
                xe[n, i] = points[cells[e, n], i]
        vol[e] = volume_gradient(xe, b)
        if g0.shape[1] == 1:
            for n in range(8):
                for i in range(3):
                    g0[e, 0, n, i] = b[n, i] / vol[e]
            continue
        for p in range(8):
            xi = root if (p & 1) else -root
            eta = root if (p & 2) else -root
            zeta = root if (p & 4) else -root
            shape_gradient(xe, xi, eta, zeta, g0[e, p])


class Body:
    """State of a run and the two things done to it: `refresh` and `advance`. Used by `run.simulate`."""

    def __init__(
        self,
        mesh: HexMesh,
        law: int,
        par: Floats,
        state: Floats,
        density: float,
        numerics: Numerics,
        tip: Tip,
        phases: Floats,
        wave: float,
        damage: Damage | None,
        names: tuple[int, int],
    ) -> None:
        count, points = len(mesh.cells), numerics.points
        if points not in (1, 8):
            raise ValueError(f"points per element must be 1 or 8, found {points}")
        self.mesh, self.law, self.par, self.numerics = mesh, law, par, numerics
        self.sphere, self.phases, self.wave, self.removal, self.names = tip, phases, wave, damage, names
        self.bulk, self.shear = elastic_moduli(par)
        self.x = mesh.points.copy()
        self.v = np.zeros_like(self.x)
        self.step = np.zeros_like(self.x)
        self.force = np.zeros_like(self.x)
        self.tangent = np.zeros_like(self.x)
        self.alive = np.ones(count, dtype=np.int64)
        self.vol = np.empty(count)
        self.g0 = np.empty((count, points, 8, 3))
        reference_gradients(mesh.points, mesh.cells, self.g0, self.vol)
        self.first_volumes = self.vol.copy()
        self.cell_mass = density * self.vol
        self.rot = np.tile(np.eye(3), (count, points, 1, 1))
        self.sig = np.zeros((count, points, 6))
        self.state = np.tile(state, (count, points, 1))
        self.hour = np.zeros((count if points == 1 else 0, 4, 3))
        self.node_mass = np.ones(len(self.x))
        self.scaled = np.ones(count)
        self.clock = np.zeros(3)
        self.origin = np.array([tip.start, 0.0, tip.radius])
        self.tip = self.origin.copy()
        self.next_tip, self.tip_step = np.zeros(3), np.zeros(3)
        self.contact_force, self.mean_force = np.zeros(3), np.zeros(3)
        self.work_before = 0.0
        self.ledger = np.zeros(LEDGER_SIZE)
        self.damping = 0.0
        self.steps = self.updates = self.touching = 0
        self.loop_seconds = 0.0
        self.first_step = self.smallest_step = 0.0
        self.added_share, self.largest_factor = 0.0, 1.0
        self._expose()

    @property
    def time(self) -> float:
        return float(self.clock[0])

    @property
    def external(self) -> float:
        return float(self.ledger[EXTERNAL])

    @property
    def volume_range(self) -> tuple[float, float]:
        """Smallest and largest det F over the living elements."""
        ratio = (self.vol / self.first_volumes)[self.alive == 1]
        return float(ratio.min()), float(ratio.max())

    def progress_of_depth(self) -> float:
        """Share of the depth that the tip has reached."""
        return float((self.origin[2] - self.tip[2]) / self.sphere.depth)

    def _expose(self) -> None:
        self.faces, owners = exposed_faces(self.mesh, self.alive)
        young = float(self.par[0])
        self.surface, self.stiffness = contact_stiffness(
            self.mesh, self.faces, owners, self.first_volumes, young, self.numerics.penalty
        )

    def _remove(self) -> None:
        """Take out elements whose damage has reached the limit, and find the new surface."""
        if self.removal is None or self.names[1] < 0:
            return
        worn = (self.state[:, :, self.names[1]].min(axis=1) >= self.removal.remove_at) & (self.alive == 1)
        if worn.any():
            self.alive[worn] = 0
            self.sig[worn] = 0.0
            self._expose()

    def refresh(self, until: float | None = None) -> int:
        """New time step from the current shape; returns how many steps to take before the next refresh."""
        self._remove()
        n = self.numerics
        stiff = self.bulk + 4.0 / 3.0 * self.shear
        step, added, factor = refresh(
            self.x, self.v, self.mesh.cells, self.alive, self.vol, self.cell_mass, stiff, n.safety,
            n.floor * self.first_step, self.node_mass, self.scaled, self.ledger,
        )  # fmt: skip
        if self.first_step == 0.0:
            self.first_step = self.smallest_step = self.clock[1] = self.clock[2] = step
        self.added_share = added / float(self.cell_mass.sum())
        self.largest_factor = factor
        self.smallest_step = min(self.smallest_step, step)
        self.clock[1] = min(step, 1.05 * self.clock[1])
        if until is None:
            return n.refresh
        left = until - self.time
        steps = max(1, int(np.ceil(left / self.clock[1])))
        if steps <= n.refresh:
            self.clock[1] = left / steps
            return steps
        return n.refresh

    def advance(self, steps: int) -> None:
        """Take steps of one length; NumericsFailed names the element when one gives up."""
        start = clock_module.perf_counter()
        living = int(self.alive.sum())
        self.mean_force[:] = 0.0
        for _ in range(steps):
            code, element = self._step()
            self.steps += 1
            self.updates += living
            if code != 0:
                self._give_up(code, element)
            self.mean_force += self.contact_force / steps
        self.ledger[KINETIC] = kinetic_energy(
            self.v, self.force, self.node_mass, self.mesh.free, 0.5 * float(self.clock[1])
        )
        self.loop_seconds += clock_module.perf_counter() - start

    def _step(self) -> tuple[int, int]:
        """One step; returns the failure code (0: none) and the element concerned."""
        n, clock, ledger = self.numerics, self.clock, self.ledger
        dt, span = float(clock[1]), 0.5 * float(clock[1] + clock[2])
        kick_and_drift(
            self.x, self.v, self.step, self.force, self.node_mass, self.mesh.free, dt, span, self.damping, ledger
        )
        clock[0] += dt
        clock[2] = dt
        tip_position(clock[0], self.phases, self.origin, self.next_tip)
        self.tip_step[:] = self.next_tip - self.tip
        self.tip[:] = self.next_tip
        before = self.contact_force.copy()
        if self.removal is not None:
            work = 2.0 * (ledger[EXTERNAL] - self.work_before)
            self.work_before = float(ledger[EXTERNAL])
            self.par[self.removal.step_slot] = min(1.0, max(0.0, self.removal.per_work * work))
        if n.points == 1:
            code, element = forces_one_point(
                self.x, self.step, self.mesh.cells, self.g0, self.alive, self.vol, self.cell_mass, self.rot, self.sig,
                self.state, self.hour, self.law, self.par, self.shear, n.hourglass, n.viscosity, self.wave, dt,
                self.force, ledger,
            )  # fmt: skip
        else:
            code, element = forces_eight_points(
                self.x, self.step, self.mesh.cells, self.g0, self.alive, self.vol, self.cell_mass, self.rot, self.sig,
                self.state, self.law, self.par, n.viscosity, self.wave, dt, self.force, ledger,
            )  # fmt: skip
        if code != 0:
            return code, element
        self.touching = sphere_contact(
            self.x, self.step, self.surface, self.stiffness, 1.0, self.tangent, self.tip, self.tip_step,
            self.sphere.radius, self.sphere.friction, self.force, self.contact_force, ledger,
        )  # fmt: skip
        ledger[EXTERNAL] += 0.5 * float((before + self.contact_force) @ self.tip_step)
        return 0, -1

    def _give_up(self, code: int, element: int) -> None:
        what = "an element turned inside out" if code < 0 else f"the constitutive law gave up (code {code})"
        centre = 1e6 * self.x[self.mesh.cells[element]].mean(axis=0)
        raise NumericsFailed(
            what,
            where=f"element {element} near ({centre[0]:.1f}, {centre[1]:.1f}, {centre[2]:.1f}) um",
            step=self.steps,
            advice="lower numerics.safety or the speeds, or raise numerics.hourglass",
        )

    def stored(self) -> Arrays:
        """Copies of all that steps change."""
        numbers = [getattr(self, name) for name in _NUMBERS]
        counts = [getattr(self, name) for name in _COUNTS]
        arrays = {name: getattr(self, name).copy() for name in _ARRAYS}
        return {"numbers": np.array(numbers, dtype=float), "counts": np.array(counts, dtype=np.int64), **arrays}

    def bring_back(self, stored: Arrays) -> None:
        """Take up a state of `stored`. Refused where it is none of this body."""
        numbers = listed(stored.get("numbers"), "numbers", len(_NUMBERS))
        counts = listed(stored.get("counts"), "counts", len(_COUNTS))
        found = {name: like(getattr(self, name), stored.get(name), name) for name in _ARRAYS}
        within(found["alive"], "alive", 0, 1)
        clock = found["clock"]
        if not (found["alive"].any() and (found["node_mass"] > 0.0).all() and (found["vol"] > 0.0).all()):
            raise Refused("alive, node_mass, vol: a body")
        if not (clock >= 0.0).all() or clock[1] <= 0.0 or numbers[_NUMBERS.index("first_step")] <= 0.0:
            raise Refused("clock: time and length of the step")
        for name, number in zip(_NUMBERS, numbers):
            setattr(self, name, number)
        for name, count in zip(_COUNTS, counts):
            setattr(self, name, int(count))
        for name, array in found.items():
            setattr(self, name, array)
        self._expose()

    def snapshot(self, name: str) -> Snapshot:
        """Copy of the present state for pictures and sections."""

        tip = np.zeros(3)
        tip_position(self.time, self.phases, self.origin, tip)
        zero = np.zeros(len(self.mesh.cells))
        p, d = self.names
        return Snapshot(
            name=name,
            time=self.time,
            tip=tip,
            points=self.x.copy(),
            stress=stress_in_space(self.rot, self.sig),
            plastic_strain=self.state[:, :, p].mean(axis=1) if p >= 0 else zero,
            damage=self.state[:, :, d].mean(axis=1) if d >= 0 else zero,
            alive=self.alive.copy(),
            volumes=self.vol.copy(),
            faces=self.faces.copy(),
            supports=bared_supports(self.mesh, self.alive),
        )
