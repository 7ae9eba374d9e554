"""Tables as TOML text that reads back to the same values."""

from __future__ import annotations

import enum
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from graben.errors import Refused


def toml_text(tables: Mapping[str, Any], prefix: str = "") -> str:
    """A document: plain keys first, then a section for each table; keys that are None are left out."""
    plain = {k: v for k, v in tables.items() if v is not None and not isinstance(v, Mapping)}
    text = "".join(f"{_key(k)} = {toml_value(v)}\n" for k, v in plain.items())
    for name, table in tables.items():
        if isinstance(table, Mapping):
            whole = prefix + _key(name)
            text += f"\n[{whole}]\n" + toml_text(table, whole + ".")
    return text


def toml_value(value: Any) -> str:
    """One value in one line. Refused where TOML knows no such value."""
    if hasattr(value, "tolist"):
        value = value.tolist()  # numbers and arrays of numpy
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, enum.Enum):
        return toml_value(value.value)
    if isinstance(value, str | Path):
        return _text(str(value))
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, BaseModel):
        value = value.model_dump()
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {toml_value(v)}" for k, v in value.items() if v is not None) + " }"
    raise Refused(f"text, numbers, true or false, lists and tables, not {type(value).__name__}")


def _key(name: Any) -> str:
    if not isinstance(name, str):
        raise Refused(f"keys that are text, not {name!r}")
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(text: str) -> str:
    try:
        text.encode()
    except UnicodeEncodeError:
        raise Refused(f"text in Unicode, not {text!r}") from None
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
