"""The marks of an artifact beside its data: global attributes of known types, a digest of all that it holds, a seal.

The seal is the digest of the file's bytes, put after their end, where HDF5 does not look. Without it damaged bytes
would get into the HDF5 library, which some of them crash.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

DIGEST = "content_sha256"

_SEAL = b"graben sha256 seal\n"
_LENGTH = len(_SEAL) + hashlib.sha256().digest_size

_TEXTS = ("title", "software", "software_version", "machine", "scene", "scene_sha256", "inputs", "cost")
_TEXTS_IF_ANY = ("warnings", "partial")


def seal(path: Path) -> None:
    """Put the seal at the end of a file that is written."""
    digest = hashlib.sha256()
    with open(path, "rb+") as stream:
        while part := stream.read(1 << 20):
            digest.update(part)
        stream.write(_SEAL + digest.digest())


def seal_broken(path: Path) -> bool:
    """Whether a file has a seal that is not that of its bytes; files of other programs have none."""
    left = path.stat().st_size - _LENGTH
    if left < 0:
        return False
    digest = hashlib.sha256()
    with open(path, "rb") as stream:
        stream.seek(left)
        end = stream.read(_LENGTH)
        if not end.startswith(_SEAL):
            return False
        stream.seek(0)
        while left > 0 and (part := stream.read(min(left, 1 << 20))):
            digest.update(part)
            left -= len(part)
    return digest.digest() != end[len(_SEAL) :]


def content_digest(attributes: Mapping[str, Any], variables: Mapping[Any, Any]) -> str:
    """SHA-256 of attributes and values, the same before writing (arrays) and after reading (variables of a file)."""
    total = hashlib.sha256()
    for name, value in sorted(attributes.items()):
        if name != DIGEST:
            total.update(f"{name} {_plain(value)!r}\n".encode())
    for name in sorted(map(str, variables)):
        values = np.asarray(variables[name])
        total.update(f"{name} {values.shape}\n".encode())
        if values.dtype.kind in "SUO":
            total.update("\0".join(map(str, values.ravel())).encode())
        else:
            # Text of the kind, not of the byte order; nan has many bit patterns, of which reading keeps one.
            values = np.where(np.isnan(values), np.nan, values) if values.dtype.kind == "f" else values
            total.update(np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes())
    return total.hexdigest()


def attribute_faults(attributes: Mapping[str, Any], declared: Mapping[str, type]) -> Iterator[tuple[str, str, str]]:
    """(name, value, expected) of every global attribute that is missing or cannot be read as what it is.

    declared : those that only artifacts of this kind have, by type
    """
    wanted: dict[str, type] = {**dict.fromkeys(_TEXTS, str), "seed": int, **declared}
    wanted |= {name: str for name in _TEXTS_IF_ANY if name in attributes}
    for name, kind in wanted.items():
        value = _plain(attributes[name]) if name in attributes else None
        if value is None:
            yield name, "(absent)", f"an attribute of type {kind.__name__}"
        elif not isinstance(value, (int, float) if kind is float else kind) or isinstance(value, bool):
            yield name, repr(value)[:60], f"an attribute of type {kind.__name__}"
        elif name in ("inputs", "cost"):
            try:
                fits = isinstance(json.loads(str(value)), dict)
            except (ValueError, RecursionError):
                fits = False
            if not fits:
                yield name, repr(value)[:60], "a JSON object"
    scene, digest = attributes.get("scene"), attributes.get("scene_sha256")
    texts = isinstance(scene, str) and isinstance(digest, str)
    if texts and hashlib.sha256(str(scene).encode(errors="replace")).hexdigest() != digest:
        yield "scene_sha256", str(digest)[:12], "the digest of the attribute scene"


def _plain(value: Any) -> Any:
    """An attribute as Python has it: libraries give numbers as arrays of one."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
