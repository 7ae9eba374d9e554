"""dem-run for kind "blocks": tessellate, consolidate, compress, save."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.blocks.bodies import build_bodies
from graben.mechanics.blocks.compression import compress, consolidate, rectangle_sides
from graben.mechanics.blocks.history import History, mean_stress
from graben.mechanics.blocks.joints import Joint
from graben.mechanics.blocks.model import BlockModel, Damping
from graben.mechanics.blocks.tessellation import Tessellation, voronoi_blocks
from graben.mechanics.failure import NumericsFailed
from graben.schemas.artifact import write_artifact
from graben.schemas.faults import BadInput, Fault
from graben.schemas.layouts.blocks import LAYOUT
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.vtk import VtuSeries
from graben.stages.record import Progress, Record, silent

# Steps of loading for each fidelity; their measured trade is in docs/dem-run-blocks.md
FIDELITY = {"draft": 12_500, "standard": 50_000, "reference": 200_000}


def run(scene: BlocksScene, output: Path, *, progress: Progress = silent) -> dict[str, Any]:
    """Run a scene of blocks, write the artifact and its VTU files.

    Returns
    -------
    headline numbers: peak of the top wall's mean stress (Pa, compression negative), nominal strain there, and the
    run's own error measures

    Raises
    ------
    BadInput : the mechanics refuse the scene; NumericsFailed : the run had to stop. What was saved until then is
    written as NAME.partial.nc beside the output.
    """
    record = Record.begin(scene)
    steps = scene.numerics.steps or FIDELITY[scene.fidelity]
    try:
        tessellation = _tessellation(scene)
        model = _model(scene, tessellation, scene.loading.duration / steps)
    except ValueError as error:
        raise BadInput(Fault(str(scene.source.path), "", "", f"a scene that can be run ({error})")) from error
    progress(0.0, f"consolidation of {tessellation.size} blocks")
    pressure = scene.loading.confining_pressure
    unbalanced = consolidate(
        model,
        -pressure,
        -pressure * scene.loading.vertical_ratio,
        tolerance=scene.numerics.consolidation_tolerance,
    )
    consolidation_steps = model.steps_done
    history = History(model)
    states = scene.loading.states

    def save(k: int, _: BlockModel) -> None:
        history.save()
        _check_ledger(history, scene.numerics.energy_limit, model.steps_done)
        progress(k / (states - 1), f"state {k} of {states - 1}")

    try:
        compress(model, -scene.loading.speed, steps, states, save)
    except NumericsFailed:
        if history.time:
            partial = output.with_name(output.stem + ".partial.nc")
            write_artifact(partial, LAYOUT, _arrays(scene, model, history), record)
        raise
    arrays = _arrays(scene, model, history)
    headline = _headline(scene, model, arrays)
    record.cost |= {
        "steps": model.steps_done,
        "consolidation_steps": consolidation_steps,
        "zones": len(arrays["zone_block"]),
        "zone_steps": model.steps_done * len(arrays["zone_block"]),
        "contact_searches": model.rebuilds,
        "time_step_s": model.dt,
        "mass_ratio_median": float(np.median(model.mass_ratio)),
        "mass_ratio_max": float(model.mass_ratio.max()),
        "consolidation_unbalanced_force_ratio": unbalanced,
        "largest_overlap_m": max(history.overlap),
        **{name: headline[name] for name in ERRORS},
        **{f"block_{name}": value for name, value in tessellation.statistics().items()},
    }
    write_artifact(output, LAYOUT, arrays, record)
    if scene.output.vtk:
        _write_vtk(output, arrays)
    return headline


ERRORS = (
    "energy_error",
    "kinetic_over_stored_energy",
    "lateral_over_applied_stress",
    "bottom_over_top_reaction",
)


def _tessellation(scene: BlocksScene) -> Tessellation:
    t, d = scene.tessellation, scene.domain
    outline = np.array([[0.0, 0.0], [d.width, 0.0], [d.width, d.height], [0.0, d.height]])
    return voronoi_blocks(outline, t.edge, scene.seed, t.lloyd_passes, t.shortest_edge)


def _model(scene: BlocksScene, tessellation: Tessellation, dt: float) -> BlockModel:
    j = scene.joints
    joint = Joint(
        j.normal_stiffness,
        j.shear_stiffness,
        float(np.tan(j.friction)),
        j.cohesion,
        j.tension,
        float(np.tan(j.dilation)),
        np.inf if j.dilation_limit is None else j.dilation_limit,
    )
    return BlockModel(
        build_bodies(tessellation, scene.tessellation.zone_edge),
        young=scene.rock.young,
        poisson=scene.rock.poisson,
        density=scene.rock.density,
        joint=joint,
        rounding=scene.tessellation.rounding,
        dt=dt,
        damping=Damping(ratio=scene.numerics.damping_ratio),
    )


def _check_ledger(history: History, limit: float, step: int) -> None:
    e = history.model.energies()
    turnover = abs(e["boundary"]) + abs(e["external"]) + e["strain"] + e["joint"]
    first = history.rows["energy"][0][-1]
    error = abs(e["error"] - first) / turnover
    if not error < limit:
        raise NumericsFailed(
            f"energy error {100 * error:.2g} % (limit {100 * limit:.2g} %)",
            step=step,
            advice="take more steps (numerics.steps) or a finer fidelity",
        )


def _arrays(scene: BlocksScene, model: BlockModel, history: History) -> dict[str, np.ndarray]:
    arrays = history.arrays()
    # The ledger starts at the first state: what is stored then counts as given.
    arrays["energy_error"] = arrays["energy_error"] - arrays["energy_error"][0]
    arrays["confining_stress"] = np.array(-scene.loading.confining_pressure)
    arrays["outline"] = model.bodies.outline
    return arrays


def _headline(scene: BlocksScene, model: BlockModel, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    sides = rectangle_sides(model.bodies.outline)
    push = arrays["wall_reaction"]
    vertical = push[:, sides.top, 1] / scene.domain.width
    peak = int(np.argmin(vertical))
    middle = arrays["vertex_position"][arrays["zone_vertex"]].mean(axis=1)
    centre = np.array([scene.domain.width, scene.domain.height]) / 2.0
    inside = np.hypot(*(middle - centre).T) < 0.4 * min(scene.domain.width, scene.domain.height)
    area = model.skeleton.area
    lateral = mean_stress(arrays["zone_stress"], area, inside if inside.any() else area > 0.0)[:, 0]
    stored = arrays["energy_strain"] + arrays["energy_joint"]
    work = abs(arrays["energy_boundary"]) + abs(arrays["energy_external"]) + stored
    after = slice(1, peak + 1) if peak > 0 else slice(None)
    return {
        "blocks": len(arrays["block_area"]),
        "confining_stress_pa": float(arrays["confining_stress"]),
        "peak_wall_stress_pa": float(vertical[peak]),
        "strain_at_peak": float(-scene.loading.speed * arrays["time"][peak] / scene.domain.height),
        "steps": model.steps_done,
        "energy_error": float((np.abs(arrays["energy_error"]) / work).max()),
        "kinetic_over_stored_energy": float((arrays["energy_kinetic"] / stored)[after].mean()),
        "lateral_over_applied_stress": float(lateral[after].mean() / arrays["confining_stress"]),
        "bottom_over_top_reaction": float((push[after, sides.bottom, 1] / -push[after, sides.top, 1]).mean()),
    }


def _write_vtk(output: Path, arrays: dict[str, np.ndarray]) -> None:
    """Zones in NAME.pvd, contacts as lines in NAME-joints.pvd, one VTU a state each."""
    zones, joints = VtuSeries(output), VtuSeries(output.with_name(output.stem + "-joints.nc"))
    reference = arrays["vertex_position"]
    end = np.concatenate([[0], np.cumsum(arrays["contact_count"])])
    for k, time in enumerate(arrays["time"]):
        stress = arrays["zone_stress"][k]
        tensor = np.zeros((len(stress), 6))
        tensor[:, [0, 1, 2, 3]] = stress
        centre = 0.5 * (stress[:, 0] + stress[:, 1])
        radius = np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 3])
        zones.add(
            time,
            reference + arrays["displacement"][k],
            {"triangle": arrays["zone_vertex"]},
            {
                "displacement": arrays["displacement"][k],
                "velocity": arrays["velocity"][k],
                "boundary_force": arrays["boundary_force"][k],
            },
            {
                "stress": tensor,
                "stress_major_compressive": centre - radius,
                "stress_minor_compressive": centre + radius,
                "block": arrays["zone_block"],
            },
        )
        part = slice(end[k], end[k + 1])
        n = int(end[k + 1] - end[k])
        half = 0.5 * arrays["contact_length"][part, None] * arrays["contact_tangent"][part]
        middle = arrays["contact_position"][part]
        joints.add(
            time,
            np.vstack([middle - half, middle + half]),
            {"line": np.column_stack([np.arange(n), np.arange(n) + n])},
            None,
            {
                "state": arrays["contact_state"][part].astype(np.int32),
                "slip": arrays["contact_slip"][part],
                "opening": arrays["contact_opening"][part],
                "normal_stress": arrays["contact_normal_stress"][part],
                "shear_stress": arrays["contact_shear_stress"][part],
                "force": arrays["contact_force"][part],
            },
        )
    zones.close()
    joints.close()
