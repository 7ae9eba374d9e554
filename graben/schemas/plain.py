"""Results as JSON and people take them: plain numbers and texts, and nothing where there is no number."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from graben.schemas.files import whole_file


def plain(value: Any) -> Any:
    """The same value of what JSON knows, at any depth; None for nan and infinity."""
    if hasattr(value, "tolist"):
        value = value.tolist()  # numbers and arrays of numpy
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    return str(value) if isinstance(value, Path) else value


def to_json(value: Any, **options: Any) -> str:
    """JSON text of `plain(value)`, which holds no NaN."""
    return json.dumps(plain(value), allow_nan=False, **options)


def write_json(path: Path, value: Any, **options: Any) -> None:
    """Write `to_json(value)` as a whole file or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(to_json(value, **options) + "\n", encoding="utf-8")
