"""Checkpoints of a run: one file beside its output, from which a restart goes on bitwise.

A stage hands its state to `keep` after every step that passed its checks. The last one is held in memory. It is
written now and then, and when the run is interrupted or fails; the file goes when the run succeeds.
"""

from __future__ import annotations

import hashlib
import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

import graben
from graben.errors import BadInput, Fault, Refused
from graben.mechanics.stored import listed
from graben.schemas.outputs import CHECKPOINT, beside, files_of
from graben.schemas.provenance import Record, sha256_of
from graben.schemas.saved import Arrays, read_saved, write_saved
from graben.schemas.scene import Scene

Keep = Callable[[Callable[[], Arrays]], None]
"""Told by mechanics of each state that a run can go on from, and how to take it."""

# Wall time between checkpoints on disk; a killed run loses no more than this [s].
EVERY_S = 60.0
# Of the wall time that copying states may take, and that writing them may take.
_SHARE = 0.02
_LARGEST = 1e60  # of the finite numbers of a state, in SI units
_EXPECTED = "that of the same scene, inputs and build; without `restart` the run begins anew"
_SPENT = "spent"  # wall and CPU time of the run until then [s]


@dataclass
class _Pace:
    """When something that costs time is due again, so that it takes no more than its share."""

    ended: float = -np.inf
    cost: float = 0.0

    def due(self, every: float = 0.0) -> bool:
        return time.monotonic() - self.ended >= max(every, self.cost / _SHARE)

    @contextmanager
    def timed(self) -> Iterator[None]:
        begun = time.monotonic()
        yield
        self.ended = time.monotonic()
        self.cost = self.ended - begun


@dataclass
class Checkpoint:
    """The checkpoint of one run.

    Attributes
    ----------
    path : of the file
    marks : what it belongs to: scene, inputs and build
    record : its clocks count what the run took before it was stopped
    """

    path: Path
    marks: Mapping[str, str]
    record: Record
    _last: Arrays | None = None
    _later: Callable[[], Arrays] = dict
    _taken: _Pace = field(default_factory=_Pace)
    _written: _Pace = field(default_factory=lambda: _Pace(time.monotonic()))

    @classmethod
    def of(
        cls, output: Path, scene: Scene, record: Record, laws: Iterable[str] = (), end: str = CHECKPOINT
    ) -> Checkpoint:
        """For a run of a scene with what its record names as inputs.

        laws : names of laws, whose sources count where they are the user's own; end : of the file's name
        """
        inputs = [*record.inputs.values(), *map(_content, files_of(scene)[1:]), *map(_source, laws)]
        marks = {"scene": scene.source.sha256, "inputs": _joined(inputs), "build": build()}
        return cls(beside(output, end), marks, record)

    def read(self) -> Arrays:
        """What a stopped run left.

        Raises
        ------
        BadInput : there is none, it is damaged, or it belongs to another scene, other inputs or another build
        """
        if not self.path.is_file():
            raise BadInput(
                Fault(str(self.path), "restart", "", "a checkpoint, as an interrupted run leaves it", True)
            )
        arrays = read_saved(self.path, self.marks, _EXPECTED)
        for name, values in arrays.items():
            if values.dtype.kind == "f" and (np.abs(values[np.isfinite(values)]) > _LARGEST).any():
                raise BadInput(Fault(str(self.path), name, "", f"numbers below {_LARGEST:g}"))
        with self.bringing_back():
            wall, cpu = listed(arrays.pop(_SPENT, None), _SPENT, 2)
        self.record.count(wall, cpu)
        return arrays

    @contextmanager
    def bringing_back(self) -> Iterator[None]:
        """Within this block mechanics take the state up; what they refuse is the checkpoint's fault."""
        try:
            yield
        except Refused as error:
            expected = f"a checkpoint of this model ({error})"
            raise BadInput(Fault(str(self.path), "restart", "", expected, True)) from error

    def keep(self, take: Callable[[], Arrays], *, at_once: bool = False, later: Callable[[], Arrays] = dict) -> None:
        """The run stands on a state that it can go on from; take copies what later steps change.

        at_once : put it on disk now; later : gives the rest, which no step changes, when it is written
        """
        write = at_once or self._written.due(EVERY_S)
        if write or self._taken.due():
            with self._taken.timed():
                self._last, self._later = take(), later
        if write:
            self.write()

    def write(self) -> bool:
        """Put the last state on disk; False where there is none yet, or no room."""
        if self._last is None:
            return False
        with self._written.timed():
            spent = {_SPENT: np.array(self.record.spent())}
            return write_saved(self.path, self.marks, {**self._last, **self._later(), **spent})

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """The run, from its first step until its outputs are in place.

        What stops it leaves the last state on disk. Bad input does not: nothing is written then.
        """
        try:
            yield
        except BadInput:
            raise
        except BaseException:
            if self.write():
                logging.getLogger(__name__).warning("the state is kept in %s (--restart)", self.path)
            raise
        self.remove()

    def remove(self) -> None:
        """The run is complete."""
        self.path.unlink(missing_ok=True)


@cache
def build() -> str:
    """What computes: version and sources of graben, and the libraries whose bits get into results."""
    root = Path(graben.__file__).parent
    parts = [graben.__version__, *(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))]
    for path in sorted(root.rglob("*.py")):
        parts += [str(path.relative_to(root)), sha256_of(path)]
    return _joined(parts)


def _content(path: Path) -> str:
    """Of a file that the scene names; the call may have replaced one that is not there."""
    return sha256_of(path) if path.is_file() else ""


def _source(law: str) -> str:
    """Of the module of a user's own law."""
    module = sys.modules.get(law.partition(":")[0]) if ":" in law else None
    file = getattr(module, "__file__", None)
    return _content(Path(file)) if file else ""


def _joined(parts: Iterable[str]) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
