"""A constitutive law as a record: its declared parameters, its state, and how values become `par`.

A law is one compiled function (see `laws.py`) plus one `Law` record. `Law.pack` turns named values in SI units
into the flat float64 array that the compiled function reads:

    par = [one slot per Parameter that is not a table, in declared order]
        + [one slot per derived value, filled by `Law.prepare`]
        + [each table in declared order: count n, then x0, y0, x1, y1, ...]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.declared.parameter import Parameter
from graben.errors import Refused

OK = 0
NOT_CONVERGED = 1  # the return mapping found no root
NOT_FINITE = 2  # nan or inf came in, or a tensor too large to square
UNKNOWN_LAW = 9


def _nothing(par: NDArray[np.float64]) -> None:
    """A law without derived values."""


@dataclass(frozen=True)
class Law:
    """A law's record: `id` is what the compiled dispatch branches on.

    initial_state(par) gives the (m,) state array of the unstressed material; state[0] is the equivalent plastic
    strain and state[1] the damage where a law has them. prepare(par) fills the derived slots in place.
    check(values), with defaults where nothing is given, returns texts for faults that concern several parameters at
    once. A search asks for such values too: prepare moves one of them, in place, to the nearest that check allows.
    """

    id: int
    name: str
    parameters: tuple[Parameter, ...]
    state_names: tuple[str, ...]
    initial_state: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    title: str = ""
    derived: tuple[str, ...] = ()
    prepare: Callable[[NDArray[np.float64]], Any] = _nothing
    check: Callable[[Mapping[str, Any]], list[str]] = field(default=lambda values: [])

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; KeyError when there is none."""
        for p in self.parameters:
            if p.name == name:
                return p
        raise KeyError(name)

    def index(self, name: str) -> int:
        """Slot of a number or choice parameter in `par`."""
        return [p.name for p in self.parameters if not p.table].index(name)

    def spelled_out(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """`values`, where rows given for a choice stand for that choice's table: hardening = [[...]] is the word
        "table" and hardening_table = [[...]]."""
        out = dict(values)
        for p in self.parameters:
            if "table" in p.choices and p.name in out and not isinstance(out[p.name], str | None):
                rows = out[p.name]
                out[p.name] = "table"
                out.setdefault(f"{p.name}_table", rows)
        return out

    def active(self, values: Mapping[str, Any]) -> tuple[Parameter, ...]:
        """Parameters that count, given the choices in `values`."""
        values = self.spelled_out(values)

        def counts(p: Parameter) -> bool:
            if p.when is None:
                return True
            other = self.parameter(p.when[0])
            return values.get(other.name, other.default) in p.when[1].split("|")

        return tuple(p for p in self.parameters if counts(p))

    def faults(self, values: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Every fault of `values` as (parameter name, what was expected); empty when they can be packed."""
        values = self.spelled_out(values)
        found: list[tuple[str, str]] = []
        names = {p.name for p in self.parameters}
        for name in values:
            if name not in names:
                found.append((name, f"one of the parameters of {self.name}: {', '.join(sorted(names))}"))
        active = self.active(values)
        for p in self.parameters:
            value = values.get(p.name, p.default)
            if p not in active:
                if p.name in values and p.when is not None:
                    found.append((p.name, f"no value: it counts only with {p.when[0]} = {p.when[1]!r}"))
                continue
            if value is None:
                found.append((p.name, f"a value in {p.unit}: required by {self.name}"))
            elif p.choices:
                if value not in p.choices:
                    found.append((p.name, f"one of {', '.join(p.choices)}"))
            elif p.table:
                found += [(p.name, text) for text in _table_faults(value)]
            else:
                try:
                    number = float(value)
                except (TypeError, ValueError):
                    found.append((p.name, f"a number in {p.unit}"))
                    continue
                if not p.holds(number):
                    found.append((p.name, f"a number {p.bounds}"))
        if not found:
            defaults = {p.name: p.default for p in active if p.default is not None}
            found += [("", text) for text in self.check({**defaults, **values})]
        return found

    def pack(self, values: Mapping[str, Any]) -> NDArray[np.float64]:
        """Named values in SI -> par (k,). ValueError that lists every fault."""
        faults = self.faults(values)
        if faults:
            raise Refused(f"{self.name}: " + "; ".join(f"{name}: expected {text}" for name, text in faults))
        values = self.spelled_out(values)
        numbers: list[float] = []
        tables: list[float] = []
        active = self.active(values)
        for p in self.parameters:
            value = values.get(p.name, p.default)
            if p.table:
                rows = np.empty((0, 2)) if p not in active else np.asarray(value, dtype=np.float64)
                tables += [float(len(rows)), *rows.ravel().tolist()]
            elif p.choices:
                numbers.append(float(p.choices.index(value)))
            elif p in active:
                numbers.append(float(value))
            else:
                numbers.append(0.0)
        par = np.array(numbers + [0.0] * len(self.derived) + tables, dtype=np.float64)
        self.prepare(par)
        return par


def _table_faults(value: Any) -> list[str]:
    try:
        rows = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return ["an (n, 2) table of numbers"]
    if rows.ndim != 2 or rows.shape[1:] != (2,) or len(rows) < 1:
        return [f"an (n, 2) table with at least one row, found shape {rows.shape}"]
    if not np.isfinite(rows).all():
        return ["finite numbers in the table"]
    if np.any(np.diff(rows[:, 0]) <= 0.0):
        return ["a first column that rises"]
    return []
