"""Columns of a measured curve: what titles and units mean, which decimal mark the numbers have, and the numbers."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from graben.errors import BadInput, Fault
from graben.schemas.text_table import SPREADSHEET, TextTable

AXES = ("xx", "yy", "zz", "xy")
NEEDED = ("stress_yy", "stress_xx", "strain_yy", "strain_xx")
EXPECTED = "stress_yy_mpa, stress_xx_mpa, strain_yy_percent, strain_xx_percent"

_NAMES = {
    "stress_yy": "stressyy sigmayy axialstress verticalstress stressaxial stressvertical sigmaaxial sigma1 sig1",
    "stress_xx": "stressxx sigmaxx lateralstress radialstress horizontalstress stresslateral stressradial "
    "sigmaradial sigma3 sig3",
    "stress_zz": "stresszz sigmazz",
    "stress_xy": "stressxy sigmaxy tauxy shearstress",
    "confining_stress": "confiningstress confiningpressure cellpressure confinement",
    "strain_yy": "strainyy epsilonyy epsyy axialstrain verticalstrain strainaxial strainvertical epsilon1 eps1 "
    "epsilonaxial epsaxial",
    "strain_xx": "strainxx epsilonxx epsxx lateralstrain radialstrain horizontalstrain strainlateral strainradial "
    "epsilon3 eps3 circumferentialstrain epsilonradial epsradial",
    "strain_zz": "strainzz epsilonzz epszz",
    "strain_xy": "strainxy epsilonxy epsxy",
    "time": "time elapsedtime testtime",
    "step": "step",
    "name": "name curve curvename test testid testname testno testnumber specimen specimenid specimenno sample "
    "sampleid sampleno",
}
_MEANING = {name: meaning for meaning, names in _NAMES.items() for name in names.split()}
_STRESS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "N/m2": 1.0, "kN/m2": 1e3, "MN/m2": 1e6,
           "bar": 1e5}  # fmt: skip
_STRAIN = {"percent": 1e-2, "%": 1e-2, "pct": 1e-2, "1": 1.0, "-": 1.0, "mm/mm": 1.0, "m/m": 1.0, "permille": 1e-3,
           "‰": 1e-3, "mm/m": 1e-3, "millistrain": 1e-3, "microstrain": 1e-6, "ustrain": 1e-6, "uε": 1e-6,
           "ue": 1e-6, "um/m": 1e-6}  # fmt: skip
_TIME = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "min": 60.0, "minutes": 60.0, "h": 3600.0,
         "hours": 3600.0}  # fmt: skip
_NONE = {"": 1.0, "-": 1.0, "1": 1.0}
_LISTED = {"stress": "Pa, kPa, MPa, GPa, N/mm2, kN/m2, bar", "strain": "1, mm/mm, percent, %, permille, microstrain",
           "time": "s, ms, min, h"}  # fmt: skip
_LISTED["confining"] = _LISTED["stress"]
_MISSING = {"", "-", "--", "nan", "n/a", "na", "null", "none", "missing", *SPREADSHEET}
_SHOWN = 5

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_GROUPS = re.compile(r"[+-]?\d{1,3}(?:([.,' \u00a0\u2009\u202f’])\d{3})(?:\1\d{3})*(?:[.,]\d*)?", re.ASCII)


def _units(meaning: str) -> dict[str, float]:
    """Units that a meaning takes, with their factors to SI; lower case is taken too."""
    kind = meaning.partition("_")[0]
    table = {"stress": _STRESS, "confining": _STRESS, "strain": _STRAIN, "time": _TIME}.get(kind, _NONE)
    return table | {u.lower(): f for u, f in table.items()}


def _plain_unit(text: str) -> str:
    text = text.strip().strip("[]()").strip().replace("²", "2").replace("^", "").replace("**", "")
    return text.replace("µ", "u").replace("μ", "u").replace(" ", "")


def _factor(meaning: str, unit: str) -> float | None:
    """Factor to SI of a unit, None where it is none of this meaning. mPa would be a thousandth of a pascal."""
    units, plain = _units(meaning), _plain_unit(unit)
    return units.get(plain, None if plain == "mPa" else units.get(plain.lower()))


def _meaning(name: str) -> str | None:
    plain = name.lower().replace("σ", "sigma").replace("ε", "epsilon").replace("τ", "tau")
    return _MEANING.get(re.sub(r"[\s_.\-]", "", plain))


def _understand(title: str) -> tuple[str | None, str | None]:
    """What a title stands for, and the unit in it: `stress_yy_mpa`, `Axial stress [MPa]`, `axial strain, %`."""
    bracket = re.fullmatch(r"(.*\S)\s*[\[(]([^\[\]()]*)[\])]", title.strip())
    if bracket and (meaning := _meaning(bracket[1])):
        return meaning, bracket[2]
    if meaning := _meaning(title):
        return meaning, None
    for mark in ("_", " in ", ",", " ", "/"):
        name, found, unit = title.strip().rpartition(mark)
        if found and (meaning := _meaning(name)):
            return meaning, unit
    # a unit may hold the mark itself: "strain_yy_mm/mm" is found above, "axial stress N/mm2" and "sigma_1/MPa" too
    name, found, unit = title.strip().partition("/")
    return (_meaning(name), unit) if found and _meaning(name) else (None, None)


def understood(title: str) -> bool:
    return _understand(title)[0] is not None


@dataclass(frozen=True)
class Columns:
    """Numbers of a table in SI, with the file's own sign.

    rows (n,): line numbers; values: meaning -> (n,), nan where a cell is missing; names (n,) or None; titles: meaning
    -> title in the file; without_unit: strains whose unit is not said; and how the numbers were read."""

    rows: np.ndarray
    values: dict[str, np.ndarray]
    names: list[str] | None
    titles: dict[str, str]
    without_unit: tuple[str, ...]
    ignored: tuple[str, ...]
    decimal_mark: str
    units_row: int | None


def read_columns(table: TextTable, file: str) -> Columns:
    """Numbers of the columns that are understood; the others are left out and named.

    Raises
    ------
    BadInput : a needed column or a unit is absent, two columns mean the same, a cell is no number
    """
    meanings = [_understand(title) for title in table.titles]
    rows = list(table.rows)
    units_row, below = _units_row(rows, [m for m, _ in meanings])
    if units_row is not None:
        rows = rows[1:]
    place: dict[str, int] = {}
    factors: dict[str, float] = {}
    faults, ignored, without_unit = [], [], []
    for k, (title, (meaning, unit)) in enumerate(zip(table.titles, meanings, strict=True)):
        if meaning is None:
            if title or any(cells[k] for _, cells in rows):
                ignored.append(title or f"(column {k + 1})")
            continue
        if meaning in place:
            other = table.titles[place[meaning]]
            faults.append(Fault(file, title, f"means {meaning}, as {other} does", "one column: leave one out"))
            continue
        place[meaning] = k
        if meaning == "name":
            continue
        found = _factor_of(meaning, title, unit, below[k], file)
        if isinstance(found, Fault):
            faults.append(found)
        else:
            factors[meaning], said = found
            without_unit += [] if said or not meaning.startswith("strain") else [meaning]
    absent = [n for n in NEEDED if n not in place and not (n == "stress_xx" and "confining_stress" in place)]
    faults += [Fault(file, n + ("_pa" if n.startswith("stress") else ""), "(absent)", "this column") for n in absent]
    if absent:
        faults += [Fault(file, title, "", f"no such column ({EXPECTED}, name, time_s, ...)") for title in ignored]
    if "time" in place and "step" in place:
        ignored.append(table.titles[place.pop("step")])
    if faults:
        raise BadInput(faults)
    cells = {m: [c[k] for _, c in rows] for m, k in place.items() if m != "name"}
    numbers = np.array([n for n, _ in rows], dtype=np.int64)
    titles = {m: table.titles[k] for m, k in place.items()}
    mark = _decimal_mark(cells, numbers, titles, table.separator, file)
    values, bad, shown = {}, 0, []
    for meaning, column in cells.items():
        out = np.empty(len(column))
        for i, cell in enumerate(column):
            number = _number(cell, mark)
            if isinstance(number, str):
                bad += 1
                if bad <= _SHOWN:
                    shown.append(Fault(file, f"row {numbers[i]}, {titles[meaning]}", repr(cell), number))
                number = math.nan
            out[i] = number * factors[meaning]
        values["time" if meaning == "step" else meaning] = out
    if bad > _SHOWN:
        shown.append(Fault(file, "rows", f"{bad - _SHOWN} more", "a number"))
    names = [c[place["name"]] for _, c in rows] if "name" in place else None
    for i, name in enumerate(names or []):
        if not name:
            shown.append(
                Fault(file, f"row {numbers[i]}, {titles['name']}", "empty", "the name of the test, in each row")
            )
    if shown:
        raise BadInput(shown[: 2 * _SHOWN])
    words = {".": "point", ",": "comma", "": "not used"}
    return Columns(numbers, values, names, titles, tuple(without_unit), tuple(ignored), words[mark], units_row)


def _units_row(rows: list[tuple[int, list[str]]], meanings: list[str | None]) -> tuple[int | None, list[str | None]]:
    """Line number of a row of units under the header, and the unit of each column."""
    nothing: list[str | None] = [None] * len(meanings)
    if not rows:
        return None, nothing
    number, cells = rows[0]
    known = [
        (m, c) for m, c in zip(meanings, cells, strict=True) if m not in (None, "name") and c.lower() not in _MISSING
    ]
    if any(re.match(r"[+-]?[.,]?\d", c) and _plain_unit(c) != "1" for _, c in known):
        return None, nothing
    # one unit makes it a row of units; a word in it that is no unit of its column is then refused by its title
    words = [(m, c) for m, c in known if m and _plain_unit(c) != "1"]
    return (number, list(cells)) if any(_factor(m, c) is not None for m, c in words) else (None, nothing)


def _factor_of(
    meaning: str, title: str, unit: str | None, below: str | None, file: str
) -> tuple[float, bool] | Fault:
    """Factor to SI from the title and the row of units, and whether a unit was said at all."""
    strain = meaning.startswith("strain")
    if meaning == "step":
        return 1.0, True
    if below is not None and _plain_unit(below) == "-" and (unit or not strain):
        below = None  # a dash says nothing new
    found = [(u, _factor(meaning, u)) for u in (unit, below) if u is not None and _plain_unit(u)]
    for u, factor in found:
        if factor is None:
            expected = f"a unit at the end of its name, or in a row below it: {_LISTED[meaning.partition('_')[0]]}"
            return Fault(file, title, repr(u), expected)
    if len({factor for _, factor in found}) > 1:
        return Fault(file, title, f"{found[0][0]} in the title, {found[1][0]} below it", "one unit")
    if found and found[0][1] is not None:
        return found[0][1], True
    if strain:
        return 1.0, False
    example = "_".join((meaning, "s" if meaning == "time" else "pa"))
    leave = "; a column of dates or clock times is not needed: leave it out" if meaning == "time" else ""
    return Fault(file, title, "", f"a unit at the end of its name, or in a row below it, such as {example}{leave}")


def _decimal_mark(
    cells: dict[str, list[str]], rows: np.ndarray, titles: dict[str, str], separator: str, file: str
) -> str:
    """ "." or ",", or "" where no number has either.

    A mark is proven decimal by a cell in which it cannot part thousands: no three digits after it, no one to three
    before it, a leading zero, an exponent."""
    proven: dict[str, tuple[str, str]] = {}
    open_: dict[str, tuple[str, str]] = {}
    for meaning, column in cells.items():
        for i, cell in enumerate(column):
            marks = [c for c in cell if c in ".,"]
            if len(marks) != 1 or not _NUMBER.fullmatch(_plain(cell).replace(",", ".")):
                continue
            kind = open_ if re.fullmatch(r"[+-]?[1-9]\d{0,2}[.,]\d{3}", _plain(cell)) else proven
            kind.setdefault(marks[0], (f"row {rows[i]}, {titles[meaning]}", cell))
    if len(proven) == 2:
        (where, cell), (there, other) = proven["."], proven[","]
        raise BadInput(Fault(file, where, repr(cell), f"one decimal mark: {there} has {other!r}"))
    if proven:
        return next(iter(proven))
    # between semicolons a point may part thousands as a comma may; elsewhere it is decimal
    if "," in open_ or ("." in open_ and separator == "semicolon"):
        mark = "," if "," in open_ else "."
        where, cell = open_[mark]
        one, thousand = cell.replace(",", "."), cell.replace(mark, "")
        expected = (
            f"a number with one meaning; this is {one} or {thousand}: write no marks between thousands, and other "
            "than three digits after the decimal mark in one cell at least"
        )
        raise BadInput(Fault(file, where, repr(cell), expected))
    return "." if open_ else ""


def _plain(cell: str) -> str:
    return cell.replace("−", "-")


def _number(cell: str, mark: str) -> float | str:
    """The number of a cell; nan where it is missing; or what was expected instead."""
    text = _plain(cell)
    if text.lower() in _MISSING:
        return math.nan
    plain = text.replace(",", ".") if mark == "," else text
    if _NUMBER.fullmatch(plain) and not (mark == "," and "." in text):
        value = float(plain.lower().replace("d", "e"))
        return value if math.isfinite(value) else "a finite number"
    if _GROUPS.fullmatch(text):
        return "a number without marks between thousands"
    return "a number"
