"""rev-study: averages of one or several runs by radius and place, their scatter, and the radius they recommend."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.averaging.measures import MEASURES, curve_measures
from graben.mechanics.averaging.representative import (
    Convergence,
    Criteria,
    convergence,
    independent_samples,
    once_each,
    recommend,
)
from graben.mechanics.averaging.rev import Circle
from graben.schemas.layouts.rev_study import LAYOUT
from graben.schemas.outputs import CHECKPOINT, PARTIAL, Outputs, files_of
from graben.schemas.scene import load_scene
from graben.schemas.scenes.calibrate import CalibrateScene
from graben.schemas.scenes.rev_study import RevStudyScene
from graben.stages.blocks.history import Run, read_run
from graben.stages.rev_study.calibration import Fits, check_law, chosen_parameters, fit_samples, parameters_of
from graben.stages.rev_study.done import Done, Sample
from graben.stages.rev_study.samples import Chunk, chunks_of, sampled
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.estimate import Estimate, refuse_too_large
from graben.stages.shared.fidelity import setting
from graben.stages.shared.last_good import keeps_last_good, write_whole
from graben.stages.shared.measures import Measure, warnings_of
from graben.stages.shared.record import Progress, Record, silent

_SAMPLE_BYTES = 20_000.0  # curves of a hundred states


def prepare(scene: RevStudyScene, runs: int = 1) -> tuple[CalibrateScene | None, list[Estimate]]:
    """The calibration of a study, if there is one, and sizes, after every check that needs no run.

    Raises
    ------
    BadInput : the scene or its calibration has faults, or the study would be too large
    """
    law: CalibrateScene | None = None
    if scene.calibration is not None:
        law = load_scene(scene.calibration.scene, "calibrate")
        check_law(scene, law)
    places = float(len(scene.samples.centres) or scene.samples.grid**2)
    samples = places * len(scene.samples.radii) * runs
    draws = setting(scene, "tests.resamples")
    columns = runs if runs >= 3 else places * runs
    drawn = 16.0 * draws * columns * len(scene.samples.radii)
    sizes = [
        Estimate("samples", samples, samples * _SAMPLE_BYTES, "samples.grid", str(scene.samples.grid)),
        Estimate("draws of the bootstrap", draws, drawn, "tests.resamples", str(draws)),
    ]
    refuse_too_large(scene.source.path, sizes)
    return law, sizes


@keeps_last_good("not all samples had been averaged yet")
def run(
    inputs: Sequence[Path],
    scene: RevStudyScene,
    output: Path,
    *,
    cluster: str | None = None,
    overwrite: bool = False,
    restart: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Average every run at every radius and centre; test which radius is large enough.

    Parameters
    ----------
    inputs : artifacts of kind "blocks"
    scene : radii, places, tests
    output : artifact of kind "rev-study"
    cluster : address of a Dask scheduler whose workers take the samples; they read the inputs themselves
    restart : go on from NAME.checkpoint.npz, which a study that was stopped left beside the output

    Returns
    -------
    headline numbers: recommended_radius_m (None: no radius can be recommended), reason, and per scalar its mean and
    interval at the largest radius

    Raises
    ------
    BadInput : faults of the inputs, a REV outside a model, runs at different lateral stress, an output that exists
    """
    law, _ = prepare(scene, len(inputs))
    read = files_of(scene) + (files_of(law) if law is not None else [])
    Outputs(output, kept=(CHECKPOINT, PARTIAL)).claim([*inputs, *read], overwrite=overwrite, restart=restart)
    runs = _read(inputs, scene, progress)
    groups = _realizations(runs)
    record = Record.begin(scene, inputs=[*inputs, *([law.source.path] if law else [])])
    checkpoint = Checkpoint.of(output, scene, record, [law.law] if law else [])
    centres = _centres(runs, scene)
    chunks = chunks_of(runs, centres, scene)
    done = Done(checkpoint.keep)
    if restart:
        stored = checkpoint.read()
        fits = len(scene.samples.radii) * centres.shape[1] * len(groups) if law else 0
        with checkpoint.bringing_back():
            done.bring_back(stored, [len(places) for _, places in chunks], fits, parameters_of(law) if law else 0)
    with checkpoint.guarding():
        return _study(runs, groups, centres, chunks, scene, law, record, output, cluster, done, progress)


