"""The saved state of a calibration: finished starts of its searches, so that an interrupted run can go on."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import graben
from graben.errors import BadInput, Fault
from graben.mechanics.optimise.multistart import Help, Start
from graben.schemas.provenance import sha256_of
from graben.schemas.saved import Arrays, read_saved, write_saved
from graben.stages.calibrate.workers import Workers

# Tables of a finished start: name, kind of dtype, dimensions.
_PARTS = (("members", "f", 2), ("values", "f", 1), ("reasons", "U", 1), ("history", "f", 1), ("evaluations", "i", 0))


def digest_of(scene_texts: Iterable[str], inputs: Iterable[Path]) -> str:
    """What the answer depends on, as one SHA-256: scenes as run, contents of the inputs, version."""
    parts = [graben.__version__, *scene_texts, *(sha256_of(p) for p in inputs)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


@dataclass
class State:
    """Finished starts by search (a name) and number, written to `path` after each; `finish` removes the file.

    path : None for a search that leaves nothing
    """

    path: Path | None
    digest: str
    workers: Workers
    starts: dict[str, dict[int, Start]] = field(default_factory=dict)

    def load(self) -> None:
        """Take up what an interrupted run left; without a file nothing was left. BadInput where it does not fit."""
        if self.path is None or not self.path.is_file():
            return
        expected = "that of the same scene, curves and version; without `restart` it is begun anew"
        tables = read_saved(self.path, {"digest": self.digest}, expected)
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
                raise BadInput(Fault(str(self.path), f"{name}|{part}", "", "a finished start of a search"))
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
                raise BadInput(Fault(str(self.path), f"{search}|{number}|members", "", expected))

        def keep(number: int, start: Start) -> None:
            own[number] = start
            self._write()

        return Help(self.workers.executor, self.workers.chunk, dict(own), keep)

    def finish(self) -> None:
        if self.path is not None:
            self.path.unlink(missing_ok=True)

    def _write(self) -> None:
        tables = {}
        for search, numbers in self.starts.items():
            for number, start in numbers.items():
                for name in ("members", "values", "reasons", "history", "evaluations"):
                    tables[f"{search}|{number}|{name}"] = getattr(start, name)
        if self.path is not None:
            write_saved(self.path, {"digest": self.digest}, tables)
