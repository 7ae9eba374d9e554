"""The saved state of a calibration: finished starts of its searches, so that an interrupted run can go on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.optimise.multistart import Help, Start
from graben.mechanics.stored import Arrays
from graben.stages.calibrate.workers import Workers
from graben.stages.shared.checkpoint import Checkpoint

# Tables of a finished start: name, kind of dtype, dimensions.
_PARTS = (("members", "f", 2), ("values", "f", 1), ("reasons", "U", 1), ("history", "f", 1), ("evaluations", "i", 0))


@dataclass
class State:
    """Finished starts by search (a name) and number.

    checkpoint : where they are written; None for a search that leaves nothing
    """

    checkpoint: Checkpoint | None
    workers: Workers
    starts: dict[str, dict[int, Start]] = field(default_factory=dict)

    def load(self) -> None:
        """Take up what an interrupted run left; without a file nothing was left. BadInput where it does not fit."""
        if self.checkpoint is None or not self.checkpoint.path.is_file():
            return
        tables = self.checkpoint.read()
        for name in tables:
            if name.endswith("|members"):
                search, number, _ = name.rsplit("|", 2)
                self.starts.setdefault(search, {})[int(number)] = self._start(tables, f"{search}|{number}")

    def _start(self, tables: Arrays, name: str) -> Start:
        """One finished start; BadInput where its tables do not fit together."""
        found = {part: tables.get(f"{name}|{part}", np.array(None)) for part, _, _ in _PARTS}
        count = len(found["members"]) if found["members"].ndim else 0
        for part, kind, dimensions in _PARTS:
            table = found[part]
            fits = table.dtype.kind == kind and table.ndim == dimensions
            if part in ("members", "values", "reasons"):
                fits = fits and len(table) == count > 0
            if not fits or (kind == "f" and not np.isfinite(table).all()):
                raise BadInput(Fault(self._file, f"{name}|{part}", "", "a finished start of a search"))
        reasons = tuple(map(str, found["reasons"]))
        evaluations = int(found["evaluations"])
        return Start(found["members"], found["values"], reasons, found["history"], evaluations)

    def help(self, search: str, size: int) -> Help:
        """For the search of that name over `size` parameters: who evaluates, what is done, where to put what gets
        done. BadInput where what is done is none of such a search."""
        own = self.starts.setdefault(search, {})
        for number, start in own.items():
            sets = start.members
            if sets.shape[1] != size or sets.min() < 0.0 or sets.max() > 1.0 or start.values.min() < 0.0:
                expected = f"sets of {size} parameters, as fractions of their ranges, and sums of squares"
                raise BadInput(Fault(self._file, f"{search}|{number}|members", "", expected))

        def keep(number: int, start: Start) -> None:
            own[number] = start
            if self.checkpoint is not None:
                self.checkpoint.keep(self._tables, at_once=True)

        return Help(self.workers.executor, self.workers.chunk, dict(own), keep)

    @property
    def _file(self) -> str:
        return "" if self.checkpoint is None else str(self.checkpoint.path)

    def _tables(self) -> Arrays:
        tables = {}
        for search, numbers in self.starts.items():
            for number, start in numbers.items():
                for name, _, _ in _PARTS:
                    tables[f"{search}|{number}|{name}"] = np.asarray(getattr(start, name))
        return tables
