"""Run the studies of studies.toml, write them down, and hold the promises of the knob table against them.

    python pipelines/tradeoffs/study.py RESULTS                      # all studies, and the page in docs/studies
    python pipelines/tradeoffs/study.py RESULTS --promises           # those of fidelity; exit code 1: one is broken
    python pipelines/tradeoffs/study.py RESULTS --only fem blocks    # those whose names begin so

Each study is one call of `graben tradeoff`; what is done is not done again.
"""

from __future__ import annotations

import argparse
import datetime
import json
import platform
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from graben.declared.knobs import FIDELITIES, stage_of

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BIN = Path(sys.executable).parent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--promises", action="store_true")
    parser.add_argument("--only", nargs="+", default=[""])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--page", type=Path)
    args = parser.parse_args()
    plan = tomllib.loads((HERE / "studies.toml").read_text(encoding="utf-8"))
    folder = args.results / "tradeoffs"
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [
        s
        for s in plan["studies"]
        if s["name"].startswith(tuple(args.only)) and (s.get("promise") or not args.promises)
    ]
    if not chosen:
        print(f"no study {args.only!r}", file=sys.stderr)
        return 2
    found = {}
    for study in chosen:
        runs = {r["name"]: r for r in plan["runs"]}
        for name in [study["scene"], *study.get("inputs", [])]:
            if name.startswith("@"):
                _make(folder, runs[name[1:]])
        found[study["name"]] = _study(folder, study, args.processes)
    if args.page is not None:
        _write(args.page, folder, chosen, found, [s["name"] for s in plan["studies"] if s not in chosen])
    return _held(chosen, found)


def _call(words: list[Any]) -> str:
    print("+", *words, file=sys.stderr, flush=True)
    return subprocess.run(list(map(str, words)), check=True, stdout=subprocess.PIPE, text=True).stdout


def _make(folder: Path, run: dict[str, Any]) -> None:
    """A run that studies read, unless it is there."""
    output = folder / f"{run['name']}.nc"
    if not output.exists():
        tool, scene, *options = run["command"]
        _call([BIN / tool, ROOT / "pipelines" / scene, *options, "-o", output, "-q"])


def _study(folder: Path, study: dict[str, Any], processes: int) -> dict[str, Any]:
    """The JSON of a study."""

    def file(name: str) -> Path:
        return folder / f"{name[1:]}.nc" if name.startswith("@") else ROOT / "pipelines" / name

    words: list[Any] = [BIN / "graben", "tradeoff", file(study["scene"]), *map(file, study.get("inputs", []))]
    words += ["--quantity", study["quantity"], "--seeds", study.get("seeds", 1), "--processes", processes]
    for knob in study.get("knobs", []):
        words += ["--knob", knob]
    for setting in study.get("set", []):
        words += ["--set", setting]
    output = folder / f"{study['name']}.nc"
    said = json.loads(_call([*words, "-o", output, "--overwrite", "--json"]))
    _call([BIN / "graben", "show", output, "-o", output.with_suffix(".png"), "--overwrite", "-q"])
    return said


def _held(studies: list[dict[str, Any]], found: dict[str, dict[str, Any]]) -> int:
    """Print promises beside what was seen; 1 where one is broken."""
    broken = 0
    for study in studies:
        stage = stage_of(study.get("promise", ""))
        if stage is None:
            continue
        points = {p["knobs"]["fidelity"]: p for p in found[study["name"]]["points"]}
        for fidelity, promise in zip(FIDELITIES, stage.promises or [None] * len(FIDELITIES)):
            point = points[fidelity]
            cost = point["cpu_s"] / points["draft"]["cpu_s"]
            seen = None if point["error"] is None else abs(point["error"])
            kept = "no promise"
            if promise is not None and promise.error is not None:
                kept = "kept" if seen is not None and seen <= promise.error else "BROKEN"
                broken += kept == "BROKEN"
            asked = "none" if promise is None or promise.error is None else f"{100 * promise.error:.3g} %"
            told = "no error" if seen is None else f"{100 * seen:.3g} %"
            print(f"{stage.kind:10} {fidelity:10} promised {asked:>7}, seen {told}, cost {cost:.1f}: {kept}")
    return 1 if broken else 0


def _write(
    page: Path, folder: Path, studies: list[dict[str, Any]], found: dict[str, dict[str, Any]], left: list[str]
) -> None:
    commit = subprocess.run(
        ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True
    ).stdout
    lines = [
        "# What accuracy costs",
        "",
        f"Measured {datetime.date.today()} at commit {commit.strip() or '(none)'}, two runs at a time, on",
        f"{_machine()}. This page is written by `make tradeoffs`.",
        "",
        "```",
        "make tradeoffs            # every study below, from pipelines/tradeoffs/studies.toml",
        "make verify-promises      # those of fidelity, against the promises of the knob table",
        "```",
        "",
        "Errors are relative to the reference that each study names, with 95 % intervals where several",
        "seeds or the stage itself give them. CPU time is that of one run, its start included.",
        "[tradeoff](../manual/tradeoff.md) says how both are found.",
    ]
    images = page.parents[1] / "images" / "tradeoffs"
    images.mkdir(parents=True, exist_ok=True)
    for study in studies:
        said = found[study["name"]]
        (images / f"{study['name']}.png").write_bytes((folder / f"{study['name']}.png").read_bytes())
        lines += ["", f"## {study['name']}", "", *_about(study, said), "", *_table(said), ""]
        lines += [f"![{study['name']}](../images/tradeoffs/{study['name']}.png)"]
        if said["warnings"]:
            lines += ["", "```", *said["warnings"], "```"]
    if left:
        lines += ["", "## Not made here", "", *(f"- `{name}`" for name in left)]
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _about(study: dict[str, Any], said: dict[str, Any]) -> list[str]:
    seeds = study.get("seeds", 1)
    order = f", order {said['order']:.2g}" if said["order"] else ""
    settings = f", with `{'`, `'.join(study['set'])}`" if study.get("set") else ""
    return [
        f"`{study['scene']}`{settings}.",
        f"`{study['quantity']}`, {seeds} seed{'s' if seeds > 1 else ''};"
        f" reference {said['reference']:.5g}, {said['reference_from']}{order}.",
    ]


def _table(said: dict[str, Any]) -> list[str]:
    keys = list(said["points"][0]["knobs"])
    rows = ["| " + " | ".join([*keys, "value", "error", "95 % interval", "CPU time", "memory", "front"]) + " |"]
    rows.append("|" + "---|" * (len(keys) + 6))
    for p in said["points"]:
        ends = [p["error_low"], p["error_high"]]
        between = "" if None in ends else " to ".join(f"{100 * e:.2g} %" for e in ends)
        error = "" if p["error"] is None else f"{100 * p['error']:.2g} %"
        value = "none" if p["value"] is None else f"{p['value']:.5g}"
        cells = [*p["knobs"].values(), value, error, between, f"{p['cpu_s']:.3g} s"]
        rows.append("| " + " | ".join([*cells, f"{p['peak_memory_bytes'] / 1e6:.0f} MB", "x" * p["on_front"]]) + " |")
    return rows


def _machine() -> str:
    try:
        model = next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name"))
        return model.partition(":")[2].strip()
    except (OSError, StopIteration):
        return platform.machine()


if __name__ == "__main__":
    sys.exit(main())
