"""tradeoff: run any stage over a grid of its knobs; error of one number against CPU time and memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, NumericsFailed
from graben.schemas.artifact import write_artifact
from graben.schemas.kinds import SCENES
from graben.schemas.layouts.tradeoff import LAYOUT
from graben.schemas.outputs import Outputs, files_of
from graben.schemas.scene import load_scene
from graben.stages.shared.last_good import keeps_last_good
from graben.stages.shared.record import Progress, Record, silent
from graben.stages.shared.run_apart import Run
from graben.stages.shared.workers import compute
from graben.stages.tradeoff.errors import Errors, cheapest_within, errors_of, front_of, limit_of
from graben.stages.tradeoff.knobs import Knob, grid, knobs_of
from graben.stages.tradeoff.runs import Task, kept, make, name_of

# Kind of scene -> its command.
COMMANDS = {
    "blocks": "dem-run", "particles": "dem-run", "rev-study": "rev-study", "calibrate": "calibrate", "fem": "fem-run",
    "scratch": "scratch", "wear": "wear-estimate",
}  # fmt: skip

# Values that do not go from coarse to fine make the last point cheaper than the first, by more than noise.
_CHEAPER = 0.7

RUNS = ".runs"
"""What the folder of runs is called, after the name of the artifact."""


@dataclass(frozen=True)
class Reference:
    """What errors count from.

    value : (seeds,) ; low, high : its interval, nan where it is not known
    origin : "given", "extrapolated" or "finest"; order : of convergence, nan where there is none
    words : for a person
    """

    value: np.ndarray
    low: float
    high: float
    origin: str
    order: float
    words: str


@keeps_last_good("the runs that were made are kept; the same call goes on from them")
def run(
    scene: Path,
    inputs: Sequence[str],
    output: Path,
    *,
    quantity: str,
    knobs: Sequence[str] = (),
    seeds: int = 1,
    reference: float | None = None,
    wanted: float | None = None,
    overrides: Sequence[str] = (),
    processes: int = 1,
    cluster: str | None = None,
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run every point of the grid, unless an earlier call did, and write errors and costs.

    Parameters
    ----------
    scene : any scene; or a run to be averaged by homogenize, whose options then are the knobs
    inputs : further arguments of the stage's command, files and options
    quantity : name of a headline number, in dots where it lies deeper
    knobs : texts KEY=v1,v2,... from coarse to fine; the three fidelities unless given
    seeds : runs of each point, from the scene's seed on
    reference : the true value; otherwise that of the finest point, extrapolated where its sequence allows it
    wanted : error wanted of the cheapest point, relative
    processes, cluster : runs at a time on this machine; or a Dask scheduler whose workers share its files

    Returns
    -------
    headline numbers: quantity, reference, reference_from, points (knobs, cpu_s, peak_memory_bytes, value, error,
    error_low, error_high, on_front), recommended (a point, or None), warnings

    Raises
    ------
    BadInput : faults of the scene at any point, of the knobs, of the name of the quantity
    NumericsFailed : no run gave the quantity, or the reference did not
    """
    grid_knobs = knobs_of(knobs)
    points = grid(grid_knobs)
    if reference is not None and not (np.isfinite(reference) and reference):
        raise BadInput(Fault("", "reference", f"{reference:g}", "a finite number other than 0", True))
    # A worker of a cluster may stand in another folder.
    scene, output = scene.absolute(), output.absolute()
    inputs = [str(Path(i).absolute()) if Path(i).is_file() else i for i in inputs]
    command, seed, named = _checked(scene, points, overrides, seeds)
    files = list(dict.fromkeys([scene, *(Path(i) for i in inputs if Path(i).is_file()), *named]))
    Outputs(output, kept=()).claim(files, overwrite=overwrite)
    record = Record.begin(inputs=files)
    folder = output.parent / (output.name.removesuffix(".nc") + RUNS)
    every = [-1] if seeds == 1 else list(range(seed, seed + seeds))
    tasks = [
        _task(command, scene, inputs, [*overrides, *([f"seed={s}"] if s >= 0 else [])], point, folder, files)
        for point in points
        for s in every
    ]
    runs = _made(tasks, quantity, processes, cluster, progress)
    table = [runs[i : i + len(every)] for i in range(0, len(runs), len(every))]
    value, low, high = (_numbers(table, names) for names in _names(quantity))
    base = _reference(reference, value, low, high, grid_knobs)
    found = errors_of(value, base.value, base.low, base.high, low[:, 0], high[:, 0])
    if base.origin == "finest":
        for ends in (found.error, found.low, found.high):
            ends[-1] = np.nan
    cpu = np.array([[r.cpu_s for r in row] for row in table])
    front = front_of(cpu.mean(axis=1), found.error)
    best = None if wanted is None else cheapest_within(wanted, cpu.mean(axis=1), found)
    warnings = list(_doubts(table, points, cpu, base, wanted, best))
    warnings = record.warn(warnings)
    arrays = {
        "knob_key": np.array([k.key for k in grid_knobs]),
        "knob_value": np.array([[point[k.key] for k in grid_knobs] for point in points]),
        "seed": np.array(every),
        "exit_code": np.array([[r.code for r in row] for row in table]),
        "value": value, "cpu_time": cpu,
        "wall_time": np.array([[r.wall_s for r in row] for row in table]),
        "peak_memory": np.array([[r.peak_memory_bytes for r in row] for row in table]),
        "error": found.error, "error_low": found.low, "error_high": found.high, "on_front": front,
        "reference": base.value.mean(), "reference_low": base.low, "reference_high": base.high, "order": base.order,
        "recommended": -1 if best is None else best, "wanted_error": np.nan if wanted is None else wanted,
    }  # fmt: skip
    about = {"quantity": quantity, "reference_from": base.origin, "command": command}
    write_artifact(output, LAYOUT, arrays, record, about)
    progress(1.0, "done")
    rows = [_row(points[i], table[i], value[i], found, i, bool(front[i])) for i in range(len(points))]
    return {
        "quantity": quantity, "reference": float(base.value.mean()), "reference_from": base.origin,
        "order": base.order, "points": rows, "recommended": None if best is None else rows[best],
        "warnings": warnings,
    }  # fmt: skip


