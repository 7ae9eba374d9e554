"""Fields that a scene asks for by `output.fields`: those of VTU files, and of artifacts where they end there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

Array = TypeVar("Array")


def kept(asked: Sequence[str] | None, arrays: Mapping[str, Array], spare: Mapping[str, str]) -> dict[str, Array]:
    """Arrays of an artifact, without those of fields that nobody asked for.

    asked : names of fields; None: all
    spare : variables that no later stage needs, and the field that each of them is
    """
    if asked is None:
        return dict(arrays)
    return {name: array for name, array in arrays.items() if name not in spare or spare[name] in asked}
