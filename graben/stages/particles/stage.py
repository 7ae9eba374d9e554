"""dem-run for kind "particles": pour, settle, shake, press and count beds of grains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.particles.bed import HISTORY, PHASES, Bed, BedFailed, Snapshot, make_bed
from graben.mechanics.particles.law import LinearLaw, critical_step
from graben.mechanics.particles.recipe import NOMINAL_FRACTION, BedRecipe, check_recipe, column_height
from graben.mechanics.particles.sampling import interval_over_areas, interval_over_beds
from graben.mechanics.stored import Arrays, listed, named, part_of
from graben.schemas.files import together
from graben.schemas.layouts.particles import LAYOUT
from graben.schemas.outputs import CHECKPOINT, LAST_GOOD, PARTIAL, SERIES, Outputs, beside
from graben.schemas.scenes.particles import ParticlesScene
from graben.schemas.vtk import vtu_series, write_vtu
from graben.stages.particles.checkpoint import arrays_of_bed, bed_of
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.estimate import Estimate, refuse_too_large, work
from graben.stages.shared.fidelity import setting
from graben.stages.shared.fields import kept
from graben.stages.shared.last_good import keep_by, keeps_last_good, write_whole
from graben.stages.shared.measures import Measure, warnings_of
from graben.stages.shared.record import Progress, Record, silent

# Variables of the artifact that no later stage needs, and the field that each of them is.
_SPARE = {"velocity": "velocity", "coordination": "coordination"}
# Mean overlap over the smallest diameter: half of what stops a run, three times the most that a scene may ask for.
_MOST_OVERLAP = 0.15
_GRAIN_BYTES = 4000.0  # states, contacts and their histories


def outputs_of(scene: ParticlesScene, output: Path) -> Outputs:
    """What a run writes, and what it leaves when it fails."""
    return Outputs(output, SERIES if scene.output.vtk else (), kept=(CHECKPOINT, LAST_GOOD + ".vtu", PARTIAL))


@keeps_last_good("no grain had moved yet")
def run(scene: ParticlesScene, output: Path, *, restart: bool = False, progress: Progress = silent) -> dict[str, Any]:
    """Make the beds of a scene, write the artifact and its VTU files.

    restart : go on from NAME.checkpoint.npz, which a run that was stopped left beside the output

    Returns
    -------
    headline numbers: contacts per area of each class with their 95 % interval (1/m2), the same times diameter
    squared, solid fraction, energy error, unbalanced force ratio, shares of the weight that floor and side walls
    carry before pressing

    Raises
    ------
    BadInput : the mechanics refuse the scene
    NumericsFailed : a bed blew up or did not come to rest; NAME.last-good.vtu is beside the output
    """
    law, recipe, _ = prepare(scene)
    record = Record.begin(scene)
    checkpoint = Checkpoint.of(output, scene, record)
    stored = checkpoint.read() if restart else None
    with checkpoint.guarding():
        beds = _beds(scene, law, recipe, checkpoint, stored, output, progress)
        arrays = _arrays(scene, law, beds)
        record.cost |= {
            "steps": sum(b.steps for b in beds),
            "particles": sum(len(b.radius) for b in beds),
            "particle_steps": sum(b.steps * len(b.radius) for b in beds),
            "neighbour_list_rebuilds": sum(b.rebuilds for b in beds),
            "time_step_s": beds[0].time_step,
            "time_step_over_critical": max(b.step_over_critical for b in beds),
            "energy_error": max(b.energy_error for b in beds),
            "unbalanced_force_ratio": max(b.survey.unbalanced for b in beds),
            "largest_overlap_over_radius": max(b.survey.overlap for b in beds),
        }
        record.warn(warnings_of(_measures(record.cost)))
        with together():
            if scene.output.vtk:
                _write_vtk(output, law, beds[0], scene.output.fields)
            write_whole(output, LAYOUT, kept(scene.output.fields, arrays, _SPARE), record)
    classes = [
        {
            "name": g.name,
            "contacts_per_m2": float(arrays["floor_contacts_per_area"][i]),
            "contacts_per_m2_low": float(arrays["floor_contacts_low"][i]),
            "contacts_per_m2_high": float(arrays["floor_contacts_high"][i]),
            "contacts_times_diameter_squared": float(arrays["floor_contacts_per_area"][i]) * g.diameter**2,
        }
        for i, g in enumerate(scene.grains)
    ]
    return {
        "classes": classes,
        "particles": record.cost["particles"],
        "solid_fraction": float(np.mean([b.solid_fraction for b in beds])),
        "energy_error": record.cost["energy_error"],
        "unbalanced_force_ratio": record.cost["unbalanced_force_ratio"],
        "largest_overlap_over_radius": record.cost["largest_overlap_over_radius"],
        "warnings": record.warnings,
        "floor_share_of_weight": float(np.mean([b.floor_share_of_weight for b in beds])),
        "wall_share_of_weight": float(np.mean([b.wall_share_of_weight for b in beds])),
    }


def _beds(
    scene: ParticlesScene,
    law: LinearLaw,
    recipe: BedRecipe,
    checkpoint: Checkpoint,
    stored: Arrays | None,
    output: Path,
    progress: Progress,
) -> list[Bed]:
    """All beds, from where a stopped run left off.

    stored : what its checkpoint held; None where there is none
    """
    beds: list[Bed] = []
    finished: Arrays = {}
    under_way: Arrays | None = None
    if stored is not None:
        names = ["inserted", *(n for n in PHASES if n != "shaking" and (recipe.shakes > 0 or n != "shaken"))]
        with checkpoint.bringing_back():
            [count] = listed(stored.get("beds"), "beds", 1)
            if not 0 <= count <= scene.beds:
                raise Refused(f"beds: at most {scene.beds}")
            beds = [bed_of(part_of(stored, f"bed.{b}"), len(scene.grains), names) for b in range(int(count))]
        finished = {name: values for name, values in stored.items() if name.startswith("bed.")}
        under_way = part_of(stored, "run") or None

    def state(own: Arrays) -> Arrays:
        return {"beds": np.array([len(beds)]), **finished, **named("run", own)}

    for b in range(len(beds), scene.beds):
        try:
            with checkpoint.bringing_back() if under_way is not None else nullcontext():
                bed = make_bed(
                    law, recipe, scene.seed + b, _part(progress, b, scene.beds),
                    lambda take: checkpoint.keep(lambda: state(take())), under_way,
                )  # fmt: skip
        except BedFailed as failure:
            keep_by(partial(lambda state, why: _write_last_good(output, state), failure.last_good))
            raise
        under_way = None
        beds.append(bed)
        finished |= named(f"bed.{b}", arrays_of_bed(bed))
        checkpoint.keep(lambda: state({}))
    return beds


def _measures(cost: dict[str, Any]) -> list[Measure]:
    return [
        Measure(
            "energy_error", cost["energy_error"], 0.025,
            "the energy balance is off by {percent}: lower numerics.safety (time step)",
        ),
        Measure(
            "largest_overlap_over_radius", cost["largest_overlap_over_radius"], 0.1,
            "grains overlap by up to {percent} of a radius (10 % is the most that points of contact allow): lower "
            "contact.overlap or raise contact.normal_stiffness",
        ),
        Measure(
            "time_step_over_critical", cost["time_step_over_critical"], 1.0,
            "the time step was {value} times the stable one: lower numerics.safety",
        ),
    ]  # fmt: skip


def prepare(scene: ParticlesScene) -> tuple[LinearLaw, BedRecipe, list[Estimate]]:
    """Contact law, recipe and sizes of a scene, after every check that the run makes; no grain has been placed.

    Raises
    ------
    BadInput : the scene is too large, or the mechanics refuse it
    """
    file = scene.source.path
    try:
        law, recipe = _law(scene), _recipe(scene)
        sizes = _sizes(scene, law, recipe)
        refuse_too_large(file, sizes)
        check_recipe(law, recipe)
    except Refused as error:
        raise BadInput(Fault(str(file), "", "", f"a scene that can be run ({error})")) from error
    faults = [*_buried(scene, law), *_never_settled(scene, law, recipe)]
    if faults:
        raise BadInput(faults)
    return law, recipe, sizes


def _buried(scene: ParticlesScene, law: LinearLaw) -> Iterator[Fault]:
    """A fault where weight and pressure at rest press grains together further than points of contact allow."""
    density = float(sum(g.share * g.density for g in scene.grains))
    weight = NOMINAL_FRACTION * density * scene.loading.gravity * scene.box.depth
    smallest, stiffness = min(g.diameter for g in scene.grains), float(law.normal_stiffness.min())
    pushed = 2.0 * (scene.loading.pressure + weight) * smallest
    overlap = pushed / stiffness
    if overlap > _MOST_OVERLAP:
        least = pushed / _MOST_OVERLAP
        found = f"{stiffness:.4g} N/m" + ("" if scene.contact.normal_stiffness else " (from pressure and overlap)")
        expected = (
            f"at least {least:.4g} N/m: under {scene.loading.pressure:.4g} Pa and {weight:.4g} Pa of their own "
            f"weight grains overlap by {100.0 * overlap:.3g} % of their diameter"
        )
        yield Fault(str(scene.source.path), "contact.normal_stiffness", found, expected)


def _never_settled(scene: ParticlesScene, law: LinearLaw, recipe: BedRecipe) -> Iterator[Fault]:
    """A fault where the grains' fall alone takes more steps than a bed may."""
    solid = NOMINAL_FRACTION * scene.box.width**2 * scene.box.depth
    # The topmost grains fall by what is loose of the column, more than half of it.
    fall = math.sqrt(column_height(law, recipe, solid) / recipe.gravity)
    steps = fall / (recipe.safety * critical_step(law))
    if steps > recipe.max_steps:
        expected = f"at least {steps:.3g}, the steps of the fall alone; softer contacts have longer steps"
        yield Fault(str(scene.source.path), "numerics.max_steps", str(recipe.max_steps), expected)


