"""A bed of grains: insert, settle, shake, press, quench, count what touches the floor (H 8.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.particles.assembly import Assembly, ContactForces, Survey
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.particles.recipe import BedRecipe, check_recipe, column_height, numbers
from graben.mechanics.particles.records import Floats, Ints
from graben.mechanics.particles.stored import (
    arrays_of_assembly,
    arrays_of_forces,
    bring_back_assembly,
    forces_of,
)
from graben.mechanics.stored import Arrays, like, listed, named, part_of

# the time step is shortened where it passes this part of the stable one, bounded from the contacts that exist
STEP_LIMIT = 0.9
# part of the load by which what floor and walls carry may miss it at rest
CARRIED = 0.02
# unbalanced force ratio below which a bed without friction between grains counts as settled
CREEPING = 1.0
PHASES = ("settled", "shaking", "shaken", "pressed", "quenched")
HISTORY = (
    "time", "kinetic", "elastic", "potential", "dashpots", "friction", "drag", "floor_work", "piston_work", "total",
    "unbalanced", "floor_push", "piston_push", "piston_height", "floor_contacts",
    "wall_lift",
)  # fmt: skip


@dataclass
class Bed:
    """A pressed and quenched bed. Arrays run over particles in the order of insertion.

    history holds one row per sample (columns HISTORY); states the positions (n, 3) at the end of each phase, and
    state_forces the contacts there.
    """

    radius: Floats
    kind: Ints
    position: Floats
    velocity: Floats
    floor_force: Floats
    coordination: Ints
    pair: Ints
    normal: Floats
    push: Floats
    survey: Survey
    history: Floats
    states: dict[str, Floats] = field(default_factory=dict)
    state_times: dict[str, float] = field(default_factory=dict)
    state_forces: dict[str, ContactForces] = field(default_factory=dict)
    area: float = 0.0
    piston_height: float = 0.0
    solid_fraction: float = 0.0
    floor_share_of_weight: float = 0.0  # before pressing; the walls' friction carries the rest
    wall_share_of_weight: float = 0.0
    energy_error: float = 0.0
    steps: int = 0
    rebuilds: int = 0
    time_step: float = 0.0
    step_over_critical: float = 0.0

    def floor_count(self, classes: int) -> Ints:
        """Particles of each class (c,) that push on the floor."""
        return np.bincount(self.kind[self.floor_force > 0.0], minlength=classes).astype(np.int64)


@dataclass(frozen=True)
class Snapshot:
    """Where all grains were, in the order of insertion: time s, position and velocity (n, 3), radius, kind (n,)."""

    time: float
    position: Floats
    velocity: Floats
    radius: Floats
    kind: Ints


class BedFailed(NumericsFailed):
    """A bed that could not go on; `last_good` is its state at the last sample that passed every check."""

    def __init__(self, failure: NumericsFailed, last_good: Snapshot) -> None:
        super().__init__(failure.what, where=failure.where, step=failure.step, advice=failure.advice)
        self.last_good = last_good


_NUMBERS = ("reference", "energy_scale", "energy_error", "over", "shaken_from", "pace")


class _Run:
    """One bed under way: the assembly, its history and its checks."""

    def __init__(
        self,
        law: LinearLaw,
        recipe: BedRecipe,
        seed: int,
        progress: Callable[[float, str], None],
        keep: Callable[[Callable[[], Arrays]], None] = lambda take: None,
    ) -> None:
        self.recipe, self.progress, self.keep = recipe, progress, keep
        self.place = -1  # of the phase in PHASES
        self.calm = self.chunks = (
            0  # of the phase: samples in a row at which nothing was missing, and chunks of steps
        )
        self.shaken_from = 0.0  # s
        self.pace = 0.0  # half period of the slowest mode, s
        self.carried = (0.0, 0.0)  # by floor and walls before pressing, N
        count = numbers(law, recipe)
        order = np.argsort(-law.radius, kind="stable")
        kind = np.repeat(order, count[order])
        volume = float(np.sum(count * 4.0 / 3.0 * np.pi * law.radius**3))
        area = recipe.width[0] * recipe.width[1]
        height = column_height(law, recipe, volume)
        rng = np.random.Generator(np.random.PCG64(seed))
        position = insert(law.radius[kind], recipe.width, height, rng, periodic=recipe.periodic)
        self.box = Assembly(
            law, position, kind, recipe.width, periodic=recipe.periodic, gravity=recipe.gravity, safety=recipe.safety
        )
        self.insertion_kind = kind
        self.area, self.volume = area, volume
        self.mass = float(law.mass[kind].sum())
        self.rows: list[list[float]] = []
        self.states = {"inserted": position.copy()}
        self.times = {"inserted": 0.0}
        self.forces = {"inserted": self.box.contact_forces()}
        self.reference = self.box.energy()["total"]
        self.energy_scale = abs(self.box.energy()["potential"])
        self.energy_error = 0.0
        self.over = 0.0
        self.last_good = self.snapshot()

    def snapshot(self) -> Snapshot:
        box, kind = self.box, self.insertion_kind
        return Snapshot(
            box.time,
            box.by_identity(box.bodies.position),
            box.by_identity(box.bodies.velocity),
            box.law.radius[kind],
            kind,
        )

    def sample(self) -> Survey:
        box = self.box
        energy = box.energy()
        s, floor_force, _ = box.survey()
        self.energy_scale = max(self.energy_scale, abs(energy["piston_work"]) + abs(energy["floor_work"]))
        error = abs(energy["total"] - self.reference) / self.energy_scale
        self.energy_error = max(self.energy_error, error)
        self.over = max(self.over, s.step_over_critical)
        if not error <= self.recipe.energy_limit:
            raise NumericsFailed(
                f"energy balance is off by {100.0 * error:.3g} % (limit {100.0 * self.recipe.energy_limit:.3g} %)",
                step=box.steps, advice="lower numerics.safety (time step)",
            )  # fmt: skip
        if s.step_over_critical > STEP_LIMIT:
            box.shorten_step(STEP_LIMIT / s.step_over_critical)
        if s.overlap > 0.3:
            raise NumericsFailed(
                f"overlap of {100.0 * s.overlap:.3g} % of a radius", step=box.steps,
                advice="raise the normal stiffness or lower the pressure",
            )  # fmt: skip
        known = {**energy, "time": box.time, "unbalanced": min(s.unbalanced, 1e30), "floor_push": s.floor_push,
                 "piston_push": s.piston_push, "piston_height": box.piston_height,
                 "floor_contacts": float(np.count_nonzero(floor_force)), "wall_lift": s.wall_lift}  # fmt: skip
        self.rows.append([known[name] for name in HISTORY])
        self.last_good = self.snapshot()
        return s

    def phase(self, name: str, begin: Callable[[], None], go: Callable[[], object]) -> None:
        """One phase: one that is over already is passed over, and one under way is not begun again."""
        place = PHASES.index(name)
        if place > self.place:
            begin()
            self.place, self.calm, self.chunks = place, 0, 0
        if place == self.place:
            go()

    def until(
        self, phase: str, missing: Callable[[Survey], str], share: tuple[float, float], chunk: int = 200
    ) -> Survey:
        """Run in chunks until nothing is missing, in two samples in a row. share: of the progress of the run."""
        while self.calm < 2:
            self.box.advance(chunk)
            s = self.sample()
            lacking = missing(s)
            self.calm = 0 if lacking else self.calm + 1
            self.chunks += 1
            fraction = share[0] + (share[1] - share[0]) * (1.0 - np.exp(-self.chunks / 60.0))  # its end is not known
            if self.calm < 2:
                self.keep(self.stored)
            self.progress(fraction, f"{phase}: unbalanced force {s.unbalanced:.2e}, kinetic {s.kinetic:.2e} J")
            if lacking and self.box.steps > self.recipe.max_steps:
                raise NumericsFailed(
                    f"{phase} did not come to rest: {lacking}", step=self.box.steps,
                    advice="raise numerics.max_steps, numerics.rest or numerics.balance, or the contact damping",
                )  # fmt: skip
        self.states[phase] = self.box.by_identity(self.box.bodies.position)
        self.times[phase] = self.box.time
        self.forces[phase] = self.box.contact_forces()
        return s

    def shake(self) -> None:
        """All cycles of the floor that are left."""
        box, recipe = self.box, self.recipe
        length = recipe.shakes / recipe.shake_frequency
        # the step may shorten on the way
        while (left := round((self.shaken_from + length - box.time) / box.dt)) > 0:
            box.advance(min(500, left))
            self.sample()
            self.keep(self.stored)
            done = (box.time - self.shaken_from) / length
            self.progress(0.5 + 0.1 * done, f"shaking: {done * recipe.shakes:.0f} cycles")
        box.shake_floor(0.0, 0.0)

    def stored(self) -> Arrays:
        """The state of the run; nothing changes what was at the ends of phases."""
        numbers = [getattr(self, name) for name in _NUMBERS]
        found = {
            "place": np.array([self.place, self.calm, self.chunks]),
            "numbers": np.array([*numbers, *self.carried]),
            "rows": np.array(self.rows),
            "times": np.array(list(self.times.values())),
        }
        for name, position in self.states.items():
            found |= named(f"state.{name}", {"position": position, **arrays_of_forces(self.forces[name])})
        return found | named("box", arrays_of_assembly(self.box))

    def bring_back(self, stored: Arrays) -> None:
        """Take up a state of `stored`. Refused where it is none of this bed."""
        self.place, self.calm, self.chunks = map(int, listed(stored.get("place"), "place", 3))
        phases = [name for name in PHASES if self.recipe.shakes > 0 or name not in ("shaking", "shaken")]
        if not (0 <= self.place < len(PHASES) and PHASES[self.place] in phases and 0 <= self.calm < 2):
            raise Refused("place: a phase of the bed")
        found = listed(stored.get("numbers"), "numbers", len(_NUMBERS) + 2)
        for name, value in zip(_NUMBERS, found):
            setattr(self, name, value)
        self.carried = (found[-2], found[-1])
        if not self.energy_scale > 0.0 or (self.place >= PHASES.index("pressed") and not self.pace > 0.0):
            raise Refused("numbers: positive energy and pace")
        rows = like(np.zeros((0, len(HISTORY))), stored.get("rows"), "rows", rows=True)
        self.rows = rows.tolist()
        over = ["inserted", *(name for name in PHASES[: self.place] if name in phases and name != "shaking")]
        times = listed(stored.get("times"), "times", len(over))
        grains = self.states["inserted"]
        for name, time in zip(over, times):
            own = part_of(stored, f"state.{name}")
            self.states[name] = like(grains, own.get("position"), f"state.{name}.position")
            self.times[name], self.forces[name] = time, forces_of(own, len(grains))
        bring_back_assembly(self.box, self.insertion_kind, part_of(stored, "box"))
        self.last_good = self.snapshot()

    def unrest(self, s: Survey, balance: float) -> str:
        """What keeps the bed from rest: motion, forces on the grains, or those of floor, walls and piston; or ""."""
        recipe, weight = self.recipe, self.mass * self.recipe.gravity
        slow = recipe.rest * weight * float(self.box.law.radius.min())
        if not s.unbalanced < balance:
            return f"unbalanced force {s.unbalanced:.3g} of the mean contact force (limit {balance:g})"
        if not s.kinetic < slow:
            v = self.box.bodies.velocity
            speed = np.sqrt(np.einsum("ij,ij->i", v, v))
            moving = int(np.count_nonzero(speed**2 > 2.0 * slow / self.mass))
            return (
                f"kinetic energy {s.kinetic:.3g} J (limit {slow:.3g} J), {moving} of {len(speed)} grains move, "
                f"the fastest at {speed.max():.3g} m/s; spheres roll on where the ground is flat"
            )
        carried = s.floor_push + s.wall_lift - s.piston_push
        if not abs(carried - weight) < CARRIED * (weight + s.piston_push):
            return f"floor and walls carry {carried:.4g} N of a weight of {weight:.4g} N"
        return ""


def make_bed(
    law: LinearLaw,
    recipe: BedRecipe,
    seed: int,
    progress: Callable[[float, str], None] = lambda fraction, message: None,
    keep: Callable[[Callable[[], Arrays]], None] = lambda take: None,
    stored: Arrays | None = None,
) -> Bed:
    """Pour, settle, shake (if asked), press and quench one bed.

    Returns the bed at rest; raises Refused for an impossible recipe and NumericsFailed when the run blows up, loses
    energy balance, or does not come to rest within recipe.max_steps (as BedFailed, with the last good state).

    keep : told of each state that a bed can go on from bitwise, and how to take it
    stored : such a state, to go on from; Refused where it is none of this bed
    """
    check_recipe(law, recipe)
    run = _Run(law, recipe, seed, progress, keep)
    if stored is not None:
        run.bring_back(stored)
    try:
        return _finish(run, law, recipe)
    except NumericsFailed as failure:
        raise BedFailed(failure, run.last_good) from None


def _finish(run: _Run, law: LinearLaw, recipe: BedRecipe) -> Bed:
    """All phases after insertion."""
    box = run.box
    weight, push = run.mass * recipe.gravity, recipe.pressure * run.area

    # without friction between grains a bed creeps on for long; pressing and quenching bring it to rest
    looser = 10.0 * recipe.balance if law.friction > 0.0 else CREEPING

    def rest(phase: str, share: tuple[float, float]) -> None:
        s = run.until(phase, lambda s: run.unrest(s, looser), share)
        run.carried = (s.floor_push, s.wall_lift)

    def begin_shaking() -> None:
        run.shaken_from = box.time
        box.shake_floor(recipe.shake_amplitude, recipe.shake_frequency)

    def pressed(s: Survey) -> str:
        if box.piston_push < push or not abs(s.piston_push - push) < 0.01 * push:
            return f"the piston pushes with {s.piston_push:.4g} N of {push:.4g} N"
        if not s.unbalanced < 10.0 * recipe.balance:
            return f"unbalanced force {s.unbalanced:.3g} of the mean contact force (limit {10.0 * recipe.balance:g})"
        return ""

    def nothing() -> None:
        return None

    run.phase("settled", nothing, lambda: rest("settled", (0.0, 0.5)))
    if recipe.shakes > 0:
        run.phase("shaking", begin_shaking, run.shake)
        run.phase("shaken", nothing, lambda: rest("shaken", (0.6, 0.7)))
    run.phase("pressed", lambda: _put_plate(run, law, recipe), lambda: run.until("pressed", pressed, (0.7, 0.9)))
    # quench: drag that damps the slowest mode critically, until forces balance
    run.phase(
        "quenched",
        lambda: box.brake(2.0 * np.pi / (2.0 * run.pace)),
        lambda: run.until("quenched", lambda s: run.unrest(s, recipe.balance), (0.9, 1.0)),
    )

    s, floor_force, coordination = box.survey()
    pair, normal, contact_push = box.touching()
    height = box.piston_height
    return Bed(
        radius=law.radius[run.insertion_kind],
        kind=run.insertion_kind,
        position=run.states["quenched"],
        velocity=box.by_identity(box.bodies.velocity),
        floor_force=box.by_identity(floor_force),
        coordination=box.by_identity(coordination),
        pair=pair,
        normal=normal,
        push=contact_push,
        survey=s,
        history=np.array(run.rows),
        states=run.states,
        state_times=run.times,
        state_forces=run.forces,
        area=run.area,
        piston_height=height,
        solid_fraction=run.volume / (run.area * height),
        floor_share_of_weight=run.carried[0] / weight,
        wall_share_of_weight=run.carried[1] / weight,
        energy_error=run.energy_error,
        steps=box.steps,
        rebuilds=box.rebuilds,
        time_step=box.dt,
        step_over_critical=run.over,
    )


def _put_plate(run: _Run, law: LinearLaw, recipe: BedRecipe) -> None:
    """Light, so that it follows the bed, and its dashpot is critical on the bed's stiffness."""
    box, small = run.box, float(law.radius.min())
    mean_k = float(np.mean(np.diag(law.pairs.kn)))
    top = float(np.max(box.bodies.position[:, 2] + box.bodies.radius))
    push = recipe.pressure * run.area
    cell = (2.0 * small) ** 2
    footing = min(run.area, len(run.insertion_kind) * cell)  # few grains are fewer than a layer
    layer = footing / cell * float(law.mass.min())
    mass = max(0.1 * run.mass, 0.3 * layer)  # a lighter one would need a shorter time step
    stiffness = mean_k * footing / (2.0 * small) / top  # of a plate on a column of springs
    damping = 2.0 * np.sqrt(stiffness * mass)
    run.pace = float(np.pi * np.sqrt((run.mass / 3.0 + mass) / stiffness))
    box.set_piston(top, mass, damping, push, push / (recipe.ramp * run.pace))
