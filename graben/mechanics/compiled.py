"""`kernel`: numba's njit with a disk cache that notices edits in other files.

numba's own cache compares a function with its own source file only. A kernel that calls a law in another
file would keep running the old law after that file changed. Here the cache folder carries a digest of every
source a kernel can reach, so an edit leads to an empty folder and a fresh compilation, never to stale physics.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

_MECHANICS = Path(__file__).parent
# Rooms whose kernels are called from other rooms; every digest covers them.
_SHARED_ROOMS = ("materials",)


@cache
def _cache_folder(room: str) -> str:
    """Folder for the compiled kernels of one room of mechanics/, named after the digest of its sources."""
    digest = hashlib.sha256()
    rooms = sorted({*_SHARED_ROOMS, room})
    for path in sorted(p for r in rooms for p in (_MECHANICS / r).rglob("*.py")):
        digest.update(path.read_bytes())
    name = f"{room}-{digest.hexdigest()[:16]}"
    in_tree = _MECHANICS / "__pycache__" / "kernels" / name
    try:
        in_tree.mkdir(parents=True, exist_ok=True)
        if os.access(in_tree, os.W_OK):
            return str(in_tree)
    except OSError:
        pass  # a read-only installation: fall back to the user's cache
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    for candidate in (Path(base) / "graben" / name, Path(tempfile.gettempdir()) / "graben" / name):
        try:
            candidate.mkdir(parents=True, exist_ok=True)
            return str(candidate)
        except OSError:
            continue
    raise RuntimeError(f"no writable folder for compiled kernels (tried {in_tree} and {base})")


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Compile `function` in nopython mode with the cache described above; options are those of numba.njit.

    Functions compiled with and without ``parallel=True`` must have different names: the disk cache does not
    tell them apart.
    """
    if function is None:
        return lambda f: kernel(f, **options)
    room = Path(function.__code__.co_filename).resolve().relative_to(_MECHANICS).parts[0]
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = _cache_folder(room)
    try:
        return numba.njit(cache=True, **options)(function)
    finally:
        numba.config.CACHE_DIR = before
