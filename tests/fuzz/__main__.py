"""Damaged scenes, artifacts, checkpoints, curves, maps, meshes and names of outputs: each is read, or refused.

    python -m tests.fuzz                            # 20,000 tries, or as many as fit in 25 minutes of two cores
    python -m tests.fuzz --tries 500 --seconds 60 --seed 7 scenes artifacts
    python -m tests.fuzz --again scenes:7:123       # one try again, in this process, with its traceback

A try fails by exit code 1, a traceback, a dead process, a hang, a file left half made, a number that JSON does not
know, a lost file of the user, or where `graben check` and the stage disagree. A seed gives the same tries each time.
Findings lie in results/fuzz/.
"""

from __future__ import annotations

import argparse
import multiprocessing
import multiprocessing.connection
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.conftest import ROOT
from tests.fuzz.call import HUNG_S
from tests.fuzz.families import FAMILIES
from tests.fuzz.stock import make_stock, warm
from tests.fuzz.worker import one, worker


@dataclass(frozen=True)
class Finding:
    family: str
    seed: int
    number: int
    what: str
    file: Path | None = None

    @property
    def name(self) -> str:
        return f"{self.family}:{self.seed}:{self.number}"


Outcome = tuple[Counter[str], list[Finding]]


def run(families: list[str], tries: int, seconds: float, seed: int, processes: int) -> Outcome:
    stock = Path(tempfile.mkdtemp(prefix="fuzz-stock-"))
    context = multiprocessing.get_context("spawn")
    total = sum(FAMILIES[f][1] for f in families)
    tasks = [(f, seed, k) for f in families for k in range(round(tries * FAMILIES[f][1] / total))]
    random.Random(seed).shuffle(tasks)
    counted: Counter[str] = Counter()
    findings: list[Finding] = []
    end = time.monotonic() + seconds
    lanes: list[dict[str, Any]] = [{} for _ in range(processes)]
    try:
        make_stock(stock / "stock")
        while True:
            for lane in lanes:
                _turn(lane, context, stock / "stock", tasks if time.monotonic() < end else [], counted, findings)
            if not any(lane.get("task") for lane in lanes):
                return counted, findings
            multiprocessing.connection.wait([lane["pipe"] for lane in lanes if lane.get("task")], timeout=1.0)
    finally:
        for lane in lanes:
            if lane.get("process"):
                lane["process"].kill()
        shutil.rmtree(stock, ignore_errors=True)


def _turn(lane: dict[str, Any], context: Any, stock: Path, tasks: list[Any], counted: Counter[str],
          findings: list[Finding]) -> None:  # fmt: skip
    """Take the answer of a lane, if there is one, and give it the next try."""
    if lane.get("task"):
        what = ""
        try:
            if lane["pipe"].poll():
                what = lane["pipe"].recv() or "fine"
            elif not lane["process"].is_alive():
                what = f"the process died with code {lane['process'].exitcode}"
            elif time.monotonic() - lane["since"] > HUNG_S:
                what = f"no end after {HUNG_S:g} s"
        except (EOFError, OSError):
            lane["process"].join()
            what = f"the process died with code {lane['process'].exitcode}"
        if not what:
            return
        counted[lane["task"][0]] += 1
        if what != "fine":
            findings.append(Finding(*lane["task"], what))
            print(f"{findings[-1].name}  {what[:600]}", flush=True)
            if what.startswith(("the process", "no end")):
                lane["process"].kill()
                lane["process"] = None
        lane["task"] = None
    if tasks:
        if not lane.get("process"):
            lane["pipe"], there = context.Pipe()
            lane["process"] = context.Process(target=worker, args=(there, stock), daemon=True)
            lane["process"].start()
            there.close()
        lane["task"], lane["since"] = tasks.pop(), time.monotonic()
        lane["pipe"].send(lane["task"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("families", nargs="*", choices=[[], *FAMILIES], default=[])
    parser.add_argument("--tries", type=int, default=20_000)
    parser.add_argument("--seconds", type=float, default=1500.0)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--again", metavar="FAMILY:SEED:NUMBER")
    asked = parser.parse_args()
    (ROOT / "results/fuzz").mkdir(parents=True, exist_ok=True)
    if asked.again:
        family, seed, number = asked.again.split(":")
        stock = Path(tempfile.mkdtemp(prefix="fuzz-stock-"))
        make_stock(stock / "stock")
        warm(stock / "stock", Path(tempfile.mkdtemp(dir=stock)))
        one(family, int(seed), int(number), stock / "stock", keep=True)
        print("fine")
        return 0
    families = list(asked.families) or list(FAMILIES)
    print(f"seed {asked.seed}", flush=True)
    counted, findings = run(families, asked.tries, asked.seconds, asked.seed, asked.processes)
    print(f"seed {asked.seed}: {sum(counted.values())} tries ({dict(counted)}), {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
