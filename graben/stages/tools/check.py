"""What `graben check` finds: each stage's own checks before its work, and what readers of an artifact look at."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from graben.errors import BadInput, Fault, Incomplete
from graben.schemas.artifact import PARTIAL, check_artifact, open_artifact
from graben.schemas.kinds import SCENES
from graben.schemas.scene import Given, load_scene

# Kind of scene -> the stage whose prepare(scene) makes every check before its work.
_STAGES = {
    "blocks": "blocks",
    "particles": "particles",
    "rev-study": "rev_study",
    "calibrate": "calibrate",
    "fem": "fem_run",
    "scratch": "scratch",
    "wear": "wear_estimate",
}


def check(given: Given) -> list[Fault]:
    """Every fault of a scene, of a material file (.toml) or of an artifact (.nc); empty when there is none."""
    return examine(given)[0]


def examine(given: Given) -> tuple[list[Fault], list[Fault]]:
    """Faults of a scene or a file, and what its stage needs beside it in the call."""
    try:
        if not isinstance(given, str | Path):
            _scene(given)
            return [], []
        path = Path(given)
        if path.suffix == ".nc":
            return _artifact(path), []
        if path.suffix != ".toml":
            return [Fault(str(path), "", "", "a scene or material file (.toml) or an artifact (.nc)")], []
        _toml(path)
    except Incomplete as error:
        return [], error.faults
    except BadInput as error:
        return error.faults, []
    return [], []


def _toml(path: Path) -> None:
    if path.name.endswith(".material.toml"):
        from graben.stages.shared.material import pack_material

        pack_material(path, path)
        return
    _scene(path)


def _scene(given: Given) -> None:
    scene = load_scene(given, tuple(SCENES))
    import_module(f"graben.stages.{_STAGES[scene.kind]}.stage").prepare(scene)


def _artifact(path: Path) -> list[Fault]:
    """Faults by the layout; where there are none, those that readers of the kind find in what it means."""
    faults = check_artifact(path)
    if not faults:
        with open_artifact(path) as data:
            kind, stopped = data.attrs["schema_kind"], PARTIAL in data.attrs
        if not stopped:
            _READERS.get(kind, lambda path: None)(path)
    return faults


def _blocks(path: Path) -> None:
    from graben.stages.blocks.history import read_run

    read_run(path)


def _material(path: Path) -> None:
    from graben.stages.shared.material import pack_material

    pack_material(path, path)


_READERS: dict[str, Callable[[Path], Any]] = {"blocks": _blocks, "calibration": _material}
