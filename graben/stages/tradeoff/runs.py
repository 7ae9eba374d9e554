"""Runs of a study: what was made once is kept, and made again only where something has changed."""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from graben.schemas.files import whole_file
from graben.schemas.provenance import sha256_of
from graben.stages.shared.checkpoint import build
from graben.stages.shared.run_apart import Run, measured

# What a command says where it is the numerics that failed, not the machine.
_NUMERICS = "the numerics failed"


@dataclass(frozen=True)
class Task:
    """A run to be made.

    arguments : of `graben`, without -o; folder : where its result is kept; name : of that result
    """

    arguments: tuple[str, ...]
    folder: Path
    name: str


def name_of(arguments: Sequence[str], files: Sequence[Path]) -> str:
    """A name that changes with the arguments, with what the files hold, and with graben and its libraries."""
    parts = [*arguments, *(sha256_of(f) for f in files), build()]
    return hashlib.sha256("\0".join(parts).encode(errors="surrogateescape")).hexdigest()[:20]


def kept(task: Task) -> Run | None:
    """The result of an earlier run; None where there is none that can be read."""
    try:
        return Run(**json.loads((task.folder / f"{task.name}.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def make(task: Task) -> Run:
    """Run it, unless that was done; what it gave is kept before this returns."""
    found = kept(task)
    if found is not None:
        return found
    with tempfile.TemporaryDirectory(prefix="graben-") as folder:
        found = measured(task.arguments, Path(folder))
    if found.code == 0 or (found.code == 3 and _NUMERICS in found.said):  # else another try may go better
        with whole_file(task.folder / f"{task.name}.json") as temporary:
            temporary.write_text(json.dumps(asdict(found), indent=1), encoding="utf-8")
    return found