def _checked(
    scene: Path, points: Sequence[dict[str, str]], overrides: Sequence[str], seeds: int
) -> tuple[str, int, list[Path]]:
    """The command of a scene, its seed and the files that it names, read with the values of each point."""
    if scene.suffix == ".nc":
        if seeds > 1 or overrides:
            raise BadInput(Fault(str(scene), "", "", "a scene: an artifact is averaged, and has no seed and no keys"))
        return "homogenize", 0, []
    read = [load_scene(scene, tuple(SCENES), [*overrides, *_settings(point)]) for point in points]
    named = [path.absolute() for model in read for path in files_of(model)[1:]]
    return COMMANDS[read[0].kind], read[0].seed, named


def _settings(point: dict[str, str]) -> list[str]:
    return [f"{key}={value}" for key, value in point.items()]


def _task(
    command: str, scene: Path, inputs: Sequence[str], overrides: Sequence[str], point: dict[str, str],
    folder: Path, files: Sequence[Path],
) -> Task:  # fmt: skip
    first = [*inputs, "--scene", str(scene)] if command == "rev-study" else [str(scene), *inputs]
    if command == "homogenize":
        options = [part for key, value in point.items() for part in (f"--{key}", value)]
    else:
        options = [part for text in [*overrides, *_settings(point)] for part in ("--set", text)]
    arguments = (command, *first, *options)
    return Task(arguments, folder, name_of(arguments, files))


def _made(tasks: Sequence[Task], quantity: str, processes: int, cluster: str | None, progress: Progress) -> list[Run]:
    """All runs. The first one is made twice where it is new: it compiles what the others find compiled."""
    progress(0.0, "a first run, which is not counted")
    if kept(tasks[0]) is None:
        warm = make(Task(tasks[0].arguments, tasks[0].folder, tasks[0].name + ".warm"))
        _refuse(warm, quantity)
    else:
        _refuse(make(tasks[0]), quantity)
    return compute(make, tasks, processes, lambda done: progress(0.98 * done, "runs"), cluster=cluster)


def _refuse(first: Run, quantity: str) -> None:
    """Raise for what the first run tells already: bad input, or no such quantity."""
    if first.code == 2:
        raise BadInput(Fault("", "inputs", "", f"what the stage takes ({first.said.strip()})", True))
    if first.code == 0 and not _has(first.headline, quantity):
        known = ", ".join(k for k, v in first.headline.items() if isinstance(v, int | float | None))
        raise BadInput(Fault("", "quantity", repr(quantity), f"a number of the stage: {known}", True))


