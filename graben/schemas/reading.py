"""Files that a user names, read as text: a regular file of bounded size in UTF-8, or BadInput at once."""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from graben.errors import BadInput, Fault

MiB = 2**20
_SCENE_BYTES = MiB  # a scene or a material file; larger data belong in the files that a scene names
_DATA_BYTES = 1024 * MiB  # a map, or curves

# tomllib takes time that grows with the square of a dotted key's length.
_LONG_KEY = re.compile(r"""(?<![\w"'-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){16}""", re.ASCII)


def read_bytes(path: str | Path, what: str, most: int = _DATA_BYTES) -> bytes:
    """The bytes of a regular file of at most `most` bytes.

    Parameters
    ----------
    path : as the user named it
    what : what is expected there, such as "scene file"
    most : largest size

    Raises
    ------
    BadInput : absent, a folder, a pipe or a device, unreadable, or too large
    """
    try:
        about = os.stat(path)
        if not stat.S_ISREG(about.st_mode):  # a pipe would block, a device may have no end
            found = "a folder" if stat.S_ISDIR(about.st_mode) else "a pipe or a device"
            raise BadInput(Fault(str(path), "", "", f"a {what}, not {found}"))
        if about.st_size > most:
            raise BadInput(Fault(str(path), "", "", f"a {what} of at most {most // MiB} MiB"))
        with open(path, "rb") as stream:
            return stream.read(most)
    except FileNotFoundError:
        raise BadInput(Fault(str(path), "", "", f"an existing {what}")) from None
    except BadInput:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name with a null byte
        raise BadInput(Fault(str(path), "", "", f"a readable {what} ({error})")) from None


def read_text(path: str | Path, what: str, most: int = _DATA_BYTES) -> str:
    """The text of a file in UTF-8, without a byte order mark; errors as in `read_bytes`."""
    content = read_bytes(path, what, most)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        hint = "; it seems to be UTF-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else ""
        raise BadInput(
            Fault(str(path), "", "", f"a {what} in UTF-8 ({error.reason} at byte {error.start}{hint})")
        ) from None
    if "\0" in text:
        raise BadInput(Fault(str(path), "", "", f"a {what} without null bytes"))
    return text


def read_toml(path: str | Path, what: str) -> tuple[str, dict[str, Any]]:
    """Text and tables of a TOML file; errors as in `read_text`, and where it is no TOML."""
    text = read_text(path, what, _SCENE_BYTES)
    try:
        return text, parse_toml(text)
    except ValueError as error:
        raise BadInput(Fault(str(path), "", "", f"valid TOML ({error})")) from None


def parse_toml(text: str) -> dict[str, Any]:
    """Tables of TOML text; ValueError says what is wrong, with line and column where that is known."""
    if _LONG_KEY.search(text):
        raise ValueError("a dotted key of more than 16 parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def read_json(path: str | Path, what: str) -> Any:
    """Content of a JSON file; errors as in `read_text`, and where it is no JSON or holds nan or infinity."""

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is no number")

    text = read_text(path, what)
    try:
        return json.loads(text, parse_constant=refuse)
    except RecursionError:
        raise BadInput(Fault(str(path), "", "", f"a {what} nested less deeply")) from None
    except ValueError as error:
        raise BadInput(Fault(str(path), "", "", f"valid JSON ({error})")) from None
