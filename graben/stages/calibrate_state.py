"""The saved state of a calibration: finished starts of its searches, so that an interrupted run can go on."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import graben
from graben.errors import BadInput, Fault
from graben.mechanics.search.multistart import Help, Start
from graben.schemas.files import whole_file
from graben.schemas.provenance import sha256_of
from graben.stages.calibrate_workers import Workers


def digest_of(scene_texts: Iterable[str], inputs: Iterable[Path]) -> str:
    """What the answer depends on, as one SHA-256: scenes as run, contents of the inputs, version."""
    parts = [graben.__version__, *scene_texts, *(sha256_of(p) for p in inputs)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


@dataclass
class State:
    """Finished starts by search (a name) and number, written to `path` after each; `finish` removes the file."""

    path: Path
    digest: str
    workers: Workers
    starts: dict[str, dict[int, Start]] = field(default_factory=dict)

    def load(self) -> None:
        """Take up what an interrupted run left; without a file nothing was left. BadInput where it does not fit."""
        if not self.path.is_file():
            return
        try:
            with np.load(self.path, allow_pickle=False) as data:
                found = str(data["digest"])
                tables = {name: data[name] for name in data.files if name != "digest"}
        except (OSError, ValueError, KeyError) as error:
            raise BadInput(Fault(str(self.path), "--restart", "", f"a readable state ({error})")) from None
        if found != self.digest:
            expected = "a state of the same scene, curves and version; without --restart it is begun anew"
            raise BadInput(Fault(str(self.path), "--restart", "", expected))
        for name in tables:
            if name.endswith("|members"):
                search, number, _ = name.rsplit("|", 2)
                part = {k: tables[f"{search}|{number}|{k}"] for k in ("values", "reasons", "history", "evaluations")}
                self.starts.setdefault(search, {})[int(number)] = Start(
                    tables[name], part["values"], tuple(map(str, part["reasons"])), part["history"],
                    int(part["evaluations"]),
                )  # fmt: skip

    def help(self, search: str) -> Help:
        """For the search of that name: who evaluates, what is done, and where to put what gets done."""
        own = self.starts.setdefault(search, {})

        def keep(number: int, start: Start) -> None:
            own[number] = start
            self._write()

        return Help(self.workers.executor, self.workers.chunk, dict(own), keep)

    def finish(self) -> None:
        self.path.unlink(missing_ok=True)

    def _write(self) -> None:
        tables = {"digest": np.array(self.digest)}
        for search, numbers in self.starts.items():
            for number, start in numbers.items():
                for name in ("members", "values", "reasons", "history", "evaluations"):
                    tables[f"{search}|{number}|{name}"] = np.array(getattr(start, name))
        with whole_file(self.path) as temporary:
            np.savez(temporary, **tables)  # type: ignore[arg-type]
