"""wear-estimate: contact counts, grooves and machine data -> wear rate of each mixture."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Incomplete, Refused
from graben.mechanics.wear.counts import contacts_per_area, doubts
from graben.mechanics.wear.rate import GrooveTable, balanced_forces, carried_load, refuse_buried, wear_rates
from graben.schemas.artifact import read_arrays
from graben.schemas.layouts.wear import LAYOUT
from graben.schemas.outputs import Outputs, files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.schemas.scenes.wear import Mixture, WearScene
from graben.stages.shared.last_good import keeps_last_good, write_whole
from graben.stages.shared.record import Progress, Record, silent

# carried over applied load may differ by this much before a warning
LOAD_TOLERANCE = 0.1


@dataclass(frozen=True)
class _Known:
    """A groove of one class: force N, area m2, degree of wear."""

    force: float
    area: float
    degree: float


@dataclass(frozen=True)
class _BedCounts:
    """What a bed says about each class of the scene: contacts per area 1/m2, force per contact relative, shares."""

    contacts: np.ndarray
    force: np.ndarray
    share: np.ndarray


@keeps_last_good("no mixture had been rated yet")
def run(
    given: Given,
    output: Path,
    *,
    bed: Path | None = None,
    scratch: Mapping[str, Iterable[Path]] | None = None,
    overrides: Overrides = (),
    overwrite: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Estimate the wear rate of each mixture of a scene and write the artifact.

    bed : particles artifact whose floor contacts replace the scene's counts
    scratch : class name -> scratch artifacts whose grooves are added to the scene's

    Returns
    -------
    ``mixtures`` (name, wear_rate_m3_per_s and its parts) and ``warnings``

    Raises
    ------
    BadInput : every fault of scene and artifacts at once, or the output exists
    """
    scene: WearScene = load_scene(given, "wear", overrides)
    scratch = {name: list(paths) for name, paths in (scratch or {}).items()}
    grooves = [path for paths in scratch.values() for path in paths]
    Outputs(output).claim([*files_of(scene), bed, *grooves], overwrite=overwrite)
    prepared = prepare(scene, bed, scratch)
    record = Record.begin(scene, prepared.inputs)
    rows = prepared.rows
    record.warn(prepared.warnings)

    arrays = {
        "mixture_name": np.array([m.name for m in scene.mixtures]),
        "class_name": np.array([g.name for g in scene.grains]),
        "class_diameter": [g.diameter for g in scene.grains],
        **{key: np.array([row[key] for row in rows]) for key in rows[0]},
        "applied_load": scene.machine.applied_load,
        "sliding_speed": _speed(scene),
        "contact_area": scene.machine.contact_area,
    }
    record.cost["mixtures"] = len(rows)
    write_whole(output, LAYOUT, arrays, record, {"load_mode": scene.load.mode})
    names = [g.name for g in scene.grains]
    return {
        "mixtures": [
            {
                "name": mixture.name,
                "wear_rate_m3_per_s": float(row["wear_rate"]),
                "carried_load_n": float(row["carried_load"]),
                "class_wear_rate_m3_per_s": dict(zip(names, row["class_wear_rate"].tolist())),
            }
            for mixture, row in zip(scene.mixtures, rows)
        ],
        "warnings": record.warnings,
    }


@dataclass(frozen=True)
class Prepared:
    """A rated scene, of which nothing is written: files read, a row for each mixture, warnings."""

    inputs: list[Path]
    rows: list[dict[str, Any]]
    warnings: list[str]


