"""Compiled kernels on disk: one file for each kernel and signature, in a folder that nobody else can write.

They lie in the user's cache folder: installations share them whose sources, Python, numba, llvmlite, numpy and CPU
agree. All these are in the key of a kernel, and no path is.

What cannot be read (torn, damaged, not the user's own) is compiled anew and written again. Files appear whole, under
names that follow from their contents' key, so processes may write side by side.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import stat
import sys
import uuid
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core import compiler
from numba.core.caching import _Cache
from numba.core.serialize import dumps

_log = logging.getLogger(__name__)
_PYTHON = f"{sys.implementation.cache_tag}{getattr(sys, 'abiflags', '')}"
_VERSIONS = f"{_PYTHON} {numba.__version__} {llvmlite.__version__} {np.__version__}"
# Settings of numba, of variables of the environment, that change the code that it makes.
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT", "USING_SVML")
_DIGEST = hashlib.sha256().digest_size

used: dict[str, bool] = {}
"""Kernels of this process by the name of their file: True where they were compiled here, not read."""


class KernelCache(_Cache):
    """What numba asks for compiled code of one function; key: what the code depends on beside its signature."""

    def __init__(self, function: Callable[..., Any], key: str) -> None:
        code = function.__code__
        name = f"{function.__module__.rpartition('.mechanics.')[2]}.{function.__qualname__}"
        self._name = "".join(c if c.isalnum() or c in "._" else "-" for c in name)
        closed = dumps(tuple(cell.cell_contents for cell in function.__closure__ or ()))
        self._key = f"{_VERSIONS} {name} {code.co_firstlineno} {key} {hashlib.sha256(closed).hexdigest()}"
        self._on = True

    @property
    def cache_path(self) -> str:
        return str(folder() or "")

    def enable(self) -> None:
        self._on = True

    def disable(self) -> None:
        self._on = False

    def flush(self) -> None:
        """Nothing to forget: `recompile` ends in files of the same names."""

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        target_context.refresh()
        place, key = self._place(signature, target_context.codegen())
        if place is None:
            return None
        try:
            stored = _read(place)
            found, payload = pickle.loads(stored)
            if found != key:
                return None
            result = compiler.CompileResult._rebuild(target_context, *payload)
            used.setdefault(place.name, False)
            return result
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever a damaged file can raise: it is written anew
            _log.info("compiled kernel %s is not readable (%s): compiled anew", place, error)
            return None

    def save_overload(self, signature: Any, result: Any) -> None:
        place, key = self._place(signature, result.codegen)
        if (
            place is None
            or result.library.has_dynamic_globals
            or any(not lifted.can_cache for lifted in result.lifted)
        ):
            return
        used[place.name] = True
        content = dumps((key, result._reduce()))
        beside = place.with_name(f"{place.name}.{uuid.uuid4().hex[:12]}.part")
        try:
            try:
                beside.touch(mode=0o600)
                beside.write_bytes(hashlib.sha256(content).digest() + content)
                os.replace(beside, place)
            finally:
                beside.unlink(missing_ok=True)
        except OSError as error:
            _say_once(f"compiled kernels are not kept in {place.parent} ({error.strerror})")

    def _place(self, signature: Any, codegen: Any) -> tuple[Path | None, str]:
        """File of one signature, and the text that it must hold; None without a folder."""
        where = folder()
        if where is None or not self._on:
            return None, ""
        settings = [getattr(numba.config, name, None) for name in _SETTINGS]
        key = f"{self._key} {signature!r} {codegen.magic_tuple()} {settings}"
        return where / f"{self._name}-{hashlib.sha256(key.encode()).hexdigest()[:24]}.nbc", key


def _read(path: Path) -> bytes:
    """What was written, if it is the user's own and whole; unpickling anything else would run it."""
    with open(path, "rb") as stream:
        if not _own(os.fstat(stream.fileno())):
            raise PermissionError("others can write it")
        data = stream.read()
    if hashlib.sha256(data[_DIGEST:]).digest() != data[:_DIGEST]:
        raise ValueError("it is damaged")
    return data[_DIGEST:]


@cache
def folder() -> Path | None:
    """Where compiled kernels are kept: in the user's cache folder, otherwise beside the sources where these are the
    user's own; None, said once, where neither is the user's own and closed to others."""
    sources = Path(__file__).parent
    tried = [_user_cache()]
    if _private(sources):
        tried.append(sources / "__pycache__")
    for place in tried:
        if place is None:
            continue
        try:
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            kernels = place / "kernels"
            kernels.mkdir(mode=0o700, exist_ok=True)
        except OSError:
            continue
        if _private(place) and _private(kernels):
            return kernels
    places = " and ".join(str(place) for place in tried if place is not None)
    _say_once(f"compiled kernels are not kept: no folder is yours to write and closed to others (tried {places})")
    return None


def _user_cache() -> Path | None:
    """The user's cache folder of graben; None where the user has no home."""
    try:
        home = Path.home()
    except RuntimeError:
        home = None
    given = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(given):
        return Path(given) / "graben"
    if home is None:
        return None
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "graben"
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local")) / "graben"
    return home / ".cache" / "graben"


def _private(place: Path) -> bool:
    """Whether a folder is the user's own, writable, and closed to the writing of others."""
    try:
        return _own(place.stat()) and os.access(place, os.W_OK | os.X_OK)
    except OSError:
        return False


def _own(status: os.stat_result) -> bool:
    """Whether only the user can write it. Windows keeps each user's folders to that user."""
    if not hasattr(os, "geteuid"):
        return True
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@cache
def _say_once(text: str) -> None:
    _log.warning(text)
