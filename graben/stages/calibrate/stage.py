"""calibrate: from stress-strain curves to the parameters of a law, and what the curves cannot tell."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graben.errors import BadInput, Fault, Incomplete, Refused
from graben.mechanics.fitting.agreement import agreement
from graben.mechanics.fitting.curves import Curve
from graben.mechanics.fitting.first_state import settle
from graben.mechanics.fitting.identifiability import identify
from graben.mechanics.materials.laws import LAWS
from graben.schemas.files import together
from graben.schemas.layouts.calibration import LAYOUT
from graben.schemas.outputs import MATERIAL, PARTIAL, STATE, Outputs, beside, files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.schemas.scenes.material import material_text, write_material
from graben.stages.calibrate.compare import Candidate, cross_validate, label, rivals
from graben.stages.calibrate.compare import compare as compared
from graben.stages.calibrate.measured import Reading, read_files
from graben.stages.calibrate.output import arrays_of, distinct, headline_of, measures_of, note_of
from graben.stages.calibrate.problem import Problem, problem_of, sizes_of
from graben.stages.calibrate.state import State
from graben.stages.calibrate.workers import workers_of
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.estimate import Estimate, refuse_too_large
from graben.stages.shared.last_good import keep_by, keeps_last_good, write_whole
from graben.stages.shared.measures import warnings_of
from graben.stages.shared.record import Progress, Record, silent

_NEAR = 1.1  # members of the ensemble: objective up to this multiple of the best


@dataclass(frozen=True)
class Prepared:
    """A checked scene whose search has not begun: files of curves, its problem and those of rivals, curves,
    how each file was read, sizes."""

    sources: list[Path]
    problem: Problem
    others: list[Problem]
    measured: list[Curve]
    unseen: list[Curve]
    read: dict[str, Any]
    sizes: list[Estimate]


def prepare(
    scene: CalibrateScene,
    curves: Sequence[Path] = (),
    validate: Sequence[Path] = (),
    compare: Sequence[Path] = (),
    threads: int = 1,
) -> Prepared:
    """Curves and problems of a scene, after every check that the run makes; parameters as in `run`.

    Raises
    ------
    BadInput : the scene, a curve or a rival has faults, or the search would be too large
    Incomplete : no other fault than that the call must name the curves
    """
    file, names = scene.source.path, list[str]()
    problem = problem_of(scene, file, label(file, names), threads)
    others = rivals(compare, scene, names, threads)
    sources = [Path(p) for p in (curves or scene.curves)]
    if not sources:
        expected = "at least one file of curves, here or in the call"
        raise Incomplete(Fault(str(file), "curves", "[]", expected))
    files = read_files([*sources, *validate], reading_of(scene))
    measured = [curve for part in files[: len(sources)] for curve in part.curves]
    unseen = [curve for part in files[len(sources) :] for curve in part.curves]
    sizes = _checked([problem, *others], measured)
    read = {part.file: part.read for part in files}
    return Prepared(sources, problem, others, measured, unseen, read, sizes)


def prepare_curves(scene: CalibrateScene, measured: list[Curve]) -> Prepared:
    """As `prepare`, for curves that lie in no file."""
    file = scene.source.path
    problem = problem_of(scene, file, label(file, []), scene.workers if scene.search != "appso" else 1)
    return Prepared([], problem, [], measured, [], {}, _checked([problem], measured))


def reading_of(scene: CalibrateScene) -> Reading:
    """How the scene says to read curves."""
    return Reading(scene.test, scene.csv.sign, scene.csv.allow_tension, scene.csv.allow_narrowing)


def _checked(problems: Sequence[Problem], measured: Sequence[Curve]) -> list[Estimate]:
    sizes = sizes_of(problems[0], len(problems) - 1, measured)
    refuse_too_large(problems[0].scene.source.path, sizes)
    for p in problems:
        try:
            p.check(measured)
        except Refused as error:
            raise BadInput(Fault(str(p.scene.source.path), "", "", f"a law that can be fitted ({error})")) from error
    return sizes


@dataclass(frozen=True)
class Fitted:
    """What the curves tell, of which nothing is written.

    headline : numbers; material : law's parameters in SI, fixed and found, and the note of their file
    arrays, attributes, cost : of the artifact
    """

    headline: dict[str, Any]
    material: dict[str, Any]
    note: str
    arrays: dict[str, Any]
    attributes: dict[str, Any]
    cost: dict[str, Any]


@keeps_last_good("no start of the search had finished yet")
def run(
    given: Given,
    output: Path,
    *,
    curves: Sequence[Path] = (),
    validate: Sequence[Path] = (),
    compare: Sequence[Path] = (),
    cluster: str | None = None,
    restart: bool = False,
    overrides: Overrides = (),
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Fit the scene's law to its curves (or to the files `curves` instead); predict the curves of `validate`.

    Writes `output` (kind "calibration") and NAME.material.toml beside it; returns the headline
    numbers: rmse_pa, parameters (SI), per curve errors, what is not identifiable, validation_rmse_pa where
    asked, and `read`: how each file was read.

    Parameters
    ----------
    compare : other calibrate scenes, whose laws are fitted to the same curves and cross-validated beside this one's
    cluster : address of a Dask scheduler whose workers take starts, or the particles of the asynchronous swarm
    restart : go on from NAME.state.npz, which an interrupted run leaves; the result is that of a
        straight run

    Raises
    ------
    BadInput : the scene or a curve has faults, or an output exists
    """
    scene: CalibrateScene = load_scene(given, "calibrate", overrides)
    outputs = Outputs(output, (MATERIAL,), kept=(STATE, PARTIAL))
    read = [*files_of(scene), *curves, *validate, *compare]
    outputs.claim(read, overwrite=overwrite, restart=restart)
    material_path = beside(output, MATERIAL)
    # Processes and clusters share out whole candidates; threads within them would only quarrel.
    threads = scene.workers if scene.search != "appso" and cluster is None else 1
    prepared = prepare(scene, curves, validate, compare, threads)
    sources, problem, others = prepared.sources, prepared.problem, prepared.others
    record = Record.begin(scene, [*sources, *validate, *compare])
    laws = [p.scene.law for p in (problem, *others)]
    checkpoint = Checkpoint.of(output, scene, record, laws, STATE)
    with workers_of(scene.search, scene.workers, problem.plan.particles, cluster) as workers:
        state = State(checkpoint, workers)
        if restart:
            state.load()
        keep_by(lambda why: checkpoint.path if any(state.starts.values()) else None)
        with checkpoint.guarding():
            fitted = fit_curves(prepared, state, progress)
            record.cost.update(fitted.cost)
            fitted.headline["warnings"] = record.warn(fitted.headline["warnings"])
            with together():
                write_material(material_path, scene.law, fitted.material, fitted.note, record.warnings)
                write_whole(output, LAYOUT, fitted.arrays, record, fitted.attributes)
    progress(1.0, "done")
    return {**fitted.headline, "read": prepared.read, "output": str(output), "material": str(material_path)}