def _study(
    runs: list[Run],
    groups: np.ndarray,
    centres: np.ndarray,
    chunks: list[Chunk],
    scene: RevStudyScene,
    law: CalibrateScene | None,
    record: Record,
    output: Path,
    cluster: str | None,
    done: Done,
    progress: Progress,
) -> dict[str, Any]:
    """All samples and fits that are not done, their statistics, the artifact and its headline numbers."""
    processes = scene.processes or os.cpu_count() or 1
    end = 0.5 if law else 1.0
    samples = sampled(chunks, processes, cluster, done, lambda f, words: progress(end * f, words))
    arrays = _arrays(runs, centres, samples, scene)
    counts = _counts_once(samples, arrays["area"].shape)
    criteria = Criteria(
        scene.tests.confidence,
        scene.tests.tolerance,
        scene.tests.variation,
        setting(scene, "tests.resamples"),
    )
    radii = np.asarray(scene.samples.radii)
    independent = np.minimum(independent_samples(centres[0], radii, len(groups)), counts.sum(axis=(1, 2)))
    by_name = _statistics(arrays, counts, criteria, scene, independent) if groups.shape[1] == 1 else {}
    for name, c in by_name.items():
        arrays |= {f"{name}_{part}": values for part, values in _parts(c).items()}
    chosen: Sequence[str] = scene.curves.properties
    if law is not None:
        middle = int(np.argmin(((centres[0] - centres[0].mean(axis=0)) ** 2).sum(axis=1)))
        fits = fit_samples(
            scene, law, arrays["stress"], arrays["strain"], groups, middle, processes, cluster,
            lambda f, words: progress(0.5 + 0.5 * f, words), done,
        )  # fmt: skip
        chosen = chosen_parameters(scene, fits)
        of_fit = counts[:, :, groups].any(axis=3)
        by_name = {
            name: convergence(np.where(of_fit, values, np.nan), criteria, scene.seed + k, independent)
            for k, (name, values) in enumerate(zip(fits.names, fits.value))
        }
        arrays |= _fit_arrays(runs, groups, fits, by_name)
    missing = [name for name in chosen if name not in by_name]
    if missing:
        wanted = "a value in at least one sample of every radius (does the curve rise, and peak inside the run?)"
        raise BadInput(
            [
                Fault(", ".join(str(r.path) for r in runs), f"curves.properties {name}", "none", wanted)
                for name in missing
            ]
        )
    advice = recommend(radii, {name: by_name[name] for name in chosen}, independent)
    arrays["independent_samples"] = independent
    arrays["recommended_radius"] = advice.radius or 0.0
    record.cost |= {
        "samples": int(arrays["area"].size),
        **({"cluster": cluster} if cluster else {"processes": processes}),
    }
    attributes = {
        "reason": advice.reason,
        "chosen_properties": ", ".join(chosen),
        "confidence": criteria.confidence,
        "tolerance": criteria.tolerance,
        "variation": criteria.variation,
        "bootstrap_over": "runs" if len(groups) >= 3 else "samples",
    }
    if law is not None:
        attributes["law"] = law.law
    none = None if advice.radius else 1.0
    doubt = Measure("recommended_radius_m", none, 0.0, "no radius is recommended: " + advice.reason)
    record.warn(warnings_of([doubt]))
    write_whole(output, LAYOUT, arrays, record, attributes)
    return {
        "recommended_radius_m": advice.radius,
        "reason": advice.reason,
        "warnings": record.warnings,
        "samples": int(arrays["area"].size),
        "realizations": len(groups),
        "properties": [_row(name, c, "_si" if law else None) for name, c in by_name.items()],
    }


def _parts(c: Convergence) -> dict[str, np.ndarray]:
    """Statistics of one scalar by radius, as the layout names them."""
    return {
        "count": c.count,
        "mean": c.mean,
        "deviation": c.deviation,
        "low": c.low,
        "high": c.high,
        "mean_p": c.mean_p,
        "variance_p": c.variance_p,
        "settled": c.settled,
    }


