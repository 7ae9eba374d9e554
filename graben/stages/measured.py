"""Measured curves from files: artifacts of homogenize, or CSV with the units in the column names."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.search.curves import Curve
from graben.schemas.artifact import read_artifact
from graben.schemas.reading import read_text

_STRESS_UNITS = {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "gpa": 1e9}
_AXES = ("xx", "yy", "zz", "xy")
# control and seating by kind of test: lateral stress and axial strain prescribed
_TESTS = {"plane-strain": ("seee", "ssee", (1,)), "triaxial": ("sese", "ssse", (1,))}


@dataclass(frozen=True)
class Reading:
    """How to read: the kind of test, the sign in CSV files, whether curves may pull."""

    test: str = "plane-strain"
    sign: str = "tension-positive"
    allow_tension: bool = False


def read_measured(paths: Iterable[str | Path], reading: Reading) -> list[Curve]:
    """Every curve of every file, in order; BadInput names file, curve, row and column of each fault."""
    curves: list[Curve] = []
    faults: list[Fault] = []
    for path in map(Path, paths):
        try:
            curves += _artifact(path, reading) if path.suffix == ".nc" else _csv(path, reading)
        except BadInput as error:
            faults += error.faults
    if faults:
        raise BadInput(faults)
    names = [c.name for c in curves]
    if len(set(names)) < len(names):  # several files with the same confinement
        curves = [
            _renamed(c, f"{c.name} ({i + 1})" if names.count(c.name) > 1 else c.name) for i, c in enumerate(curves)
        ]
    return curves


def _renamed(curve: Curve, name: str) -> Curve:
    from dataclasses import replace

    return replace(curve, name=name)


def _curve(name: str, stress: np.ndarray, strain: np.ndarray, test: str) -> Curve:
    control, seat, compared = _TESTS[test]
    stress, strain = stress.copy(), strain.copy()
    if test == "triaxial":
        missing = np.isnan(stress[:, 2])
        stress[missing, 2] = stress[missing, 0]
    strain[:, 2:] = np.where(np.isnan(strain[:, 2:]) | (test == "plane-strain"), 0.0, strain[:, 2:])
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
    if not np.ptp(strain[:, 1]) > 0.0:
        faults.append(Fault(file, f"curve {name}, strain_yy", "constant", "an axial strain that changes"))
    if np.nanmax(np.abs(strain)) > 2.0:
        faults.append(
            Fault(
                file,
                f"curve {name}, strain",
                f"up to {np.nanmax(np.abs(strain)):g}",
                "strain as a fraction, not percent",
            )
        )
    lateral, axial = float(np.mean(stress[:, 0])), stress[np.abs(stress[:, 1]).argmax(), 1]
    pulls = lateral > 1e-3 * abs(axial) or (axial > 0.0 and strain[-1, 1] > strain[0, 1])
    if pulls and not reading.allow_tension:
        faults.append(
            Fault(
                file, f"curve {name}, sign", f"mean stress_xx {lateral:.4g} Pa, largest stress_yy {axial:.4g} Pa "
                "read as tension positive",
                "compression below zero: the file seems to be compression-positive (csv.sign; csv.allow_tension = "
                "true if it does pull)",
            )
        )  # fmt: skip
    return faults


def _artifact(path: Path, reading: Reading) -> list[Curve]:
    data = read_artifact(path, "curves")
    curves, faults = [], []
    for p, name in enumerate(map(str, data["path_name"].values)):
        n = int(data["step_count"].values[p])
        time = data["time"].values[p, :n]
        stress, strain = data["stress"].values[p, :n], data["strain"].values[p, :n]
        found = _check(path, name, [f"step {i}" for i in range(n)], time, stress, strain, reading)
        faults += found
        if not found:
            curves.append(_curve(_title(name, float(stress[0, 0])), stress, strain, reading.test))
    if faults:
        raise BadInput(faults)
    return curves


def _title(name: str, lateral: float) -> str:
    return name if "Pa" in name else f"{name} at {abs(lateral) / 1e6:.3g} MPa"


def _csv(path: Path, reading: Reading) -> list[Curve]:
    text = read_text(path, "CSV file")
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise BadInput(Fault(str(path), "", "empty", "a header and rows"))
    header = [h.strip() for h in next(csv.reader([lines[0][1]]))]
    columns, faults = _columns(path, header)
    if faults:
        raise BadInput(faults)
    sign = -1.0 if reading.sign == "compression-positive" else 1.0
    table: dict[str, list[tuple[int, dict[str, float]]]] = {}
    for number, line in lines[1:]:
        cells = next(csv.reader([line]))
        if len(cells) != len(header):
            faults.append(Fault(str(path), f"row {number}", f"{len(cells)} cells", f"{len(header)} cells"))
            continue
        values: dict[str, float] = {}
        for name, (index, factor) in columns.items():
            if name == "name":
                continue
            cell = cells[index].strip()
            try:
                values[name] = float(cell) * factor
            except ValueError:
                if cell:
                    faults.append(Fault(str(path), f"row {number}, {header[index]}", repr(cell), "a number"))
                values[name] = math.nan
        if "name" in columns:
            group = cells[columns["name"][0]].strip()
        elif "confining_stress" in columns:
            group = f"{abs(values['confining_stress']) / 1e6:g} MPa"
        else:
            group = path.stem
        table.setdefault(group, []).append((number, values))
    if not table and not faults:
        faults.append(Fault(str(path), "", "no rows", "at least two rows"))
    curves = []
    for name, points in table.items():
        stress = np.full((len(points), 4), np.nan)
        strain = np.full((len(points), 4), np.nan)
        time = np.arange(len(points), dtype=float)
        for i, (_number, values) in enumerate(points):
            for k, axis in enumerate(_AXES):
                stress[i, k] = sign * values.get(f"stress_{axis}", math.nan)
                strain[i, k] = sign * values.get(f"strain_{axis}", math.nan)
            time[i] = values.get("time", float(i))
        found = _check(path, name, [f"row {n}" for n, _ in points], time, stress, strain, reading)
        faults += found
        if not found:
            curves.append(_curve(name, stress, strain, reading.test))
    if faults:
        raise BadInput(faults)
    return curves


def _columns(path: Path, header: list[str]) -> tuple[dict[str, tuple[int, float]], list[Fault]]:
    """Column -> (index, factor to SI), from names such as stress_yy_mpa, strain_xx, time_s,
    confining_stress_pa."""
    columns: dict[str, tuple[int, float]] = {}
    faults = []
    for index, title in enumerate(header):
        name, _, unit = title.lower().rpartition("_")
        low = title.lower()
        if low in ("name", "curve"):
            columns["name"] = (index, 1.0)
        elif low.startswith("strain_") and low[7:] in _AXES:
            columns[low] = (index, 1.0)
        elif name.startswith("strain_") and name[7:] in _AXES and unit in ("percent", "1"):
            columns[name] = (index, 0.01 if unit == "percent" else 1.0)
        elif (name.startswith("stress_") and name[7:] in _AXES) or name == "confining_stress":
            if unit in _STRESS_UNITS:
                columns[name] = (index, _STRESS_UNITS[unit])
            else:
                faults.append(
                    Fault(str(path), title, "", f"a unit at the end of its name: {', '.join(_STRESS_UNITS)}")
                )
        elif low in ("time_s", "step"):
            columns["time"] = (index, 1.0)
        elif low.startswith(("stress", "confining_stress", "time")):
            faults.append(
                Fault(
                    str(path),
                    title,
                    "",
                    f"a unit at the end of its name, such as {low}_{'s' if low == 'time' else 'pa'}",
                )
            )
        else:
            faults.append(
                Fault(str(path), title, "", "no such column (confining_stress_pa, name, time_s, stress_xx_pa, "
                      "stress_yy_pa, strain_xx, strain_yy, ...)")
            )  # fmt: skip
    for needed in ("stress_xx", "stress_yy", "strain_xx", "strain_yy"):
        if needed not in columns and not any(needed in f.key.lower() for f in faults):
            shown = needed + ("_pa" if needed.startswith("stress") else "")
            faults.append(Fault(str(path), shown, "(absent)", "this column"))
    return columns, faults