def _sizes(scene: ParticlesScene, law: LinearLaw, recipe: BedRecipe) -> list[Estimate]:
    """Grains, cells of the column that they are poured into, and the steps of their fall and of shaking at least."""
    smallest = min(scene.grains, key=lambda g: g.diameter)
    key, value = "grains.diameter", f"{smallest.diameter:g} m"
    solid = NOMINAL_FRACTION * scene.box.width**2 * scene.box.depth
    with np.errstate(all="ignore"):
        grains = float((recipe.share * solid / (4.0 / 3.0 * np.pi * law.radius**3)).sum())
    height = column_height(law, recipe, solid)
    side = scene.box.width / (2.0 * float(law.radius.max()))
    cells = side * side * (height / (2.0 * float(law.radius.max())))
    seconds = math.sqrt(2.0 * height / recipe.gravity)
    if recipe.shakes:
        seconds += recipe.shakes / recipe.shake_frequency
    # A bed settles by decades of kinetic energy: twice as long from a ten-thousandth as from a hundredth.
    seconds *= max(1.0, 0.5 * math.log10(1.0 / recipe.rest))
    steps = seconds / (recipe.safety * critical_step(law))
    return [
        Estimate("grains", grains * scene.beds, grains * scene.beds * _GRAIN_BYTES, key, value),
        Estimate(
            "cells of the poured column", cells, 8.0 * cells, "numerics.loose_fraction", f"{recipe.loose_fraction:g}"
        ),
        work("grain-steps", grains * scene.beds, steps, key, value),
    ]


