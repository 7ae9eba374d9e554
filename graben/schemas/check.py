"""check(path): every fault of a scene or an artifact at once."""

from __future__ import annotations

from pathlib import Path

from graben.errors import BadInput, Fault
from graben.schemas.artifact import check_artifact
from graben.schemas.kinds import SCENES
from graben.schemas.scene import load_scene


def check(path: str | Path) -> list[Fault]:
    """Every fault of a scene (.toml) or an artifact (.nc); empty when there is none."""
    path = Path(path)
    if path.suffix == ".nc":
        return check_artifact(path)
    if path.suffix == ".toml":
        try:
            load_scene(path, tuple(SCENES))
        except BadInput as error:
            return error.faults
        return []
    return [Fault(str(path), "", "", "a scene (.toml) or an artifact (.nc)")]
