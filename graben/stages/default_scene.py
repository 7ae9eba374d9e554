"""A scene of a kind's own defaults, for commands that can do without a file."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from graben.schemas.scene import Source, load_scene


def default_scene(kind: str, overrides: Iterable[str] = ()) -> Any:
    """The scene ``kind = "..."`` with nothing else set but the overrides.

    Raises
    ------
    BadInput : faults of the overrides
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "defaults.toml"
        path.write_text(f'kind = "{kind}"\n', encoding="utf-8")
        scene = load_scene(path, kind, overrides)
    scene._source = Source(Path(f"(defaults of {kind})"), scene.source.text, scene.source.overrides)
    return scene