def _part(progress: Progress, bed: int, beds: int) -> Progress:
    """Progress of one bed among several."""

    def tell(fraction: float, message: str) -> None:
        progress((bed + fraction) / beds, f"bed {bed + 1} of {beds}: {message}")

    return tell


def _law(scene: ParticlesScene) -> LinearLaw:
    c = scene.contact
    diameter = np.array([g.diameter for g in scene.grains])
    stiffness = c.normal_stiffness
    if stiffness is None:
        # a grain carries about p D^2; two grains in series deform by F / (k / 2)
        stiffness = 2.0 * scene.loading.pressure * float(diameter.min()) / c.overlap
    return LinearLaw(
        radius=diameter / 2.0,
        density=np.array([g.density for g in scene.grains]),
        normal_stiffness=np.full(diameter.shape, stiffness),
        wall_stiffness=c.wall_stiffness_ratio * stiffness,
        shear_ratio=c.shear_ratio,
        friction=c.friction,
        wall_friction=c.wall_friction,
        damping=c.damping,
        shear_damping=c.damping,
    )


def _recipe(scene: ParticlesScene) -> BedRecipe:
    numerics, loading = scene.numerics, scene.loading
    smallest = min(g.diameter for g in scene.grains)
    shakes, amplitude, frequency = 0, 0.0, 0.0
    if scene.shaking is not None:
        shakes = scene.shaking.cycles
        amplitude = scene.shaking.amplitude * smallest
        frequency = float(np.sqrt(scene.shaking.acceleration * loading.gravity / amplitude) / (2.0 * np.pi))
    return BedRecipe(
        share=np.array([g.share for g in scene.grains]),
        width=(scene.box.width, scene.box.width),
        depth=scene.box.depth,
        pressure=loading.pressure,
        gravity=loading.gravity,
        periodic=scene.box.sides == "periodic",
        loose_fraction=numerics.loose_fraction,
        shakes=shakes,
        shake_amplitude=amplitude,
        shake_frequency=frequency,
        safety=setting(scene, "numerics.safety"),
        rest=setting(scene, "numerics.rest"),
        balance=setting(scene, "numerics.balance"),
        ramp=loading.ramp,
        energy_limit=numerics.energy_limit,
        max_steps=numerics.max_steps,
    )


