"""scratch: a rigid grain indents a specimen, slides and lifts; the groove is measured along the way."""

from __future__ import annotations

import math
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.materials.law import Law
from graben.mechanics.materials.laws import LAWS
from graben.mechanics.scratch import run as mechanics
from graben.mechanics.scratch.mesh import HexMesh, cells_along, specimen
from graben.mechanics.scratch.setup import Damage, Numerics, Tip
from graben.schemas.outputs import CHECKPOINT, LAST_GOOD, PARTIAL, SERIES, Outputs, files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.schemas.scenes.scratch import ScratchScene
from graben.stages.scratch.output import LEAST, measure_groove, write_last_good, write_run
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.estimate import Estimate, refuse_too_large, work
from graben.stages.shared.fidelity import factor_of
from graben.stages.shared.last_good import keep_by, keeps_last_good
from graben.stages.shared.material import pack_material
from graben.stages.shared.measures import Measure, warnings_of
from graben.stages.shared.record import Progress, Record, silent

# Laws whose strain increments may add up to plastic strains of order 1 under the tip.
_TAKES = ("elastic", "j2", "erve", "drucker-prager")
_BRICK_BYTES = 2000.0
_STATE_BYTES = 400.0


@keeps_last_good("the tip had not moved yet")
def run(
    given: Given,
    output: Path,
    *,
    material: Path | None = None,
    overrides: Overrides = (),
    overwrite: bool = False,
    restart: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run a scratch scene; write its artifact, and VTU files with a PVD beside it.

    Parameters
    ----------
    material : a file with law and parameters that replaces the scene's
    restart : go on from NAME.checkpoint.npz, which a run that was stopped left beside the output

    Returns
    -------
    headline numbers: groove_area_m2, shoulder_area_m2, degree_of_wear (after lifting, at s_over_a),
    degree_of_wear_loaded, degree_of_wear_by_s_over_a, degree_of_penetration, normal_force_n, tangential_force_n,
    energy_error, elements, steps, warnings

    Raises
    ------
    BadInput : the scene or the material has faults, or the output exists
    NumericsFailed : energy, volume or mass error beyond the scene's limits; the last good state is kept as VTU
    """
    scene: ScratchScene = load_scene(given, "scratch", overrides)
    outputs = Outputs(output, SERIES, kept=(CHECKPOINT, LAST_GOOD + ".vtu", PARTIAL))
    outputs.claim([*files_of(scene), material], overwrite=overwrite, restart=restart)
    law, par, inputs, _ = prepare(scene, material)
    record = Record.begin(scene, inputs)
    checkpoint = Checkpoint.of(output, scene, record, [law.name])
    stored = checkpoint.read() if restart else None
    mesh = mesh_of(scene)
    progress(0.0, f"{len(mesh.cells)} elements")
    with checkpoint.guarding():
        try:
            with checkpoint.bringing_back() if restart else nullcontext():
                result = mechanics.simulate(
                    mesh,
                    law.id,
                    par,
                    law.initial_state(par),
                    scene.specimen.density,
                    Tip(scene.tip.radius, scene.tip.friction, scene.tip.start, scene.tip.depth, scene.tip.path),
                    numerics_of(scene),
                    _damage(scene, law),
                    scene.output.frames,
                    progress,
                    _slots(law),
                    checkpoint.keep,
                    stored,
                )
        except mechanics.ScratchFailed as failure:
            state = failure.last_good
            keep_by(lambda why: write_last_good(output, mesh, state))
            raise
        progress(0.99, "sections")
        groove = measure_groove(scene, mesh, result)
        headline = {**groove.headline, **_cost(result)}
        headline["warnings"] = record.warn(warnings_of(_measures(headline, scene.tip.depth)))
        record.cost.update(result.cost)
        record.cost.update({k: headline[k] for k in ("energy_error", "hourglass_share", "kinetic_share_sliding")})
        record.cost["mesh_size_m"] = mesh_size(scene)
        write_run(output, record, scene, mesh, result, groove)
    progress(1.0, "done")
    return headline


def prepare(scene: ScratchScene, material: Path | None = None) -> tuple[Law, np.ndarray, list[Path], list[Estimate]]:
    """Law, packed parameters, the files that they came from, and sizes, after every check that the run makes.

    Raises
    ------
    BadInput : the material has faults, or the run would be too large
    """
    file = scene.source.path
    source = material if material is not None else scene.material.file
    law, par, _ = pack_material(material if material is not None else scene.material, file)
    _check_law(scene, law, str(source or file))
    sizes = _sizes(scene)
    refuse_too_large(file, sizes)
    return law, par, [] if source is None else [source], sizes


def _sizes(scene: ScratchScene) -> list[Estimate]:
    """Bricks, saved states, and steps by the speeds of the tip and the time that a wave takes across a brick."""
    s, t, n, size = scene.specimen, scene.tip, numerics_of(scene), mesh_size(scene)
    reach = 1.6 * scene.contact_half_width
    fine = min(2.0 * reach + t.path, s.length)
    bricks = (
        cells_along(s.length - fine, fine, size, scene.mesh.growth)
        * cells_along(max(0.0, 0.5 * s.width - reach), min(reach, 0.5 * s.width), size, scene.mesh.growth)
        * cells_along(s.thickness, min(2.0 * size, s.thickness), size, scene.mesh.growth_depth)
    )
    steps = (
        1.5 * (t.depth / n.indent_speed + t.path / n.slide_speed + 1.1 * t.depth / n.lift_speed) / (n.safety * size)
    )
    states = 3.0 + scene.output.frames
    sections = float(scene.output.sections * scene.output.points)
    key, value = "mesh.size", f"{scene.mesh.size:g} m"
    return [
        Estimate("bricks", bricks, bricks * _BRICK_BYTES, key, value),
        Estimate("saved states", states, states * bricks * _STATE_BYTES, "output.frames", str(scene.output.frames)),
        Estimate("points of sections", sections, 200.0 * sections, "output.points", str(scene.output.points)),
        work("brick-steps", bricks, steps, key, value),
    ]


def mesh_size(scene: ScratchScene) -> float:
    """Edge under the path [m] at the scene's fidelity."""
    return scene.mesh.size * factor_of(scene, "mesh.size")


def mesh_of(scene: ScratchScene) -> HexMesh:
    """The half specimen's mesh at the scene's fidelity."""
    s, t = scene.specimen, scene.tip
    return specimen(
        s.length,
        0.5 * s.width,
        s.thickness,
        t.start,
        t.path,
        scene.contact_half_width,
        mesh_size(scene),
        scene.mesh.growth,
        scene.mesh.growth_depth,
    )


def numerics_of(scene: ScratchScene) -> Numerics:
    """The run's numerics at the scene's fidelity."""
    n = scene.numerics
    return Numerics(
        points=n.points,
        indent_speed=factor_of(scene, "numerics.indent_speed") * n.indent_speed,
        slide_speed=factor_of(scene, "numerics.slide_speed") * n.slide_speed,
        lift_speed=factor_of(scene, "numerics.lift_speed") * n.lift_speed,
        safety=n.safety,
        floor=n.floor,
        mass_cap=n.mass_cap,
        refresh=n.refresh,
        hourglass=n.hourglass,
        viscosity=n.viscosity,
        penalty=n.penalty,
        volume_limit=n.volume_limit,
        energy_limit=n.energy_limit,
    )


def _check_law(scene: ScratchScene, law: Law, file: str) -> None:
    if law.name not in _TAKES:
        raise BadInput(Fault(file, "law", repr(law.name), "one of " + ", ".join(n for n in _TAKES if n in LAWS)))
    if scene.damage is not None and law.name != "erve":
        raise BadInput(Fault(file, "law", repr(law.name), "'erve', because the scene has [damage]"))


def _slots(law: Law) -> tuple[int, int]:
    """Slots of equivalent plastic strain and damage in the law's state, -1 where it has none."""
    names = law.state_names
    plastic = "equivalent_plastic_strain"
    return (
        names.index(plastic) if plastic in names else -1,
        names.index("damage") if "damage" in names and law.name != "elastic" else -1,
    )


def _damage(scene: ScratchScene, law: Law) -> Damage | None:
    if scene.damage is None:
        return None
    return Damage(scene.damage.growth_per_joule, scene.damage.remove_at, law.index("max_damage_step"))


def _measures(headline: dict[str, Any], depth: float) -> list[Measure]:
    """What a user should know before trusting the groove."""
    # Wear by damage that took everything is the setting's, not the metal's.
    all_gone = headline["degree_of_wear"] if headline["removed_elements"] > 0 else None
    return [
        Measure(
            "energy_error", headline["energy_error"], 0.015,
            "the energy balance is off by {percent} of the work of the tip: lower the speeds in numerics",
        ),
        Measure(
            "hourglass_share", headline["hourglass_share"], 0.05,
            "work against hourglass control is {percent} of the internal energy (5 % is the most to trust): use a "
            "smaller mesh.size or numerics.points = 8",
        ),
        Measure(
            "kinetic_share_sliding", headline["kinetic_share_sliding"], 0.05,
            "kinetic energy is {percent} of the internal energy while sliding: lower numerics.slide_speed",
        ),
        Measure(
            "groove_depth_m", headline["groove_depth_m"] / depth, math.inf,
            "the groove is {percent} as deep as the tip went: the specimen sprang back, and has no degree of wear",
            least=LEAST,
        ),
        Measure(
            "tip_overlap_share", headline["tip_overlap_share"], 0.2,
            "the tip overlaps the surface by {percent} of its depth, by which the groove is too shallow: raise "
            "numerics.penalty",
        ),
        Measure(
            "degree_of_wear", all_gone, 0.99,
            "damage removed the whole track: the degree of wear follows from the damage settings, not the steel",
        ),
    ]  # fmt: skip


def _cost(result: mechanics.ScratchRun) -> dict[str, Any]:
    external = float(result.energy["external"].max())
    phases = list(result.phases)
    moving = result.phase == (phases.index("slide") if "slide" in phases else phases.index("indent"))
    internal = np.maximum(result.energy["internal"], 1e-300)
    share = (result.energy["kinetic"] / internal)[moving]
    return {
        "energy_error": float(result.error[result.energy["external"] > 0.1 * external].max()),
        "hourglass_share": float(result.energy["hourglass"][-1] / result.energy["internal"][-1]),
        "kinetic_share_sliding": float(np.median(share)),
        "volume_ratio_min": result.cost["volume_ratio_min"],
        "volume_ratio_max": result.cost["volume_ratio_max"],
        "tip_overlap_share": result.cost["tip_overlap_share"],
        "removed_elements": int(result.cost["removed_elements"]),
        "elements": int(result.cost["elements"]),
        "steps": int(result.cost["steps"]),
    }