def _fit_arrays(runs: list[Run], groups: np.ndarray, fits: Fits, by_name: dict[str, Convergence]) -> dict[str, Any]:
    parts = [_parts(by_name[name]) for name in fits.names]
    realization = np.empty(len(runs), dtype=np.int64)
    realization[groups] = np.arange(len(groups))[:, None]
    return {
        "run_confining_stress": np.array([source.confining_stress for source in runs]),
        "run_realization": realization,
        "parameter_name": np.array(fits.names),
        "parameter_unit": np.array(fits.units),
        "parameter_lower": fits.box.lower,
        "parameter_upper": fits.box.upper,
        "parameter_identifiable": fits.identifiable,
        "parameter_value": fits.value,
        "parameter_at_bound": fits.at_bound(),
        "fit_rmse": fits.stress_rmse,
        **{f"parameter_{part}": np.array([p[part] for p in parts]) for part in parts[0]},
    }


def _row(name: str, c: Convergence, units: str | None) -> dict[str, Any]:
    if units is None:
        units = {"Pa": "_pa", "1": "", "rad": "_rad"}[LAYOUT.variables[name].units]
    return {
        "name": name,
        f"mean{units}": float(c.mean[-1]),
        f"low{units}": float(c.low[-1]),
        f"high{units}": float(c.high[-1]),
        "variation": float(c.deviation[-1] / abs(c.mean[-1])) if c.mean[-1] else None,
    }


def _read(inputs: Sequence[Path], scene: RevStudyScene, progress: Progress) -> list[Run]:
    """All runs; every fault of any of them at once."""
    runs: list[Run] = []
    faults: list[Fault] = []
    for k, path in enumerate(inputs):
        progress(0.1 * k / len(inputs), f"reading {path.name}")
        try:
            runs.append(read_run(path))
        except BadInput as error:
            faults += error.faults
    for other in runs[1:] if scene.calibration is None else []:
        first = runs[0].confining_stress
        if not _same_stress(other, runs[0]):
            found, expected = (
                f"{other.confining_stress:g} Pa",
                f"{first:g} Pa as in {runs[0].path.name}: one study per lateral stress, unless it calibrates",
            )
            faults.append(Fault(str(other.path), "confining_stress", found, expected))
    for k, other in enumerate(runs):
        twins = [r for r in runs[:k] if r.seed == other.seed >= 0 and _same_stress(r, other)]
        if twins:
            expected = f"another seed than {twins[0].path.name}: the same rock twice is one realization"
            faults.append(Fault(str(other.path), "seed", str(other.seed), expected))
    for source in runs:
        if source.history.time.size < 3:
            faults.append(
                Fault(str(source.path), "dim time", str(source.history.time.size), "at least three saved states")
            )
    if faults:
        raise BadInput(faults)
    return runs


def _same_stress(a: Run, b: Run) -> bool:
    return abs(a.confining_stress - b.confining_stress) <= 1e-6 * max(abs(a.confining_stress), 1.0)


def _realizations(runs: list[Run]) -> np.ndarray:
    """(realization, confinement) indices of runs; a realization is one seed at every lateral stress, weakest first.

    Runs whose seed is not known belong together in the order in which they come at each lateral stress.
    """
    levels: list[list[int]] = []
    for k in sorted(range(len(runs)), key=lambda k: abs(runs[k].confining_stress)):
        if levels and _same_stress(runs[levels[-1][0]], runs[k]):
            levels[-1].append(k)
        else:
            levels.append([k])
    for level in levels:
        level.sort(key=lambda k: runs[k].seed)
    seeds = [[runs[k].seed for k in level] for level in levels]
    faults = []
    for level, found in zip(levels, seeds):
        if found != seeds[0]:
            stress = f"lateral stress {runs[level[0]].confining_stress:g} Pa"
            expected = f"seeds {seeds[0]}, as at {runs[levels[0][0]].confining_stress:g} Pa"
            faults.append(Fault(", ".join(str(runs[k].path) for k in level), stress, f"seeds {found}", expected))
    if faults:
        raise BadInput(faults)
    return np.array(levels, dtype=np.int64).T


