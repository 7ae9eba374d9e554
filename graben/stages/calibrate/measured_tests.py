"""Rows of a file of measured curves, told apart into tests.

A column of names decides. Without one, a test ends where time begins anew, or where axial strain falls back while the
confining stress goes to another level; a measured confining stress that wanders within `_WITHIN` stays one test. What
could be one test or two is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Fault
from graben.stages.calibrate.measured_columns import Columns

_WITHIN = 0.1  # of its mean, a confining stress is the same; or within _FLOOR of the file's largest axial stress
_FLOOR = 0.005
_FALL = 0.5  # of the strain reached so far, in one step: a new test or an unloading
_NEAR = 0.1  # of it, from the first strain: where a new test begins
_CURE = "a column `name` that says which test a row belongs to"


@dataclass(frozen=True)
class Rows:
    """Rows of one test, as indices; told: what set them apart."""

    name: str
    index: np.ndarray
    told: str


def tell_apart(columns: Columns, complete: np.ndarray, file: str, alone: str) -> tuple[list[Rows], list[Fault]]:
    """Tests of a file, in order; each row without all its numbers goes with the complete one before it.

    columns: its confining stress, if there is one, compression positive; complete (rows,): rows that count;
    alone: the name where nothing names a test."""
    if columns.names is not None:
        return _by_name(columns, complete, file)
    parts, faults = _blocks(columns, np.flatnonzero(complete), file)
    if faults:
        return [], faults
    edges = [0, *(int(rows[0]) for rows, _ in parts[1:]), len(columns.rows)]
    confining = columns.values.get("confining_stress")
    found = []
    for (rows, told), first, last in zip(parts, edges, edges[1:]):
        name = alone
        if confining is not None:
            level = confining[rows]
            name = f"{level[0]:g}" if np.ptp(level) == 0.0 else f"{level.mean():.3g}"
            name = f"{float(name) / 1e6:g} MPa"
        found.append(Rows(name, np.arange(first, last), told))
    return found, []


def _by_name(columns: Columns, complete: np.ndarray, file: str) -> tuple[list[Rows], list[Fault]]:
    names, strain = np.array(columns.names), columns.values["strain_yy"]
    title = columns.titles["name"]
    count = len(set(columns.names or []))
    if count > max(1, len(names) // 2):
        shown = f"{count} names in {len(names)} rows"
        expected = "one name for all rows of a test; a counter needs another title, such as number"
        return [], [Fault(file, title, shown, expected)]
    found, faults = [], []
    for name in dict.fromkeys(columns.names or []):
        index = np.flatnonzero(names == name)
        found.append(Rows(name, index, f"column {title}"))
        rows = index[complete[index]]
        if "time" in columns.values:
            continue  # time that does not go on tells two tests of one name
        for k in np.flatnonzero(np.diff(rows) > 1) + 1:
            apart = (names[rows[k - 1] : rows[k]] != name).any()
            before = strain[rows[:k]]
            reach = float(np.abs(before - before[0]).max())
            if apart and _falls(before[0], before[-1], strain[rows[k]], reach):
                where = f"row {columns.rows[rows[k]]}, {title}"
                expected = "another name for a second test, or a column time_s that goes on"
                faults.append(Fault(file, where, f"{name} again, from the beginning", expected))
                break
    return found, faults


def _blocks(columns: Columns, rows: np.ndarray, file: str) -> tuple[list[tuple[np.ndarray, str]], list[Fault]]:
    """Complete rows of each test, and what ended the one before."""
    v = columns.values
    time, strain, stress = v.get("time"), v["strain_yy"], v["stress_yy"]
    level = v["confining_stress"] if "confining_stress" in v else np.zeros(len(strain))
    floor = _FLOOR * float(np.abs(stress[rows]).max(initial=0.0))
    parts: list[tuple[np.ndarray, str]] = []
    told, first = "one test in the file", 0
    total, reach, rise = 0.0, 0.0, 0.0
    for k in range(1, len(rows)):
        i, last, begin, n = rows[k], rows[k - 1], rows[first], k - first
        total = (total if n > 1 else 0.0) + level[last]
        reach = max(reach if n > 1 else 0.0, abs(strain[last] - strain[begin]))
        rise = max(rise if n > 1 else 0.0, abs(stress[last] - stress[begin]))
        mean = total / n
        other = abs(level[i] - mean) > max(_WITHIN * mean, floor)
        nominal = n > 1 and level[i] != level[last] == level[begin] == level[rows[(first + k) // 2]]
        anew = time is not None and time[i] <= time[begin] and (n > 1 or other)
        fallen = _falls(strain[begin], strain[last], strain[i], reach)
        if anew or (fallen and (other or nominal)):
            parts.append((rows[first:k], told))
            told = "time that begins anew" if anew else "strain that begins anew at another confining stress"
            first = k
        elif other:
            where = f"row {columns.rows[i]}, {columns.titles['confining_stress']}"
            found = f"{level[i] / 1e6:.4g} MPa, after {mean / 1e6:.4g} MPa on the mean, in the course of a test"
            within = f"within {100 * _WITHIN:.0f} % of that mean (a test begins when its confining stress is on)"
            return [], [Fault(file, where, found, f"{within}; or {_CURE}")]
        elif (
            fallen
            and abs(strain[i] - strain[begin]) <= _NEAR * reach
            and abs(stress[i] - stress[begin]) <= _NEAR * rise
        ):
            where = f"row {columns.rows[i]}, {columns.titles['strain_yy']}"
            found = "back at the first strain and stress in one step"
            return [], [Fault(file, where, found, f"one test or two: {_CURE}")]
    if len(rows):
        parts.append((rows[first:], told if parts or "confining_stress" not in v else "one confining stress"))
    return parts, []


def _falls(begin: float, last: float, now: float, reach: float) -> bool:
    """Whether strain goes back by much of what was reached, in one step."""
    return reach > 0.0 and abs(last - begin) - abs(now - begin) > _FALL * reach
