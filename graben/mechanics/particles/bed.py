"""A bed of grains: insert, settle, shake, press, quench, count what touches the floor (H 8.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graben.errors import NumericsFailed, Refused
from graben.mechanics.particles.assembly import Assembly, ContactForces, Survey
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# solid fraction by which a nominal depth is turned into a number of grains
NOMINAL_FRACTION = 0.6
# the time step is shortened where it passes this part of the stable one, bounded from the contacts that exist
STEP_LIMIT = 0.9
# part of the load by which what floor and walls carry may miss it at rest
CARRIED = 0.02
# unbalanced force ratio below which a bed without friction between grains counts as settled
CREEPING = 1.0
HISTORY = (
    "time", "kinetic", "elastic", "potential", "dashpots", "friction", "drag", "floor_work", "piston_work", "total",
    "unbalanced", "floor_push", "piston_push", "piston_height", "floor_contacts",
    "wall_lift",
)  # fmt: skip


@dataclass(frozen=True)
class BedRecipe:
    """What is poured, and what is done to it.

    share : (c,) volume share of each class, theta_i of H (8.9); sums to 1
    width : (2,) m; depth : m, of the bed before pressing (nominal: solid fraction 0.6)
    loose_fraction : solid fraction of the inserted column
    gravity : m/s2; pressure : Pa on top
    shakes : cycles of the floor, z = amplitude sin(2 pi frequency t), amplitude m, frequency Hz
    rest : kinetic energy over (weight x smallest radius) at which a bed is at rest
    balance : unbalanced force ratio at which the quenched bed is at rest; ten times as much ends the phases before it
        (settling without friction between grains: CREEPING)
    energy_limit : allowed relative error of the energy balance
    """

    share: Floats
    width: tuple[float, float]
    depth: float
    pressure: float
    gravity: float = 9.81
    periodic: bool = True
    loose_fraction: float = 0.25
    shakes: int = 0
    shake_amplitude: float = 0.0
    shake_frequency: float = 0.0
    safety: float = 0.4
    rest: float = 1e-3
    balance: float = 1e-3
    energy_limit: float = 0.05
    ramp: float = 5.0  # half periods of the slowest mode over which the pressure rises
    max_steps: int = 2_000_000


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


def numbers(law: LinearLaw, recipe: BedRecipe) -> Ints:
    """Particles of each class (c,) for the nominal depth. Raises Refused for an empty bed."""
    share = np.asarray(recipe.share, dtype=np.float64)
    if share.shape != law.radius.shape or np.any(share < 0.0) or abs(share.sum() - 1.0) > 1e-6:
        raise Refused(f"share: expected {law.radius.size} shares >= 0 with sum 1, found {share.tolist()}")
    solid = NOMINAL_FRACTION * recipe.width[0] * recipe.width[1] * recipe.depth
    count = np.rint(share * solid / (4.0 / 3.0 * np.pi * law.radius**3)).astype(np.int64)
    if count.sum() == 0 or np.any((count == 0) & (share > 0.0)):
        raise Refused(f"bed is empty: the box holds {count.tolist()} particles per class; make it larger")
    return count


def check_recipe(law: LinearLaw, recipe: BedRecipe) -> None:
    """Raise Refused for a bed that cannot be made; nothing is placed."""
    if not recipe.pressure > 0.0 or not recipe.gravity > 0.0:
        raise Refused(f"expected pressure > 0 and gravity > 0, found {recipe.pressure}, {recipe.gravity}")
    if recipe.shakes > 0 and not (recipe.shake_amplitude > 0.0 and recipe.shake_frequency > 0.0):
        raise Refused("shaking: expected amplitude > 0 and frequency > 0")
    if not law.rubs and not law.damping > 0.0:
        raise Refused("contact.damping: expected a positive value where no friction acts; nothing else takes energy")
    numbers(law, recipe)
    largest = 2.0 * float(law.radius.max())
    if not recipe.periodic and min(recipe.width) <= largest:
        raise Refused(f"box.width: expected more than one grain, {largest:.6g} m, found {min(recipe.width):.6g} m")


def column_height(law: LinearLaw, recipe: BedRecipe, solid: float) -> float:
    """Height of the column that is poured, m, from the volume of its grains, m3."""
    return max(solid / (recipe.loose_fraction * recipe.width[0] * recipe.width[1]), 4.0 * float(law.radius.max()))


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


class _Run:
    """One bed under way: the assembly, its history and its checks."""

    def __init__(self, law: LinearLaw, recipe: BedRecipe, seed: int, progress: Callable[[float, str], None]) -> None:
        self.recipe, self.progress = recipe, progress
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

    def until(
        self, phase: str, missing: Callable[[Survey], str], share: tuple[float, float], chunk: int = 200
    ) -> Survey:
        """Run in chunks until nothing is missing, in two samples in a row. share: of the progress of the run."""
        calm = chunks = 0
        while calm < 2:
            self.box.advance(chunk)
            s = self.sample()
            lacking = missing(s)
            calm = 0 if lacking else calm + 1
            chunks += 1
            fraction = share[0] + (share[1] - share[0]) * (1.0 - np.exp(-chunks / 60.0))  # its end is not known
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
) -> Bed:
    """Pour, settle, shake (if asked), press and quench one bed.

    Returns the bed at rest; raises Refused for an impossible recipe and NumericsFailed when the run blows up, loses
    energy balance, or does not come to rest within recipe.max_steps (as BedFailed, with the last good state).
    """
    check_recipe(law, recipe)
    run = _Run(law, recipe, seed, progress)
    try:
        return _finish(run, law, recipe)
    except NumericsFailed as failure:
        raise BedFailed(failure, run.last_good) from None


def _finish(run: _Run, law: LinearLaw, recipe: BedRecipe) -> Bed:
    """All phases after insertion."""
    box = run.box
    small = float(law.radius.min())
    mean_k = float(np.mean(np.diag(law.pairs.kn)))
    weight = run.mass * recipe.gravity

    # without friction between grains a bed creeps on for long; pressing and quenching bring it to rest
    looser = 10.0 * recipe.balance if law.friction > 0.0 else CREEPING

    def resting(s: Survey) -> str:
        return run.unrest(s, looser)

    at_rest = run.until("settled", resting, (0.0, 0.5))
    if recipe.shakes > 0:
        begun, length = box.time, recipe.shakes / recipe.shake_frequency
        box.shake_floor(recipe.shake_amplitude, recipe.shake_frequency)
        while (left := round((begun + length - box.time) / box.dt)) > 0:  # the step may shorten on the way
            box.advance(min(500, left))
            run.sample()
            done = (box.time - begun) / length
            run.progress(0.5 + 0.1 * done, f"shaking: {done * recipe.shakes:.0f} cycles")
        box.shake_floor(0.0, 0.0)
        at_rest = run.until("shaken", resting, (0.6, 0.7))

    # the plate is light, so that it follows the bed, and its dashpot is critical on the bed's stiffness
    top = float(np.max(box.bodies.position[:, 2] + box.bodies.radius))
    push = recipe.pressure * run.area
    cell = (2.0 * small) ** 2
    footing = min(run.area, len(run.insertion_kind) * cell)  # few grains are fewer than a layer
    layer = footing / cell * float(law.mass.min())
    plate_mass = max(0.1 * run.mass, 0.3 * layer)  # a lighter one would need a shorter time step
    bed_stiffness = mean_k * footing / (2.0 * small) / top  # of a plate on a column of springs
    damping = 2.0 * np.sqrt(bed_stiffness * plate_mass)
    pace = np.pi * np.sqrt((run.mass / 3.0 + plate_mass) / bed_stiffness)  # half period of the slowest mode, s
    box.set_piston(top, plate_mass, damping, push, push / (recipe.ramp * pace))

    def pressed(s: Survey) -> str:
        if box.piston_push < push or not abs(s.piston_push - push) < 0.01 * push:
            return f"the piston pushes with {s.piston_push:.4g} N of {push:.4g} N"
        if not s.unbalanced < 10.0 * recipe.balance:
            return f"unbalanced force {s.unbalanced:.3g} of the mean contact force (limit {10.0 * recipe.balance:g})"
        return ""

    run.until("pressed", pressed, (0.7, 0.9))
    # quench: drag that damps the slowest mode critically, until forces balance
    box.brake(2.0 * np.pi / (2.0 * pace))
    run.until("quenched", lambda s: run.unrest(s, recipe.balance), (0.9, 1.0))

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
        floor_share_of_weight=at_rest.floor_push / weight,
        wall_share_of_weight=at_rest.wall_lift / weight,
        energy_error=run.energy_error,
        steps=box.steps,
        rebuilds=box.rebuilds,
        time_step=box.dt,
        step_over_critical=run.over,
    )