def _has(headline: Any, name: str) -> bool:
    try:
        _at(headline, name)
    except (KeyError, IndexError, ValueError, TypeError):
        return False
    return True


def _at(headline: Any, name: str) -> Any:
    """A value by its name, or by keys and places with dots between them."""
    for part in [name] if isinstance(headline, dict) and name in headline else name.split("."):
        headline = headline[int(part)] if isinstance(headline, list) else headline[part]
    return headline


def _names(quantity: str) -> tuple[tuple[str, ...], ...]:
    """Names of the quantity, and of both ends of the interval that some stages give: failure_load_low_pa."""
    stem, _, unit = quantity.rpartition("_")
    return (quantity,), (f"{stem}_low_{unit}", f"{quantity}_low"), (f"{stem}_high_{unit}", f"{quantity}_high")


def _numbers(table: Sequence[Sequence[Run]], names: Sequence[str]) -> np.ndarray:
    """(points, seeds), nan where a run gave no such number."""

    def number(run: Run) -> float:
        known = [name for name in names if run.code == 0 and _has(run.headline, name)]
        value = _at(run.headline, known[0]) if known else None
        return float(value) if isinstance(value, int | float) else np.nan

    return np.array([[number(run) for run in row] for row in table])


def _reference(
    given: float | None, value: np.ndarray, low: np.ndarray, high: np.ndarray, knobs: Sequence[Knob]
) -> Reference:
    if given is not None:
        found = Reference(np.full(value.shape[1], given), np.nan, np.nan, "given", np.nan, "")
    else:
        if not np.isfinite(value[-1]).all():
            raise NumericsFailed("the finest point gives no value of the quantity", advice="give a reference")
        sizes = knobs[0].sizes if len(knobs) == 1 else None
        limit = limit_of(value, None if sizes is None else np.array(sizes))
        finest = float(value[-1].mean())
        if limit.value is None:
            words = f"errors count from the finest point, whose own error is not known: {limit.reason}"
            found = Reference(value[-1], float(low[-1].mean()), float(high[-1].mean()), "finest", np.nan, words)
        else:
            centre = float(limit.value.mean())
            off = abs(centre - finest)
            found = Reference(limit.value, centre - off, centre + off, "extrapolated", limit.order or np.nan, "")
    if not found.value.all():
        raise BadInput(Fault("", "reference", "0", "a reference other than 0: errors are relative", True))
    return found


def _doubts(
    table: Sequence[Sequence[Run]], points: Sequence[dict[str, str]], cpu: np.ndarray, base: Reference,
    wanted: float | None, best: int | None,
) -> list[str]:  # fmt: skip
    """What a person should know before trusting the study."""
    said = [base.words] if base.words else []
    for point, row in zip(points, table):
        failed = [run for run in row if run.code != 0]
        if failed:
            last = (failed[0].said.splitlines() or ["it said nothing"])[-1]
            said.append(f"{_words(point)}: {len(failed)} of {len(row)} runs gave no result: {last}")
    for point, row in zip(points, table):
        told = dict.fromkeys(text for run in row for text in run.headline.get("warnings", []))
        said += [f"{_words(point)} warns: {text}" for text in told]
    if len(points) > 1 and cpu[-1].mean() < _CHEAPER * cpu[0].mean():
        said.append("the last point costs less than the first: values go from coarse to fine")
    if wanted is not None and best is None:
        said.append(f"no point is known to be within {100 * wanted:.3g} %")
    return said


def _words(point: dict[str, str]) -> str:
    return ", ".join(f"{key} {value}" for key, value in point.items())


def _row(
    point: dict[str, str], runs: Sequence[Run], value: np.ndarray, errors: Errors, i: int, front: bool
) -> dict[str, Any]:
    return {
        "knobs": point,
        "cpu_s": float(np.mean([run.cpu_s for run in runs])),
        "peak_memory_bytes": max(run.peak_memory_bytes for run in runs),
        "value": float(value.mean()),
        "error": float(errors.error[i]), "error_low": float(errors.low[i]), "error_high": float(errors.high[i]),
        "on_front": front,
    }  # fmt: skip
