"""homogenize: average stress and strain of runs of blocks over REVs, as curves over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.averaging.history import Average, average
from graben.mechanics.averaging.rev import Circle, Polygon, Rev
from graben.schemas.artifact import kind_of
from graben.schemas.files import together
from graben.schemas.layouts.curves import LAYOUT
from graben.schemas.outputs import SERIES, Outputs
from graben.schemas.vtk import vtu_series
from graben.stages.blocks.history import Run, read_run
from graben.stages.shared.last_good import keeps_last_good, write_whole
from graben.stages.shared.measures import Measure, number, warnings_of
from graben.stages.shared.record import Progress, Record, silent

Point = tuple[float, float]

_TENSORS = ("stress", "strain", "stress_boundary", "strain_blocks", "strain_joints", "fabric")
_SCALARS = (
    "rotation",
    "current_area",
    "solid_fraction",
    "force_imbalance",
    "moment_imbalance",
    "hill_mandel_residual",
    "hill_mandel_work",
    "joint_length",
    "joint_open_fraction",
    "joint_slipping_fraction",
    "joint_slip_mean",
    "joint_slip_rms",
    "joint_slip_max",
    "coordination",
)


@keeps_last_good("not all regions had been averaged yet")
def run(
    inputs: Sequence[Path],
    output: Path,
    *,
    radii: Sequence[float] = (),
    centre: Sequence[float] | None = None,
    polygon: Sequence[Point] = (),
    deformed: bool = False,
    chosen_at: int = 0,
    steps_picture: Path | None = None,
    vtk: bool = False,
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Average each run over each REV; one path per pair, run by run.

    Parameters
    ----------
    inputs : artifacts of kind "blocks", or all of kind "particles" (see `homogenize_spheres`)
    output : artifact of kind "curves"
    radii : m, of circles; or `polygon`, corners in m
    centre : m, of the circles (x, y), or balls (x, y, z); the middle of each model unless given
    deformed : measure area and strain in the current shape of the outline
    chosen_at : saved state at which blocks are said to meet the REV (0: the first)
    steps_picture : also draw the nine steps of Y 2.3 for the first path
    vtk : also write the outlines as they move, NAME.pvd

    Returns
    -------
    headline numbers per path: area_m2, peak_stress_pa (largest compression, yy), strain_at_peak, and checks

    Raises
    ------
    BadInput : faults of the inputs, a REV outside the model, an output that exists
    """
    _either(radii, polygon)
    pictures = () if steps_picture is None else (steps_picture,)
    Outputs(output, SERIES if vtk else (), others=pictures).claim(inputs, overwrite=overwrite)
    record = Record.begin(None, inputs=_existing(inputs))
    drawn = "steps" if steps_picture is not None else "vtk" if vtk else ""
    found = curves_of(
        inputs, radii=radii, centre=centre, polygon=polygon, deformed=deformed, chosen_at=chosen_at, drawn=drawn,
        progress=progress,
    )  # fmt: skip
    record.cost |= found.cost
    found.headline["warnings"] = record.warn(found.headline["warnings"])
    with together():
        if steps_picture is not None:
            from graben.stages.tools.show.outline_steps import save_steps

            save_steps(steps_picture, found.jobs[0][0].history, found.averages[0].outline, found.jobs[0][1])
        if vtk:
            _write_vtk(output, found.jobs, found.averages)
        write_whole(output, LAYOUT, found.arrays, record, found.attributes)
    return found.headline


@dataclass(frozen=True)
class Curves:
    """Averages, of which nothing is written.

    headline : numbers, as `run` returns them; arrays, attributes, cost : of the artifact
    jobs, averages : run and region of each path, and what was averaged (blocks)
    """

    headline: dict[str, Any]
    arrays: dict[str, Any]
    attributes: dict[str, Any]
    cost: dict[str, Any] = field(default_factory=dict)
    jobs: Sequence[tuple[Run, Rev]] = ()
    averages: Sequence[Average] = ()