def fit_curves(prepared: Prepared, state: State, progress: Progress = silent) -> Fitted:
    """Search for the parameters, and find out how well the curves tell them.

    state : who helps, and what is done already
    """
    problem, others = prepared.problem, prepared.others
    measured, unseen = prepared.measured, prepared.unseen
    scene = problem.scene
    folds = scene.cross_validation or bool(others)
    share = 0.95 / (1 + folds + 2 * len(others))
    objective, found = problem.solve(
        measured, problem.plan, state, "all curves", lambda part, words: progress(share * part, words)
    )
    settled = settle(objective, found.best)
    fit, best = objective.fit, settled.best
    evaluations = found.evaluations + best.evaluations - found.best.evaluations
    values = fit.used(problem.box.to_values(best.x))
    errors = fit.errors(values)
    holdout, candidates = None, []
    if folds:
        holdout = cross_validate(problem, measured, state, lambda part, words: progress(share * (1 + part), words))
    if others and holdout is not None:
        first = Candidate(problem.name, scene.law, problem.box.size, errors["stress"], holdout)
        rest = compared(
            others, measured, state, lambda part, words: progress(share * 2 + (0.95 - 2 * share) * part, words)
        )
        candidates = [first, *rest]
    data = slice(0, fit.groups.size)  # priors follow
    known = identify(
        best.x, best.residuals[data], best.jacobian[data], groups=fit.groups, lag=scene.correlation_length,
        precision=problem.priors.precision(problem.box.size), beside=settled.beside[data], noise=settled.noise[data],
        floor=fit.floor,
    )  # fmt: skip
    starts = agreement(found.ends, found.end_values, known.robust_error, points=fit.groups.size, floor=fit.floor)
    near = found.member_values <= _NEAR * found.best.value
    members = distinct(found.members[near])
    material = {**problem.fixed, **dict(zip(problem.box.names, (float(v) for v in values)))}
    ordered = {p.name: material[p.name] for p in LAWS[scene.law].parameters if p.name in material}
    note = note_of(scene, measured, errors)
    arrays = arrays_of(problem, fit, measured, unseen, values, known, errors, holdout, members, found, candidates)
    cost = {
        "evaluations": evaluations, "curves": len(measured), "increments_per_point": problem.increments,
        "objective": best.value,
    }  # fmt: skip
    attributes = {
        "law": scene.law,
        "material": material_text(scene.law, ordered, note),
        "rmse_pa": errors["stress"],
        "objective": best.value,
        "search_ended": best.reason,
        "starts": starts.verdict,
        "read": json.dumps(prepared.read),
    }
    headline = headline_of(
        scene, problem, measured, unseen, values, known, starts, errors, holdout, arrays, candidates
    )
    headline["warnings"] = warnings_of(measures_of(headline))
    return Fitted(headline, ordered, note, arrays, attributes, cost)