def _arrays(scene: ParticlesScene, law: LinearLaw, beds: list[Bed]) -> dict[str, Any]:
    classes = len(scene.grains)
    counts = np.array([b.floor_count(classes) for b in beds])
    areas = np.array([b.area for b in beds])
    if len(beds) > 1:
        mean, low, high = interval_over_beds(counts / areas[:, None])
    else:
        bed = beds[0]
        touching = bed.floor_force > 0.0
        parts = max(2, int(scene.box.width / (4.0 * max(g.diameter for g in scene.grains))))
        mean, low, high = interval_over_areas(
            bed.position[touching, :2], bed.kind[touching], classes, (scene.box.width, scene.box.width), parts
        )
    force = np.concatenate([b.floor_force for b in beds])
    kind = np.concatenate([b.kind for b in beds])
    offset = np.concatenate([[0], np.cumsum([len(b.radius) for b in beds])])
    names = list(beds[0].states)
    history = np.concatenate([b.history for b in beds])
    return {
        "class_name": np.array([g.name for g in scene.grains]),
        "class_diameter": 2.0 * law.radius,
        "class_density": law.density,
        "class_share": [g.share for g in scene.grains],
        "class_stiffness": law.normal_stiffness,
        "floor_contacts_per_area": mean,
        "floor_contacts_low": low,
        "floor_contacts_high": high,
        "floor_contact_force": [
            float(force[(kind == c) & (force > 0)].mean()) if np.any((kind == c) & (force > 0)) else 0.0
            for c in range(classes)
        ],
        "bed_seed": [scene.seed + b for b in range(len(beds))],
        "bed_area": areas,
        "bed_width": np.full(len(beds), scene.box.width),
        "bed_pressure": np.full(len(beds), scene.loading.pressure),
        "bed_solid_fraction": [b.solid_fraction for b in beds],
        "bed_piston_height": [b.piston_height for b in beds],
        "bed_unbalanced": [b.survey.unbalanced for b in beds],
        "bed_floor_share_of_weight": [b.floor_share_of_weight for b in beds],
        "bed_wall_share_of_weight": [b.wall_share_of_weight for b in beds],
        "floor_count": counts,
        "particle_bed": np.repeat(np.arange(len(beds)), np.diff(offset)),
        "particle_class": kind,
        "particle_radius": np.concatenate([b.radius for b in beds]),
        "position": np.array([np.concatenate([b.states[n] for b in beds]) for n in names]),
        "velocity": np.concatenate([b.velocity for b in beds]),
        "floor_force": force,
        "coordination": np.concatenate([b.coordination for b in beds]),
        "contact_particle": np.concatenate([b.pair + offset[i] for i, b in enumerate(beds)]),
        "contact_normal": np.concatenate([b.normal for b in beds]),
        "contact_force": np.concatenate([b.push for b in beds]),
        "bed_periodic": np.full(len(beds), scene.box.sides == "periodic"),
        "state_contact_count": [[len(b.state_forces[n].pair) for n in names] for b in beds],
        "state_contact_particle": np.concatenate(
            [
                np.where(b.state_forces[n].pair >= 0, b.state_forces[n].pair + offset[i], -1)
                for i, b in enumerate(beds)
                for n in names
            ]
        ),
        "state_contact_force": np.concatenate([b.state_forces[n].force for b in beds for n in names]),
        "state_contact_arm": np.concatenate([b.state_forces[n].arm for b in beds for n in names]),
        "state_name": np.array(names),
        "state_time": np.array([[b.state_times[n] for n in names] for b in beds]),
        "sample_bed": np.repeat(np.arange(len(beds)), [len(b.history) for b in beds]),
        **{name: history[:, i] for i, name in enumerate(HISTORY)},
    }


def _write_last_good(output: Path, state: Snapshot) -> Path:
    path = beside(output, LAST_GOOD + ".vtu")
    data = {"radius": state.radius, "class": state.kind, "velocity": state.velocity}
    write_vtu(path, state.position, {"vertex": np.arange(len(state.radius))[:, None]}, data)
    return path


def _write_vtk(output: Path, law: LinearLaw, bed: Bed, fields: Sequence[str] | None) -> None:
    """Spheres as points with a radius (glyph them in ParaView), one file per phase; forces for the last."""
    with vtu_series(output, "", fields) as series:
        cells = {"vertex": np.arange(len(bed.radius))[:, None]}
        last = list(bed.states)[-1]
        for name, position in bed.states.items():
            at_end = name == last
            series.add(
                bed.state_times[name],
                position,
                cells,
                {
                    "radius": bed.radius,
                    "class": bed.kind,
                    "velocity": bed.velocity if at_end else np.zeros_like(position),
                    "coordination": bed.coordination if at_end else np.zeros_like(bed.coordination),
                    "floor_force": bed.floor_force if at_end else np.zeros_like(bed.floor_force),
                },
            )