def curves_of(
    inputs: Sequence[Path],
    *,
    radii: Sequence[float] = (),
    centre: Sequence[float] | None = None,
    polygon: Sequence[Point] = (),
    deformed: bool = False,
    chosen_at: int = 0,
    drawn: str = "",
    progress: Progress = silent,
) -> Curves:
    """Average each run over each REV; parameters and errors as in `run`.

    drawn : name of the argument that asks for a picture, which spheres have none of
    """
    _either(radii, polygon)
    kinds = [kind_of(path) for path in _existing(inputs)]
    if "particles" in kinds:
        return _spheres(inputs, kinds, radii, centre, deformed, chosen_at, drawn, progress)
    if centre is not None and len(centre) != 2:
        raise BadInput(Fault("", "centre", f"{len(centre)} lengths", "x, y for blocks", True))
    jobs, faults = _jobs(inputs, radii, centre, polygon, chosen_at, progress)
    if faults:
        raise BadInput(faults)
    averages: list[Average] = []
    for k, (source, rev) in enumerate(jobs):
        progress(0.2 + 0.8 * k / len(jobs), f"averaging {source.path.name} over {rev.radius:g} m")
        averages.append(average(source.history, rev, deformed, chosen_at))
    arrays = curve_arrays(jobs, averages)
    cost = {
        "zones": sum(int(a.outline.blocks[j[0].history.zone_block].sum()) for j, a in zip(jobs, averages)),
        "states": int(max(a.stress.shape[0] for a in averages)),
        "strain_closure": max(a.strain_closure for a in averages),
        "force_imbalance": max(float(a.force_imbalance.max()) for a in averages),
        "boundary_stress_difference": max(_boundary_difference(a) for a in averages),
    }
    rigid = any(not j.history.zoned[a.outline.blocks].all() for (j, _), a in zip(jobs, averages))
    attributes = {
        "configuration": "deformed" if deformed else "reference",
        "outline_chosen_at": chosen_at,
        "stress_from": "zones, and the forces on blocks without zones" if rigid else "zones",
    }
    headline = {
        "paths": [_headline(str(arrays["path_name"][k]), j, a) for k, (j, a) in enumerate(zip(jobs, averages))],
        "warnings": warnings_of(_measures(cost)),
    }
    return Curves(headline, arrays, attributes, cost, jobs, averages)


def _either(radii: Sequence[float], polygon: Sequence[Point]) -> None:
    if bool(radii) == bool(polygon):
        raise BadInput(Fault("", "radius", "", "either a `radius` or a `polygon`", True))


def _measures(cost: dict[str, Any]) -> list[Measure]:
    return [
        Measure(
            "boundary_stress_difference", cost["boundary_stress_difference"], 0.1,
            "stress from zones and from the forces on the outline differ by {percent}: the blocks are far from "
            "balance; run them with more steps",
        ),
    ]  # fmt: skip


def _spheres(
    inputs: Sequence[Path],
    kinds: Sequence[str],
    radii: Sequence[float],
    centre: Sequence[float] | None,
    deformed: bool,
    chosen_at: int,
    drawn: str,
    progress: Progress,
) -> Curves:
    from graben.stages.homogenize import spheres as homogenize_spheres

    faults = [
        Fault(str(path), "schema_kind", repr(kind), "'particles', as the others")
        for path, kind in zip(inputs, kinds)
        if kind != "particles"
    ]
    if not radii:
        faults.append(Fault("", "polygon", "", "a `radius`: spheres are averaged over balls", True))
    if deformed or drawn:
        name = "deformed" if deformed else drawn
        expected = "blocks: spheres have no outline, and a ball goes with them"
        faults.append(Fault("", name, "", expected, True))
    if centre is not None and len(centre) != 3:
        faults.append(Fault("", "centre", f"{len(centre)} lengths", "x, y, z for spheres", True))
    if faults:
        raise BadInput(faults)
    return Curves(
        *homogenize_spheres.curves_of(inputs, radii=radii, centre=centre, chosen_at=chosen_at, progress=progress)
    )


def _existing(inputs: Sequence[Path]) -> list[Path]:
    missing = [Fault(str(p), "", "", "an existing artifact file") for p in inputs if not p.is_file()]
    if missing:
        raise BadInput(missing)
    return list(inputs)


def _jobs(
    inputs: Sequence[Path],
    radii: Sequence[float],
    centre: Sequence[float] | None,
    polygon: Sequence[Point],
    chosen_at: int,
    progress: Progress,
) -> tuple[list[tuple[Run, Rev]], list[Fault]]:
    """Runs and regions, and every fault of any of them."""
    jobs: list[tuple[Run, Rev]] = []
    faults: list[Fault] = []
    for k, path in enumerate(inputs):
        progress(0.2 * k / len(inputs), f"reading {path.name}")
        try:
            source = read_run(path)
        except BadInput as error:
            faults += error.faults
            continue
        states = source.history.time.size
        if not 0 <= chosen_at < states:
            expected = f"a saved state, 0 to {states - 1}"
            faults.append(Fault(str(path), "chosen_at", str(chosen_at), expected, True))
            continue
        try:
            revs: list[Rev] = [Circle((centre[0], centre[1]) if centre else source.middle, r) for r in radii]
            if polygon:
                revs.append(Polygon(tuple(polygon)))
        except Refused as error:
            return [], [Fault("", "radius" if radii else "polygon", "", str(error), True)]
        for rev in revs:
            faults += source.refuse_outside(rev, "radius" if radii else "polygon", chosen_at, argument=True)
            jobs.append((source, rev))
    return jobs, faults


