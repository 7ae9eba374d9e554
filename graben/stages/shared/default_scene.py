"""A scene of a kind's own defaults, for commands that can do without a file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from graben.schemas.scene import load_scene


def default_scene(kind: str, overrides: Iterable[str] = ()) -> Any:
    """The scene ``kind = "..."`` with nothing else set but the overrides.

    Raises
    ------
    BadInput : faults of the overrides
    """
    return load_scene({"kind": kind}, kind, overrides, name=Path(f"(defaults of {kind})"))
