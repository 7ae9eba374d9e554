"""How fast this machine is, against the one on which costs were measured. Found once, in a second, and kept."""

from __future__ import annotations

import json
import os
import platform
import time
from pathlib import Path

import numpy as np

from graben.declared.costs import YARDSTICK_S
from graben.mechanics import kernel_cache

_FILE = "machine.json"
_VERSION = 2  # of the yardstick, and of what it is held against
_TRIES = 5


def slowness() -> float:
    """CPU time here over CPU time there, for the same work."""
    kernels = kernel_cache.folder()
    path = None if kernels is None else kernels.parent / _FILE
    name = _name()
    kept = _read(path)
    if name not in kept:
        kept[name] = yardstick() / YARDSTICK_S
        _keep(path, kept)
    return kept[name]


def yardstick() -> float:
    """Least CPU time [s] of a fixed work: a sparse factorisation, gathers, and arithmetic on arrays."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    side = 150
    n = side * side
    laplace = diags([4.0, -1.0, -1.0, -1.0, -1.0], [0, 1, -1, side, -side], shape=(n, n), format="csc")
    order = np.random.default_rng(0).permutation(n)
    times = []
    for _ in range(_TRIES):
        begun = time.process_time()
        found = splu(laplace).solve(np.ones(n))
        for _ in range(200):
            found = np.sqrt(1.0 + found[order] ** 2) - 0.5
        times.append(time.process_time() - begun)
    return min(times)


def _name() -> str:
    return f"{_VERSION} {platform.node()} {platform.machine()} {os.cpu_count()} {platform.python_version()}"


def _read(path: Path | None) -> dict[str, float]:
    try:
        found = json.loads(path.read_text(encoding="utf-8")) if path is not None else {}
    except (OSError, ValueError):
        return {}
    if not isinstance(found, dict):
        return {}
    return {k: float(v) for k, v in found.items() if isinstance(v, int | float) and 0.0 < v < 1e3}


def _keep(path: Path | None, found: dict[str, float]) -> None:
    """Nothing ends because it cannot be kept: it is found again."""
    if path is None:
        return
    part = path.with_name(f"{_FILE}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(json.dumps(found), encoding="utf-8")
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
