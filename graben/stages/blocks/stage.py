"""dem-run for kind "blocks": tessellate, bring to rest, load, save."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, NumericsFailed, Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.protocol import Loading
from graben.mechanics.blocks.record.history import History
from graben.schemas.artifact import write_artifact
from graben.schemas.files import together
from graben.schemas.layouts.blocks import LAYOUT
from graben.schemas.outputs import CHECKPOINT, PARTIAL, SERIES, Outputs, beside
from graben.schemas.scenes.blocks import BlocksScene
from graben.stages.blocks.biaxial import BiaxialReport, biaxial
from graben.stages.blocks.checkpoint import bring_back, state_of, states_of
from graben.stages.blocks.extent import extent_of, map_of
from graben.stages.blocks.geometry import Ground, lay_out
from graben.stages.blocks.model import block_model
from graben.stages.blocks.output import SPARE, write_vtk
from graben.stages.blocks.programme import ProgrammeReport, programme
from graben.stages.blocks.report import Report, turnover
from graben.stages.blocks.sizes import sizes_of, steps_of
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.estimate import Estimate, refuse_too_large
from graben.stages.shared.fields import kept
from graben.stages.shared.last_good import keep_by, keeps_last_good, write_whole
from graben.stages.shared.measures import warnings_of
from graben.stages.shared.record import Progress, Record, silent

# How a loading went that follows a force check.
_PACED = ("loading_steps", "force_check_worst", "force_check_mean")


def outputs_of(scene: BlocksScene, output: Path) -> Outputs:
    """What a run writes, and what it leaves when it stops."""
    series = (*SERIES, *("-joints" + end for end in SERIES)) if scene.output.vtk else ()
    return Outputs(output, series, kept=(CHECKPOINT, PARTIAL))


@keeps_last_good("no state had been saved yet; the first one is saved when the blocks have come to rest")
def run(scene: BlocksScene, output: Path, *, restart: bool = False, progress: Progress = silent) -> dict[str, Any]:
    """Run a scene of blocks, write the artifact and its VTU files.

    restart : go on from NAME.checkpoint.npz, which a run that was stopped left beside the output

    Returns
    -------
    headline numbers of the test, see `BiaxialReport.headline` and `ProgrammeReport.headline`

    Raises
    ------
    BadInput : the mechanics refuse the scene; NumericsFailed : the run had to stop. What was saved until then is
    written as NAME.partial.nc beside the output.
    """
    prepared = prepare(scene)
    ground, model, test, report = prepared.ground, prepared.model, prepared.test, prepared.report
    record = Record.begin(scene)
    checkpoint = Checkpoint.of(output, scene, record)
    stored = checkpoint.read() if restart else None
    progress(0.0, f"{ground.blocks.size} blocks come to rest")
    if stored is None:
        for moment in test.begin():
            progress(moment.fraction, moment.words)
    history = History(model, scene.output.balance)
    if stored is not None:
        with checkpoint.bringing_back():
            bring_back(stored, model, test, history)
    sound = len(history.time)  # states that passed every check

    def written(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return kept(scene.output.fields, ground.placed(arrays), SPARE)

    def keep(why: str) -> Path | None:
        if not sound:
            return None
        history.cut(sound)
        path = beside(output, PARTIAL)
        write_artifact(path, LAYOUT, written(_arrays(model, history, report)), record, partial=why)
        return path

    keep_by(keep)

    with checkpoint.guarding():
        for moment in test.run():
            if moment.save:
                history.save()
                if not test.failed:
                    _check_ledger(history, scene.numerics.energy_limit, model.steps_done)
                sound = len(history.time)
                checkpoint.keep(lambda: state_of(model, test), later=states_of(history))
            progress(moment.fraction, moment.words)
        arrays = _arrays(model, history, report)
        headline = report.headline(arrays) | ground.mended
        headline["warnings"] = record.warn(warnings_of(report.measures(headline)))
        arrays = ground.placed(arrays)
        of_rock = model.bodies.vertex_block[model.masses.first[:-1]] < model.bodies.rock
        record.cost |= {
            "steps": model.steps_done,
            "consolidation_steps": int(test.rest[1]),
            "zones": len(arrays["zone_block"]),
            "zone_steps": model.steps_done * len(arrays["zone_block"]),
            "contact_searches": model.rebuilds,
            "time_step_s": model.dt,
            "mass_ratio_median": float(np.median(model.mass_ratio[of_rock])),
            "mass_ratio_max": float(model.mass_ratio[of_rock].max()),
            "consolidation_unbalanced_force_ratio": float(test.rest[0]),
            "largest_overlap_m": max(history.overlap),
            **{name: headline[name] for name in (*report.errors, *_PACED) if name in headline},
            **{f"block_{name}": value for name, value in ground.blocks.statistics().items()},
            **ground.mended,
            **({"local_origin_m": ground.origin.tolist()} if ground.origin.any() else {}),
        }
        with together():
            if scene.output.vtk:
                write_vtk(output, arrays, scene.output.fields)
            write_whole(output, LAYOUT, kept(scene.output.fields, arrays, SPARE), record)
    return headline


@dataclass(frozen=True)
class Prepared:
    """A checked scene whose work has not begun."""

    ground: Ground
    model: BlockModel
    test: Loading
    report: Report
    sizes: list[Estimate]


def prepare(scene: BlocksScene) -> Prepared:
    """Blocks, joints and loading of a scene, after every check that the run makes; nothing has moved.

    Raises
    ------
    BadInput : the scene is too large, or the mechanics refuse it
    """
    file, biaxial_test = scene.source.path, scene.programme is None
    given = map_of(scene)
    extent = extent_of(scene, given)
    sizes = sizes_of(scene, extent)
    refuse_too_large(file, sizes)
    ground = lay_out(scene, given)
    scene = ground.scene
    steps = steps_of(scene, extent, ground.blocks.size)
    if biaxial_test and scene.loading.states > steps + 1:
        expected = f"at most {steps + 1}: one state a step"
        raise BadInput(Fault(str(file), "loading.states", str(scene.loading.states), expected))
    try:
        model = block_model(scene, ground.blocks, steps)
        test, report = _test(scene, model, steps)
    except Refused as error:
        key = "loading" if biaxial_test else "programme"
        raise BadInput(Fault(str(file), key, "", str(error))) from error
    return Prepared(ground, model, test, report, sizes)


def _test(scene: BlocksScene, model: BlockModel, steps: int) -> tuple[Loading, Report]:
    if scene.programme is None:
        compression = biaxial(scene, model, steps)
        return compression, BiaxialReport(scene, compression)
    rising = programme(scene, model, steps)
    return rising, ProgrammeReport(scene, rising)


def _check_ledger(history: History, limit: float, step: int) -> None:
    e = history.model.energies()
    first = history.rows["energy"][0][-1]
    # The kinetic energy is that of half a step before the stored one: after a shock it is off by up to its size.
    error = max(abs(e["error"] - first) - e["kinetic"], 0.0) / max(turnover(e), 1e-300)
    if not error < limit:
        raise NumericsFailed(
            f"energy error {100 * error:.2g} % (limit {100 * limit:.2g} %)",
            step=step,
            advice="take more steps (numerics.steps) or a finer fidelity",
        )


def _arrays(model: BlockModel, history: History, report: Report) -> dict[str, np.ndarray]:
    arrays = history.arrays()
    # The ledger starts at the first state: what is stored then counts as given.
    arrays["energy_error"] = arrays["energy_error"] - arrays["energy_error"][0]
    arrays["outline"] = model.bodies.outline
    return arrays | report.arrays(history)
