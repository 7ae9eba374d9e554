"""Whole files or none: write beside the target, then rename."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from graben.errors import BadInput, Fault


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path in the target's folder; rename it to `path` on success, remove it on any error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The suffix is kept last because writers choose the format by it.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def refuse_existing(path: str | Path, overwrite: bool) -> None:
    """Raise BadInput where the output exists and may not be replaced, or where its place cannot hold a file."""
    path = Path(path)
    if path.is_dir():
        raise BadInput(Fault(str(path), "", "", "a file name for the output, not a folder"))
    if path.exists() and not overwrite:
        raise BadInput(Fault(str(path), "", "", "an output that does not exist yet (or --overwrite)"))
