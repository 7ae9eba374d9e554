"""Measured curves from files: artifacts of homogenize, or tables of text with their units (CSV of laboratories)."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.fitting.curves import Curve, since_first
from graben.schemas.artifact import read_arrays
from graben.schemas.text_table import TextTable, read_text_table
from graben.stages.calibrate.measured_columns import AXES, EXPECTED, NEEDED, Columns, read_columns, understood
from graben.stages.calibrate.measured_tests import Rows, tell_apart

_log = logging.getLogger(__name__)

# control and seating by kind of test: lateral stress and axial strain prescribed
_TESTS = {"plane-strain": ("seee", "ssee", (1,)), "triaxial": ("sese", "ssse", (1,))}
_ONE_LATERAL = 0.1  # of the largest stress: further apart, two lateral stresses are not one
_HOLES = 0.1  # of a test's rows may lack a number
_UNIT = 0.5  # a strain without a unit that reaches this may be in percent
_WORTH_A_WORD = 0.02  # a fraction that large, if its unit is not said
_LOADED = 0.1  # of a curve's largest deviator, where it begins: worth a word


@dataclass(frozen=True)
class Reading:
    """How to read: the kind of test, the sign in CSV files, whether curves may pull, or narrow under compression."""

    test: str = "plane-strain"
    sign: str = "tension-positive"
    allow_tension: bool = False
    allow_narrowing: bool = False


@dataclass(frozen=True)
class Measured:
    """Curves of one file, and how it was read: plain values for JSON."""

    file: str
    curves: list[Curve]
    read: dict[str, Any]


def read_measured(paths: Iterable[str | Path], reading: Reading) -> list[Curve]:
    """Every curve of every file, in order; BadInput names file, curve, row and column of each fault."""
    return [curve for part in read_files(paths, reading) for curve in part.curves]


def read_files(paths: Iterable[str | Path], reading: Reading) -> list[Measured]:
    """As `read_measured`, file by file, with what was found out about each."""
    found: list[Measured] = []
    faults: list[Fault] = []
    for path in map(Path, paths):
        try:
            found.append(_artifact(path, reading) if path.suffix == ".nc" else _table(path, reading))
        except BadInput as error:
            faults += error.faults
    if faults:
        raise BadInput(faults)
    found = _told_apart(found)
    for part in found:
        for about in part.read["tests"]:
            _warn_loaded(part.file, about)
    return found


def curve_of(name: str, stress: np.ndarray, strain: np.ndarray, reading: Reading) -> Curve:
    """A curve from arrays (steps, 4) of stress in Pa and strain, tension positive; BadInput names each fault."""
    steps = len(stress)
    faults = _check(
        Path("curves"), name, [f"step {i}" for i in range(steps)], np.arange(steps), stress, strain, reading
    )
    if faults:
        raise BadInput(faults)
    return _curve(name, stress, strain, reading.test)


def _told_apart(found: list[Measured]) -> list[Measured]:
    """Curves of one name numbered, within a file and over files."""
    names = [c.name for part in found for c in part.curves]
    taken = set(names)
    out = []
    for part in found:
        curves = []
        for curve, about in zip(part.curves, part.read["tests"], strict=True):
            name, number = curve.name, 0
            while names.count(curve.name) > 1 and name in taken:
                number += 1
                name = f"{curve.name} ({number})"
            taken.add(name)
            about["name"] = name
            curves.append(replace(curve, name=name))
        out.append(replace(part, curves=curves))
    return out


def _curve(name: str, stress: np.ndarray, strain: np.ndarray, test: str) -> Curve:
    control, seat, compared = _TESTS[test]
    stress, strain = stress.copy(), strain.copy()
    if test == "triaxial":  # one lateral stress: scatter between its two readings would choose where an edge flows to
        other = np.where(np.isnan(stress[:, 2]), stress[:, 0], stress[:, 2])
        stress[:, 0] = stress[:, 2] = 0.5 * (stress[:, 0] + other)
    strain[:, 2] = np.where(np.isnan(strain[:, 2]) | (test == "plane-strain"), 0.0, strain[:, 2])
    strain[:, 3] = 0.0  # xx and yy are principal axes
    return Curve(name, stress, strain, control=control, seat=seat, fit_stress=compared, fit_strain=(0,))


def _check(path: Path, name: str, rows: list[str], time: np.ndarray, stress: np.ndarray, strain: np.ndarray,
           reading: Reading) -> list[Fault]:  # fmt: skip
    """Faults of one curve; rows say where each point stands in the file. Stress and strain are tension
    positive."""
    file = str(path)
    if len(time) < 2:
        return [Fault(file, f"curve {name}", f"{len(time)} point", "at least two points")]
    faults = []
    for label, data in (
        ("time", time), ("stress_xx", stress[:, 0]), ("stress_yy", stress[:, 1]), ("strain_xx", strain[:, 0]),
        ("strain_yy", strain[:, 1]),
    ):  # fmt: skip
        for i in np.flatnonzero(~np.isfinite(data))[:5]:
            faults.append(Fault(file, f"curve {name}, {rows[i]}, {label}", str(data[i]), "a finite number"))
    if faults:
        return faults
    for i in np.flatnonzero(np.diff(time) <= 0.0)[:5]:
        where = f"curve {name}, {rows[i + 1]}, time"
        faults.append(Fault(file, where, f"{time[i + 1]:g} after {time[i]:g}", "a time that increases"))
    strain = since_first(strain)
    if not np.ptp(strain[:, 1]) > 0.0:
        faults.append(Fault(file, f"curve {name}, strain_yy", "constant", "an axial strain that changes"))
    if np.nanmax(np.abs(strain)) > 2.0:
        found = f"up to {np.nanmax(np.abs(strain)):g}"
        faults.append(Fault(file, f"curve {name}, strain", found, "strain as a fraction, not percent"))
    apart = np.abs(stress[:, 2] - stress[:, 0])
    if reading.test == "triaxial" and np.nanmax(apart, initial=0.0) > _ONE_LATERAL * np.nanmax(np.abs(stress[:, :3])):
        i = int(np.nanargmax(apart))
        where, found = f"curve {name}, {rows[i]}, stress_zz", f"{stress[i, 2]:.4g} Pa beside {stress[i, 0]:.4g} Pa"
        faults.append(Fault(file, where, found, "the lateral stress, as stress_xx: the test is triaxial"))
    lateral, axial = float(np.mean(stress[:, 0])), stress[np.abs(stress[:, 1]).argmax(), 1]
    pulls = lateral > 1e-3 * abs(axial) or (axial > 0.0 and strain[-1, 1] > 0.0)
    if pulls and not reading.allow_tension:
        found = f"mean stress_xx {lateral:.4g} Pa, largest stress_yy {axial:.4g} Pa read as tension positive"
        expected = (
            "compression below zero: the curve seems to be compression-positive (csv.sign; csv.allow_tension = true "
            "if it does pull)"
        )
        faults.append(Fault(file, f"curve {name}, sign", found, expected))
    return faults


def _sign_faults(file: str, name: str, stress: np.ndarray, strain: np.ndarray, reading: Reading) -> list[Fault]:
    """Signs that contradict one another in a table: of axial strain against axial stress as loading begins, of
    lateral strain over the whole curve."""
    change, moved = stress - stress[:1], since_first(strain)
    push = np.abs(change[:, 1])
    if not push.max() > 0.0 or not np.abs(moved[:, 1]).max() > 0.0:
        return []
    at = int(np.argmax(push >= 0.3 * push.max()))
    said = f'csv.sign = "{reading.sign}" holds for all columns: turn the sign of one in the file'
    if change[at, 1] * moved[at, 1] < 0.0:
        found = f"{moved[at, 1]:.3g} while stress_yy changes by {change[at, 1]:.3g} Pa"
        return [Fault(file, f"curve {name}, strain_yy, sign", found, f"a strain that goes with its stress; {said}")]
    short, wide = -moved[:, 1].min(), moved[:, 0]
    squeezed = -change[:, 0].min() > 0.1 * push.max()
    narrows = wide.min() < -0.02 * short and wide.max() <= 0.01 * -wide.min()
    if reading.allow_narrowing or moved[-1, 1] >= 0.0 or squeezed or not narrows:
        return []
    found = f"contraction up to {-wide.min():.3g} throughout, while the specimen shortens by {short:.3g}"
    expected = f"extension; {said}, or csv.allow_narrowing = true if it does narrow"
    return [Fault(file, f"curve {name}, strain_xx, sign", found, expected)]


def _about(name: str, told: str, stress: np.ndarray, strain: np.ndarray) -> dict[str, Any]:
    """What a user should see of a test: plain values."""
    moved = since_first(strain[:, :2])
    deviator = np.abs(stress[:, 1] - stress[:, 0])
    return {
        "name": name,
        "told_by": told,
        "points": len(stress),
        "lateral_stress_pa": float(stress[:, 0].mean()),
        "lateral_stress_deviation_pa": float(stress[:, 0].std()),
        "first_deviator_pa": float(stress[0, 1] - stress[0, 0]),
        "begins_loaded": bool(deviator[0] > _LOADED * deviator.max()),
        "largest_axial_strain": float(np.abs(moved[:, 1]).max()),
        "largest_lateral_strain": float(np.abs(moved[:, 0]).max()),
    }


def _warn_loaded(path: str, about: dict[str, Any]) -> None:
    if about["begins_loaded"]:
        _log.warning(
            "%s: curve %s begins under a deviator of %.3g MPa: strains count from there",
            path, about["name"], about["first_deviator_pa"] / 1e6,
        )  # fmt: skip


def _artifact(path: Path, reading: Reading) -> Measured:
    data = read_arrays(path, "curves")
    curves, faults, tests = [], [], []
    for p, name in enumerate(map(str, data["path_name"].values)):
        n = int(data["step_count"].values[p])
        time = data["time"].values[p, :n]
        stress, strain = data["stress"].values[p, :n], data["strain"].values[p, :n]
        found = _check(path, name, [f"step {i}" for i in range(n)], time, stress, strain, reading)
        faults += found
        if not found:
            curves.append(_curve(_title(name, float(stress[0, 0])), stress, strain, reading.test))
            tests.append(_about(curves[-1].name, "path of the artifact", stress, strain))
    if faults:
        raise BadInput(faults)
    return Measured(str(path), curves, {"format": "artifact", "tests": tests})


def _title(name: str, lateral: float) -> str:
    return name if "Pa" in name else f"{name} at {abs(lateral) / 1e6:.3g} MPa"


def _table(path: Path, reading: Reading) -> Measured:
    file = str(path)
    table = read_text_table(path, understood, EXPECTED)
    columns = read_columns(table, file)
    if not len(columns.rows):
        raise BadInput(Fault(file, "", "no rows", "at least two rows"))
    v, sign = columns.values, -1.0 if reading.sign == "compression-positive" else 1.0
    if "confining_stress" in v:  # of either sign in the file
        held = v["confining_stress"]
        v = v | {"confining_stress": held if np.nansum(held) >= 0.0 else -held}
    if "stress_xx" not in v:
        v = v | {"stress_xx": -sign * v["confining_stress"]}
    counted = [m for m in (*NEEDED, "time", *(() if columns.names else ("confining_stress",))) if m in v]
    complete = np.logical_and.reduce([np.isfinite(v[m]) for m in counted])
    columns = replace(columns, values=v)
    parts, faults = tell_apart(columns, complete, file, path.stem)
    curves, tests, repeated = [], [], 0
    for part in parts:
        if not faults:
            faults += _holes(file, columns, part, complete, counted)
        rows = part.index[complete[part.index]]
        if "time" in v:
            same = np.logical_and.reduce([v[m][rows[1:]] == v[m][rows[:-1]] for m in counted])
            repeated += int(same.sum())
            rows = np.delete(rows, np.flatnonzero(same) + 1)
        nothing = np.full(len(rows), np.nan)
        stress, strain = (
            sign
            * np.stack([v[f"{kind}_{axis}"][rows] if f"{kind}_{axis}" in v else nothing for axis in AXES], axis=1)
            for kind in ("stress", "strain")
        )
        time = v["time"][rows] if "time" in v else np.arange(len(rows), dtype=float)
        found = _check(path, part.name, [f"row {columns.rows[i]}" for i in rows], time, stress, strain, reading)
        if not found:
            found = _percent(file, columns, part.name, strain) + _sign_faults(
                file, part.name, stress, strain, reading
            )
        faults += found
        if not found:
            curves.append(_curve(part.name, stress, strain, reading.test))
            about = _about(part.name, part.told, stress, strain)
            if "confining_stress" in v:
                about["confining_stress_pa"] = float(v["confining_stress"][rows].mean())
                about["confining_stress_deviation_pa"] = float(v["confining_stress"][rows].std())
            tests.append(about)
    if faults:
        raise BadInput(faults)
    bare = {columns.titles[m]: _largest(curves, AXES.index(m[7:])) for m in columns.without_unit}
    read = _dialect(table, columns, int((~complete).sum()), repeated)
    read |= {"strains_without_unit": bare, "sign": reading.sign, "tests": tests}
    _tell(path, read)
    return Measured(file, curves, read)


def _holes(file: str, columns: Columns, part: Rows, complete: np.ndarray, counted: list[str]) -> list[Fault]:
    """Rows that lack a number are left out, unless they are too many."""
    lost = part.index[~complete[part.index]]
    if len(lost) <= _HOLES * len(part.index):
        return []
    expected = f"a finite number ({len(lost)} of {len(part.index)} rows lack one; one in ten may)"
    return [
        Fault(file, f"curve {part.name}, row {columns.rows[i]}, {columns.titles.get(m, m)}", "missing", expected)
        for i in lost[:5]
        for m in counted
        if not np.isfinite(columns.values[m][i])
    ]


def _percent(file: str, columns: Columns, name: str, strain: np.ndarray) -> list[Fault]:
    faults = []
    for meaning in columns.without_unit:
        top = float(np.nanmax(np.abs(since_first(strain[:, AXES.index(meaning[7:])])), initial=0.0))
        if top > _UNIT:
            expected = f"a unit in its title: {meaning}_percent, or {meaning}_1 if it is a fraction"
            faults.append(
                Fault(file, f"curve {name}, {columns.titles[meaning]}", f"up to {top:g} without a unit", expected)
            )
    return faults


def _largest(curves: list[Curve], axis: int) -> float:
    return max((float(np.nanmax(np.abs(since_first(c.strain[:, axis])), initial=0.0)) for c in curves), default=0.0)


def _dialect(table: TextTable, columns: Columns, dropped: int, repeated: int) -> dict[str, Any]:
    return {
        "format": "table",
        "encoding": table.encoding,
        "line_ends": table.line_ends,
        "separator": table.separator,
        "decimal_mark": columns.decimal_mark,
        "preamble_rows": table.preamble_rows,
        "header_row": table.header_row,
        "units_row": columns.units_row,
        "rows": len(columns.rows),
        "empty_rows": table.empty_rows,
        "comment_rows": table.comment_rows,
        "dropped_rows": dropped,
        "repeated_rows": repeated,
        "columns": columns.titles,
        "ignored_columns": list(columns.ignored),
    }


def _tell(path: Path, read: dict[str, Any]) -> None:
    """The reading in the log; what was left out as a warning."""
    units = f", units in row {read['units_row']}" if read["units_row"] else ""
    tests = ", ".join(f"{t['name']} ({t['points']} points, told by {t['told_by']})" for t in read["tests"])
    _log.info(
        "%s: %s, %s line ends, separator %s, decimal mark %s, header in row %d%s, %d rows, %d empty; tests: %s",
        path, read["encoding"], read["line_ends"], read["separator"], read["decimal_mark"], read["header_row"], units,
        read["rows"], read["empty_rows"], tests,
    )  # fmt: skip
    left = [
        f"{read[key]} {words}"
        for key, words in (("dropped_rows", "rows that lack a number"), ("repeated_rows", "rows said twice"))
        if read[key]
    ]
    for title, top in read["strains_without_unit"].items():
        if top > _WORTH_A_WORD:
            _log.warning(
                "%s: %s has no unit and is read as a fraction, up to %.3g (%.3g %%)", path, title, top, 100.0 * top
            )
    if read["ignored_columns"]:
        left.append("columns " + ", ".join(read["ignored_columns"]))
    if left:
        _log.warning("%s: left out %s", path, "; ".join(left))
