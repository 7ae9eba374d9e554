"""One run of a command of graben in a process of its own: what it answers, and what it costs."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_START = "from graben.cli.main import main; main(prog_name='graben')"
_LINES = 6  # of what a failed run said, kept as its reason


@dataclass(frozen=True)
class Run:
    """What a run gave: exit code, headline numbers (empty where it failed), what it said, and its cost."""

    code: int
    headline: dict[str, Any]
    said: str
    wall_s: float
    cpu_s: float
    peak_memory_bytes: int


def measured(arguments: Sequence[str], folder: Path, limit: float | None = None) -> Run:
    """Run `graben ARGUMENTS...`, with its output in a folder that exists; workers count, its parent does not.

    limit : it is ended after so long, by the clock [s]
    """
    command = [sys.executable, "-c", _START, *arguments, "--json", "-q", "-o", str(folder / "run.nc")]
    # -I -S: the launcher reads no site packages and stays small.
    launcher = [sys.executable, "-I", "-S", str(Path(__file__).with_name("launch.py")), str(folder / "cost.json")]
    with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
        process = subprocess.Popen([*launcher, *command], stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        try:
            process.wait(limit)
        except subprocess.TimeoutExpired:
            process.terminate()
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