def prepare(
    scene: WearScene, bed: Path | None = None, scratch: Mapping[str, Iterable[Path]] | None = None
) -> Prepared:
    """Rate every mixture; the work is no more than the checks. Parameters as in `run`.

    Raises
    ------
    BadInput : every fault of scene and artifacts at once
    Incomplete : no other fault than that the call must name a bed or scratches
    """
    file = str(scene.source.path)
    bed_file = bed or (scene.counts.bed if scene.counts.source == "bed" else None)
    files = {g.name: list(g.scratch) for g in scene.grains}
    faults: list[Fault] = []
    for name, paths in (scratch or {}).items():
        if name not in files:
            faults.append(Fault(file, "scratch", repr(name), f"a class of the scene: {', '.join(files)}", True))
        else:
            files[name] += list(paths)
    counted = _read_bed(scene, bed_file, faults) if bed_file is not None else None
    known = {g.name: _grooves(scene, g.name, files[g.name], faults) for g in scene.grains}
    absent: list[Fault] = []
    if bed_file is None and scene.counts.source == "bed":
        absent.append(Fault(file, "counts.bed", "(absent)", "a particles artifact, here or as `bed`"))
    if bed_file is None and scene.load.split == "bed":
        absent.append(Fault(file, "load.split", "'bed'", "a bed to take it from (`bed`)"))
    _check_grooves(scene, known, faults, absent)
    if faults:
        raise BadInput(faults + absent)
    if absent:
        raise Incomplete(absent)
    warnings: list[str] = []
    rows = [_rate(scene, mixture, counted, known, warnings) for mixture in scene.mixtures]
    inputs = [p for paths in files.values() for p in paths] + ([bed_file] if bed_file is not None else [])
    return Prepared(inputs, rows, warnings)


def _speed(scene: WearScene) -> float:
    return 0.5 * scene.machine.rotation * scene.machine.wheel_diameter


def _shares(scene: WearScene, mixture: Mixture) -> np.ndarray:
    return np.array([mixture.shares.get(g.name, 0.0) for g in scene.grains])


def _read_bed(scene: WearScene, path: Path, faults: list[Fault]) -> _BedCounts | None:
    """Counts of a bed in the order of the scene's classes; adds a fault for each thing that does not fit."""
    try:
        bed = read_arrays(path, "particles")
    except BadInput as error:
        faults.extend(error.faults)
        return None
    before = len(faults)
    names = [str(n) for n in bed["class_name"].values]
    contacts, force, share = (np.zeros(len(scene.grains)) for _ in range(3))
    for i, grain in enumerate(scene.grains):
        if grain.name not in names:
            if any(m.shares.get(grain.name, 0.0) > 0.0 for m in scene.mixtures):
                faults.append(Fault(str(path), "class_name", ", ".join(names), f"a class {grain.name!r}"))
            continue
        k = names.index(grain.name)
        diameter = float(bed["class_diameter"].values[k])
        if abs(diameter - grain.diameter) > 0.01 * grain.diameter:
            faults.append(
                Fault(str(path), f"class_diameter of {grain.name}", f"{diameter:.6g} m", f"{grain.diameter:.6g} m")
            )
        contacts[i] = bed["floor_contacts_per_area"].values[k]
        force[i] = bed["floor_contact_force"].values[k]
        share[i] = bed["class_share"].values[k]
    if not contacts.sum() > 0.0 and len(faults) == before:
        faults.append(Fault(str(path), "floor_contacts_per_area", "0", "a bed that touches its floor"))
    for m in scene.mixtures:
        if len(faults) == before and np.max(np.abs(_shares(scene, m) - share)) > 0.02:
            expected = "the shares of the bed, " + ", ".join(f"{g.name} {s:g}" for g, s in zip(scene.grains, share))
            faults.append(Fault(str(scene.source.path), f"mixtures {m.name!r}", str(m.shares), expected))
    return _BedCounts(contacts, force, share)


def _grooves(scene: WearScene, name: str, files: list[Path], faults: list[Fault]) -> list[_Known]:
    grain = next(g for g in scene.grains if g.name == name)
    known = [_Known(g.force, g.area, g.degree_of_wear) for g in grain.grooves]
    for path in files:
        try:
            scratch = read_arrays(path, "scratch")
        except BadInput as error:
            faults.extend(error.faults)
            continue
        radius = float(scratch["grain_radius"])
        if abs(2.0 * radius - grain.diameter) > 0.01 * grain.diameter:
            expected = f"{grain.diameter / 2:.6g} m, half the diameter of class {name!r}"
            faults.append(Fault(str(path), "grain_radius", f"{radius:.6g} m", expected))
        groove = _Known(
            float(scratch["normal_force"]), float(scratch["groove_area"]), float(scratch["degree_of_wear"])
        )
        if not (groove.force > 0.0 and groove.area > 0.0):
            faults.append(
                Fault(
                    str(path),
                    "groove_area, normal_force",
                    f"{groove.area:g} m2, {groove.force:g} N",
                    "positive values",
                )
            )
        known.append(groove)
    return known