def _centres(runs: list[Run], scene: RevStudyScene) -> np.ndarray:
    """(run, centre, 2) m. A grid is as wide as the largest radius leaves room for in each model."""
    largest = scene.samples.radii[-1]
    if scene.samples.centres:
        centres = np.tile(np.asarray(scene.samples.centres, dtype=np.float64), (len(runs), 1, 1))
    else:
        centres = np.array([_grid(source, largest, scene.samples.grid) for source in runs])
    faults = []
    for source, points in zip(runs, centres):
        for point in points:
            faults += source.refuse_outside(Circle((float(point[0]), float(point[1])), largest), "samples.radii")
    if faults:
        raise BadInput(faults)
    return centres


def _grid(source: Run, largest: float, side: int) -> np.ndarray:
    low, high = source.history.domain.min(axis=0), source.history.domain.max(axis=0)
    middle = 0.5 * (low + high)
    room = np.maximum(0.5 * (high - low) - largest, 0.0)
    if side > 1 and not (room > 0.0).all():
        raise BadInput(
            Fault(
                str(source.path),
                "samples.radii",
                f"{largest:g} m",
                "a largest radius that leaves room for a grid of centres",
            )
        )
    steps = np.linspace(-1.0, 1.0, side) if side > 1 else np.zeros(1)
    x, y = np.meshgrid(middle[0] + room[0] * steps, middle[1] + room[1] * steps, indexing="ij")
    return np.stack([x.ravel(), y.ravel()], axis=1)


def _arrays(runs: list[Run], centres: np.ndarray, samples: list[Sample], scene: RevStudyScene) -> dict[str, Any]:
    """Samples as (radius, centre, run, ...)."""
    shape = (len(runs), centres.shape[1], len(scene.samples.radii))
    longest = max(stress.shape[0] for stress, *_ in samples)

    def gathered(values: list[Any]) -> np.ndarray:
        whole = np.asarray(values)
        return np.moveaxis(whole.reshape(*shape, *whole.shape[1:]), (0, 1, 2), (2, 1, 0))

    def padded(part: np.ndarray) -> np.ndarray:
        return np.concatenate([part, np.full((longest - part.shape[0], 4), np.nan)])

    measures = gathered([curve_measures(s, e, scene.curves.secant_level) for s, e, *_ in samples])
    return {
        "radius": np.asarray(scene.samples.radii),
        "centre_position": centres,
        "run_name": np.array([source.path.stem for source in runs]),
        "confining_stress": min((source.confining_stress for source in runs), key=abs),
        "area": gathered([area for _, _, area, *_ in samples]),
        "block_count": gathered([blocks for *_, blocks, _ in samples]),
        "stress": gathered([padded(s) for s, *_ in samples]),
        "strain": gathered([padded(e) for _, e, *_ in samples]),
        **{name: measures[..., k] for k, name in enumerate(MEASURES)},
    }


def _counts_once(samples: list[Sample], shape: tuple[int, ...]) -> np.ndarray:
    """(radius, centre, run) false for a sample whose blocks are those of an earlier centre of its run and radius."""
    radii, centres, runs = shape
    whole = np.empty((runs, centres, radii), dtype=object)
    whole.ravel()[:] = [which for *_, which in samples]
    first = np.array([[once_each(list(whole[run, :, r])) for r in range(radii)] for run in range(runs)])
    return np.transpose(first, (1, 2, 0))


def _statistics(
    arrays: dict[str, Any], counts: np.ndarray, criteria: Criteria, scene: RevStudyScene, independent: np.ndarray
) -> dict[str, Convergence]:
    """Convergence of each scalar that has a value at every radius, of the samples that count."""
    by_name = {}
    for k, name in enumerate(MEASURES):
        values = np.where(counts, arrays[name], np.nan)
        if np.isfinite(values).any(axis=(1, 2)).all():
            by_name[name] = convergence(values, criteria, scene.seed + k, independent)
    return by_name
