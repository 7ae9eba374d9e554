"""Files from which a stopped run goes on: plain arrays with a checksum, read whole or refused.

Nothing in them is unpickled. A file that does not carry the digest of its contents is refused before anything in it
is used, so that no damaged index gets into compiled code.
"""

from __future__ import annotations

import hashlib
import io
import logging
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, MachineFailed
from graben.schemas.files import whole_file

Arrays = dict[str, np.ndarray]

_DIGEST = "sha256"


def write_saved(path: Path, owner: Mapping[str, str], arrays: Mapping[str, Any]) -> bool:
    """Write arrays (numbers or text) by name; owner: what they belong to, by the names of its marks.

    False, with a warning, where the machine refuses: the run itself may still come to its end.
    """
    stored = {name: np.asarray(values) for name, values in {**owner, **arrays}.items()}
    try:
        with whole_file(path) as temporary:
            # By way of memory: the archive of a file that is too large complains on stderr when it is forgotten.
            archive = io.BytesIO()
            np.savez(archive, **stored, **{_DIGEST: np.array(_digest(stored))})  # type: ignore[arg-type]
            archive.seek(0)
            # By copy: an error would hold a view of that memory, and Python 3.12.1 crashes where it lets go of one.
            with temporary.open("wb") as file:
                shutil.copyfileobj(archive, file)
    except MachineFailed as error:
        logging.getLogger(__name__).warning("no state is kept: %s", error)
        return False
    return True


def read_saved(path: Path, owner: Mapping[str, str], expected: str) -> Arrays:
    """The arrays of a file of `write_saved`.

    Parameters
    ----------
    owner : the marks that the file must bear; expected: in words, for a file with other marks

    Raises
    ------
    BadInput : not readable, damaged, or of another owner
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            stored = {name: data[name] for name in data.files}
        found = str(stored.pop(_DIGEST, "(absent)"))
        damaged = found != _digest(stored)
    except Exception as error:  # whatever damaged bytes make of the readers of zip, zlib and npy
        raise BadInput(Fault(str(path), "restart", "", f"a whole file of saved states ({error})", True)) from None
    if damaged:
        raise BadInput(Fault(str(path), _DIGEST, found[:12], "the digest of the file's contents; it is damaged"))
    others = [
        Fault(str(path), "restart", f"a file of another {name}", expected, True)
        for name, mark in owner.items()
        if str(stored.pop(name, "")) != mark
    ]
    if others:
        raise BadInput(others)
    return stored


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        total.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        total.update(array.tobytes())
    return total.hexdigest()
