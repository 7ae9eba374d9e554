"""Scenes in Python: checked models from files, tables or a kind's defaults, and every fault of them."""

from __future__ import annotations

import builtins
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from graben.errors import Fault
from graben.schemas.kinds import SCENES
from graben.schemas.scene import Given, load_scene


def scene(given: Given, set: Mapping[str, Any] | None = None, **keys: Any) -> Any:
    """A checked scene.

    Parameters
    ----------
    given : a kind ("blocks", "particles", "rev-study", "calibrate", "fem", "scratch", "wear") for its defaults, a
        TOML file, tables with the same keys as TOML, or a scene. Quantities are text with a unit, such as "4 m".
        Paths in tables are relative to the working directory
    set : values that replace keys, by dotted name: ``{"numerics.steps": 1000}``
    keys : the same for keys at the top: ``seed=3``

    Returns
    -------
    a model whose fields are in SI; ``.source.effective_text`` is its TOML

    Raises
    ------
    BadInput : every fault at once
    """
    if isinstance(given, str) and given in SCENES:
        given = {"kind": given}
    return load_scene(given, tuple(SCENES), {**(set or {}), **keys})


def check(given: Given, set: Mapping[str, Any] | None = None, **keys: Any) -> list[Fault]:
    """Every fault that a stage would find before its work; an empty list where there is none.

    Parameters
    ----------
    given : as in `scene`, or a material file (.material.toml) or an artifact (.nc)
    set, keys : as in `scene`; not for files of materials and artifacts
    """
    from graben.errors import BadInput
    from graben.stages.tools.check import check as check_file

    if isinstance(given, str | Path) and str(given).endswith((".material.toml", ".nc")):
        return check_file(given)
    try:
        return check_file(scene(given, set, **keys))
    except BadInput as error:
        return builtins.list(error.faults)