def curve_arrays(jobs: Sequence[tuple[Run, Rev]], averages: Sequence[Average]) -> dict[str, Any]:
    """Arrays of the layout "curves", one path per average; short paths end in nan."""
    steps = [a.stress.shape[0] for a in averages]
    longest = max(steps)

    def padded(parts: Sequence[np.ndarray]) -> np.ndarray:
        whole = np.full((len(parts), longest, *parts[0].shape[1:]), np.nan)
        for k, part in enumerate(parts):
            whole[k, : part.shape[0]] = part
        return whole

    many = len({r.radius for _, r in jobs}) > 1
    names = [f"{j.path.stem} r={r.radius:g} m" if many else j.path.stem for j, r in jobs]
    arrays: dict[str, Any] = {
        "path_name": np.array(names),
        "step_count": np.array(steps),
        "time": padded([j.history.time for j, _ in jobs]),
        "confining_stress": np.array([j.confining_stress for j, _ in jobs]),
        "area": np.array([a.area for a in averages]),
        "centre": np.array([[*r.centre, 0.0] for _, r in jobs]),
        "radius": np.array([r.radius for _, r in jobs]),
        "block_count": np.array([a.outline.blocks.sum() for a in averages]),
        "porosity": padded([1.0 - a.solid_fraction for a in averages]),
    }
    for name in (*_TENSORS, *_SCALARS):
        arrays[name] = padded([getattr(a, name) for a in averages])
    lateral = [j.over_applied(a.stress) for (j, _), a in zip(jobs, averages)]
    if any(np.isfinite(values).any() for values in lateral):
        arrays["lateral_over_applied_stress"] = padded(lateral)
    if any(a.balance_residual is not None for a in averages):
        nothing = [np.full(n, np.nan) for n in steps]
        arrays["balance_residual"] = padded(
            [e if a.balance_residual is None else a.balance_residual for a, e in zip(averages, nothing)]
        )
    return arrays


def _write_vtk(output: Path, jobs: Sequence[tuple[Run, Rev]], averages: Sequence[Average]) -> None:
    """Outlines of all paths as closed lines, state by state; each line carries the averages of its path."""
    moving = [a.outline.follow(j.history.current) for (j, _), a in zip(jobs, averages)]
    sizes = [nodes.shape[1] for nodes in moving]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    lines = np.concatenate(
        [
            np.stack([first + np.arange(n), first + np.roll(np.arange(n), -1)], axis=1)
            for first, n in zip(starts, sizes)
        ]
    )
    longest = max(range(len(jobs)), key=lambda k: moving[k].shape[0])
    with vtu_series(output) as series:
        for step, time in enumerate(jobs[longest][0].history.time):
            # A run that ended earlier keeps its last state.
            now = [min(step, nodes.shape[0] - 1) for nodes in moving]
            tensors = {}
            for name in ("stress", "strain"):
                values = np.array([getattr(a, name)[k] for a, k in zip(averages, now)])
                tensors[name] = np.repeat(np.hstack([values, np.zeros((len(now), 2))]), sizes, axis=0)
            series.add(
                float(time),
                np.concatenate([nodes[k] for nodes, k in zip(moving, now)]),
                {"line": lines},
                None,
                {"path": np.repeat(np.arange(len(now)), sizes), **tensors},
            )


def _boundary_difference(a: Average) -> float:
    """Largest difference between zone and boundary-force stress, over the largest stress."""
    # nan: zz of blocks without zones
    largest = float(np.nanmax(np.abs(a.stress)))
    return float(np.nanmax(np.abs(a.stress - a.stress_boundary))) / largest if largest > 0.0 else 0.0


def _headline(name: str, job: tuple[Run, Rev], a: Average) -> dict[str, Any]:
    peak = int(np.argmin(a.stress[:, 1]))
    lateral = job[0].over_applied(a.stress)[slice(1, peak + 1) if peak > 0 else slice(None)]
    return {
        "name": name,
        "confining_stress_pa": job[0].confining_stress,
        "area_m2": a.area,
        "blocks": int(a.outline.blocks.sum()),
        "peak_stress_pa": -float(a.stress[peak, 1]),
        "strain_at_peak": -float(a.strain[peak, 1]),
        "lateral_over_applied_stress": number(lateral.mean()),
        "boundary_stress_difference": _boundary_difference(a),
        "hill_mandel_work": float(a.hill_mandel_work[-1]),
        "strain_closure": a.strain_closure,
    }
