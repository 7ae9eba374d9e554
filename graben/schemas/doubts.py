"""Warnings of artifacts and material files: what a stage that reads them has to repeat."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from graben.errors import BadInput

_OF = "of "


def doubts_of(paths: Iterable[str | Path]) -> list[str]:
    """Warnings of the files among `paths` that have any, each with the name of the file that it began with.

    A file with faults has none here: who reads it tells them.
    """
    found: list[str] = []
    for path in map(Path, paths):
        with suppress(BadInput, OSError, ValueError, KeyError):
            texts = _of_artifact(path) if path.suffix == ".nc" else _of_material(path)
            found += [text if text.startswith(_OF) else f"{_OF}{path.name}: {text}" for text in texts]
    return list(dict.fromkeys(found))


def _of_artifact(path: Path) -> list[str]:
    from graben.schemas.artifact import open_artifact

    with open_artifact(path) as data:
        return str(data.attrs.get("warnings", "")).splitlines()


def _of_material(path: Path) -> list[str]:
    from graben.schemas.reading import read_toml

    if not path.name.endswith(".material.toml"):
        return []
    told = read_toml(path, "material file")[1].get("warnings", [])
    return [text for text in told if isinstance(text, str)] if isinstance(told, list) else []
