"""The tests in every setting that must not matter: order, distribution, threads, processor, load, Python, versions.

    python tests/matrix.py            # all rows, five minutes each; passed ones are not repeated
    python tests/matrix.py lowest py3.13

Environments lie in .matrix/, results in results/matrix.jsonl. Exit code 1 where a row failed.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOME = ROOT / ".matrix"
RESULTS = ROOT / "results" / "matrix.jsonl"
HUNG_S = 3600.0
TWO = ("-n", "2", "--dist", "loadfile")


@dataclass(frozen=True)
class Row:
    """python: version, "" for this one. install: arguments of `uv pip install`. load: busy processes beside."""

    seed: int = 1
    options: tuple[str, ...] = TWO
    python: str = ""
    install: tuple[str, ...] = ("--constraint", "constraints.txt")
    variables: dict[str, str] = field(default_factory=dict)
    load: int = 0


_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
ROWS = {
    "order-1": Row(seed=1),
    "order-2": Row(seed=2),
    "order-3": Row(seed=3),
    "load": Row(seed=4, options=("-n", "2", "--dist", "load")),
    "serial": Row(seed=5, options=()),
    "haswell": Row(seed=6, variables={"OPENBLAS_CORETYPE": "Haswell"}),
    "any-core": Row(seed=7, variables={"OPENBLAS_CORETYPE": "", "OPENBLAS_L2_SIZE": ""}),
    "threads-1": Row(seed=8, variables=_ONE_THREAD),
    "threads-2": Row(seed=9, variables=dict.fromkeys(_ONE_THREAD, "2")),
    "alone": Row(seed=15, options=(*TWO, "-p", "tests.alone")),
    "busy": Row(seed=10, load=6),
    "py3.12": Row(seed=11, python="3.12"),
    "py3.13": Row(seed=12, python="3.13"),
    "lowest": Row(seed=13, install=("--resolution", "lowest-direct")),
    "newest": Row(seed=14, python="3.13", install=("--upgrade",)),
}


def main() -> int:
    names = sys.argv[1:] or list(ROWS)
    unknown = [n for n in names if n not in ROWS]
    if unknown:
        print(f"no row {unknown[0]!r}; there are {', '.join(ROWS)}", file=sys.stderr)
        return 2
    commit = _said("git", "rev-parse", "HEAD") + ("+" if _said("git", "status", "--porcelain") else "")
    RESULTS.parent.mkdir(exist_ok=True)
    before = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    done = {r["row"]: r for r in before if r["commit"] == commit and r["passed"] and not commit.endswith("+")}
    for name in names:
        if name not in done:
            done[name] = {"row": name, "commit": commit, **_run(name, ROWS[name])}
            with RESULTS.open("a") as file:
                file.write(json.dumps(done[name]) + "\n")
        result = done[name]
        print(
            f"{name:10} {'passed' if result['passed'] else 'FAILED'} {result['minutes']:5.1f} min  {result['said']}",
            flush=True,
        )
    return 0 if all(done[n]["passed"] for n in names) else 1


def _run(name: str, row: Row) -> dict[str, object]:
    python = _environment(name, row)
    if python is None:
        return {"passed": False, "minutes": 0.0, "said": f"no Python {row.python} on this machine"}
    # A cold start: kernels of another row, compiled on the same machine, would hide what this one compiles.
    cache = HOME / "cache" / name
    shutil.rmtree(cache, ignore_errors=True)
    environment = (
        os.environ | row.variables | {"XDG_CACHE_HOME": str(cache), "PATH": f"{python.parent}:{os.environ['PATH']}"}
    )
    environment = {k: v for k, v in environment.items() if v}
    call = [
        python,
        "-m",
        "pytest",
        "-vv",
        "--tb=short",
        "-m",
        "not verify",
        f"--randomly-seed={row.seed}",
        *row.options,
    ]
    log = HOME / f"{name}.log"
    log.parent.mkdir(exist_ok=True)
    busy = [subprocess.Popen([python, "-c", "while True: pass"]) for _ in range(row.load)]
    begun = time.monotonic()
    try:
        with log.open("w") as file:
            code = subprocess.run(call, cwd=ROOT, env=environment, stdout=file, stderr=subprocess.STDOUT,
                                  timeout=HUNG_S).returncode  # fmt: skip
    except subprocess.TimeoutExpired:
        code = -1
    finally:
        for process in busy:
            process.kill()
    said = [line for line in log.read_text().splitlines() if re.search(r"\d (passed|failed|error)", line)]
    minutes = (time.monotonic() - begun) / 60
    return {"passed": code == 0, "minutes": minutes, "said": (said or [f"see {log}"])[-1]}


def _environment(name: str, row: Row) -> Path | None:
    """Python of the row's environment, made anew; that of this script where the row asks for nothing of its own."""
    if not row.python and row.install == Row.install:
        return Path(sys.executable)
    folder = HOME / name
    version = row.python or f"{sys.version_info.major}.{sys.version_info.minor}"
    base = _python(version)
    if base is None:
        return None
    shutil.rmtree(folder, ignore_errors=True)
    subprocess.run([base, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    uv = [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python]
    subprocess.run([*uv, *row.install, "--editable", ".[dev]"], cwd=ROOT, check=True)
    return python


def _python(version: str) -> str | None:
    """An interpreter of the version: on the path, or one of pyenv's."""
    if sys.version_info[:2] == tuple(map(int, version.split("."))):
        return sys.executable
    found = shutil.which(f"python{version}")
    if found and subprocess.run([found, "--version"], capture_output=True).returncode == 0:
        return found
    kept = sorted((Path.home() / ".pyenv" / "versions").glob(f"{version}.*/bin/python"))
    return str(kept[-1]) if kept else None


def _said(*call: str) -> str:
    return subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
