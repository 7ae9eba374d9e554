"""One run of a command in a process of its own: what it answers and what it costs. Done once, it is kept."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import graben
from graben.schemas.files import whole_file
from graben.schemas.provenance import sha256_of

_START = "import sys; from graben.cli.main import main; main(prog_name='graben')"
_LINES = 6  # of what a failed run said, kept as its reason


@dataclass(frozen=True)
class Task:
    """A run to be made.

    arguments : of `graben`, without -o; folder : where its result is kept; name : of that result
    """

    arguments: tuple[str, ...]
    folder: Path
    name: str


@dataclass(frozen=True)
class Run:
    """What a run gave: exit code, headline numbers (empty where it failed), what it said, and its cost."""

    code: int
    headline: dict[str, Any]
    said: str
    wall_s: float
    cpu_s: float
    peak_memory_bytes: int


def name_of(arguments: Sequence[str], files: Sequence[Path]) -> str:
    """A name that changes with the arguments, with what the files hold, and with graben itself."""
    parts = [*arguments, *(sha256_of(f) for f in files), _version()]
    return hashlib.sha256("\0".join(parts).encode(errors="surrogateescape")).hexdigest()[:20]


def _version() -> str:
    """A digest of the sources: a run of other code is another run."""
    root = Path(graben.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


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
        found = _run(task.arguments, Path(folder))
    if found.code != 130:  # what was interrupted gave nothing
        with whole_file(task.folder / f"{task.name}.json") as temporary:
            temporary.write_text(json.dumps(asdict(found), indent=1), encoding="utf-8")
    return found


def _run(arguments: Sequence[str], folder: Path) -> Run:
    command = [sys.executable, "-c", _START, *arguments, "--json", "-q", "-o", str(folder / "run.nc")]
    # -I -S: the launcher reads no site packages and stays small.
    launcher = [sys.executable, "-I", "-S", str(Path(__file__).with_name("launch.py")), str(folder / "cost.json")]
    with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
        process = subprocess.Popen([*launcher, *command], stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        try:
            process.wait()
        except BaseException:
            process.terminate()
            process.wait()
            raise
    try:
        cost: Mapping[str, Any] = json.loads((folder / "cost.json").read_text())
    except (OSError, ValueError):
        cost = {"code": process.returncode or 1, "wall_s": 0.0, "cpu_s": 0.0, "peak_memory_bytes": 0}
    said = (folder / "err").read_text(encoding="utf-8", errors="replace").strip().splitlines()
    headline: dict[str, Any] = {}
    if cost["code"] == 0:
        headline = json.loads((folder / "out").read_text(encoding="utf-8"))
    return Run(headline=headline, said="\n".join(said[-_LINES:]), **cost)