def _check_grooves(
    scene: WearScene, known: dict[str, list[_Known]], faults: list[Fault], absent: list[Fault]
) -> None:
    used = [g.name for g in scene.grains if any(m.shares.get(g.name, 0.0) > 0.0 for m in scene.mixtures)]
    file = str(scene.source.path)
    for name in used:
        found = len(known[name])
        if scene.load.mode == "given" and found != 1:
            (faults if found else absent).append(
                Fault(
                    file,
                    f"grains {name!r} grooves",
                    str(found),
                    "exactly one (load.mode is given), here or as `scratch`",
                )
            )
    if scene.load.mode == "balanced" and not any(known[name] for name in used):
        absent.append(Fault(file, "grains grooves", "none", "one groove at least, here or as `scratch`"))


def _table(scene: WearScene, name: str, known: dict[str, list[_Known]]) -> GrooveTable:
    """Grooves of the class; where it has none, those of all classes, by similarity."""
    radius = {g.name: 0.5 * g.diameter for g in scene.grains}
    own = [(k, radius[name]) for k in known[name]]
    rows = own or [(k, radius[other]) for other, several in known.items() for k in several]
    return GrooveTable(
        force=np.array([k.force for k, _ in rows]),
        radius=np.array([r for _, r in rows]),
        area=np.array([k.area for k, _ in rows]),
        degree=np.array([k.degree for k, _ in rows]),
    )


def _rate(
    scene: WearScene,
    mixture: Mixture,
    counted: _BedCounts | None,
    known: dict[str, list[_Known]],
    warnings: list[str],
) -> dict[str, Any]:
    """The row of one mixture; arrays run over the classes of the scene."""
    share = _shares(scene, mixture)
    diameter = np.array([g.diameter for g in scene.grains])
    machine, file = scene.machine, str(scene.source.path)
    try:
        if counted is not None:
            contacts = counted.contacts
        else:
            contacts = contacts_per_area(scene.counts.source, diameter, share)
            warnings += [f"{mixture.name}: {d}" for d in doubts(scene.counts.source, diameter, share)]
        force, area, degree = np.zeros(len(share)), np.zeros(len(share)), np.zeros(len(share))
        present = np.flatnonzero(contacts > 0.0)
        if scene.load.mode == "given":
            for i in present:
                only = known[scene.grains[i].name][0]
                force[i], area[i], degree[i] = only.force, only.area, only.degree
        else:
            relative = {
                "equal": np.ones(len(share)),
                "area": diameter**2,
                "bed": counted.force if counted is not None else np.ones(len(share)),
            }[scene.load.split]
            force = np.where(
                contacts > 0.0, balanced_forces(contacts, machine.contact_area, machine.applied_load, relative), 0.0
            )
            for i in present:
                table = _table(scene, scene.grains[i].name, known)
                area[i], degree[i] = table.at(float(force[i]), 0.5 * diameter[i])
                warnings += [
                    f"{mixture.name}, {scene.grains[i].name}: {d}"
                    for d in table.doubts(float(force[i]), 0.5 * diameter[i])
                ]
        for i in present:
            refuse_buried(scene.grains[i].name, area[i], 0.5 * diameter[i])
    except Refused as error:
        raise BadInput(
            Fault(file, f"mixtures {mixture.name!r}", "", f"a mixture that can be rated ({error})")
        ) from error
    carried = carried_load(contacts, machine.contact_area, force)
    ratio = carried / machine.applied_load
    if abs(ratio - 1.0) > LOAD_TOLERANCE:
        warnings.append(
            f"{mixture.name}: contacts times force per contact is {carried:.4g} N, {ratio:.3g} times the applied "
            f'load of {machine.applied_load:.4g} N (load.mode = "balanced" takes the force from the load)'
        )
    rate = wear_rates(contacts, machine.contact_area, degree, area, _speed(scene))
    if np.any(rate < 0.0):
        warnings.append(f"{mixture.name}: a degree of wear below 0 (shoulders larger than the groove) counts as gain")
    return {
        "share": share,
        "contacts_per_area": contacts,
        "contact_force": force,
        "groove_area": area,
        "degree_of_wear": degree,
        "class_wear_rate": rate,
        "wear_rate": float(rate.sum()),
        "carried_load": carried,
    }
