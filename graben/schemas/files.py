"""Whole files or none: written beside the target, then renamed; several appear together or not at all."""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from graben import interrupts
from graben.errors import MachineFailed


class _Parts(list[tuple[Path, Path]]):
    """Temporary paths and targets of files that wait to be renamed."""

    ends_run = False


# Places that were free when a run was allowed to write there.
_free: set[Path] = set()


def expect_free(paths: Iterable[Path], free: bool) -> None:
    """Note that nothing may be replaced at these places, or that it may."""
    places = {path.absolute() for path in paths}
    _free.difference_update(places)
    if free:
        _free.update(places)


_waiting: ContextVar[_Parts | None] = ContextVar("files that wait to be renamed", default=None)


@contextmanager
def whole_file(path: str | Path, *, ends_run: bool = False) -> Iterator[Path]:
    """Yield a temporary path in the target's folder; rename it to `path` on success, remove it on any error.

    The temporary path may become a folder. Within `together` the renaming waits for the end of that block. Signals
    wait until the file is written, for the libraries that write would leave a broken one.

    ends_run : once this file is in place the run is done, and signals are passed over

    Raises
    ------
    MachineFailed : the machine refused the writing or the renaming
    """
    path = Path(path)
    temporary = part_of(path)
    with together() as parts, machine(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        parts.append((temporary, path))
        parts.ends_run |= ends_run
        try:
            with interrupts.held():
                yield temporary
        except BaseException:
            parts.remove((temporary, path))
            with suppress(OSError):
                remove(temporary)
            raise


@contextmanager
def together() -> Iterator[_Parts]:
    """Files written within this block appear at its end, in their order, the last one as the seal of all.

    On any error none appears, and what they would have replaced is there as before.
    """
    outer = _waiting.get()
    if outer is not None:
        yield outer
        return
    parts = _Parts()
    token = _waiting.set(parts)
    try:
        yield parts
        with interrupts.held():
            if parts:
                _put_in_place(parts)
            if parts.ends_run:
                interrupts.complete()
    finally:
        _waiting.reset(token)
        for temporary, _ in parts:
            with suppress(OSError):
                remove(temporary)


@contextmanager
def machine(path: str | Path) -> Iterator[None]:
    """Turn what the operating system refuses within this block into MachineFailed, naming `path`."""
    try:
        yield
    except OSError as error:
        raise MachineFailed(str(path), _reason(Path(path), error)) from error


def _reason(path: Path, error: OSError) -> str:
    words = error.strerror or str(error)
    if error.errno in (None, 0, errno.ENOSPC, errno.EDQUOT, errno.EIO):
        with suppress(OSError):
            words += f"; {shutil.disk_usage(existing_folder(path)).free / 1e6:.3g} MB are free there"
    return words


def existing_folder(path: Path) -> Path:
    """The nearest folder above `path` that is there."""
    return next((p for p in path.absolute().parents if p.is_dir()), Path(path.anchor or "."))


def unfit(path: Path) -> str:
    """What a path should be where libraries could not open or name it; empty where they can."""
    if os.sep != "\\" and "\\" in str(path.absolute()):
        return "a path without backslashes, which NetCDF takes for slashes"
    if re.search("[\\x00-\\x1f\\x7f]", path.name):
        return "a name without control characters, which no XML holds"
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError:
        return "a path in UTF-8"
    return ""


def part_of(path: Path, process: int | None = None) -> Path:
    """The temporary path of a target; the suffix is kept last because writers choose the format by it."""
    return path.with_name(f".{path.name}.{process or os.getpid()}.part{path.suffix}")


def _old_of(path: Path, process: int | None = None) -> Path:
    """Where a target waits that is being replaced."""
    return path.with_name(f".{path.name}.{process or os.getpid()}.old")


def _put_in_place(parts: _Parts) -> None:
    """Rename all. The last renaming decides: before it everything can be taken back, after it the rest is tidying."""
    for _, target in parts:
        if target.absolute() in _free and os.path.lexists(target):
            raise MachineFailed(str(target), "another run has put its output there meanwhile")
    moved: list[tuple[Path, Path, Path]] = []
    seal = parts[-1][0]
    try:
        for temporary, target in parts:
            with machine(target):
                moved.append((temporary, target, _old_of(target)))
                # A file as the last one is replaced in one step, without a moment in which none is there.
                if os.path.lexists(target) and (temporary != seal or target.is_dir()):
                    os.replace(target, _old_of(target))
                os.replace(temporary, target)
    except BaseException:
        if os.path.lexists(seal) or len(moved) < len(parts):
            for temporary, target, old in reversed(moved):
                with suppress(OSError):
                    _take_back(temporary, target, old)
            raise
        _tidy(moved)
        raise
    _tidy(moved)
    expect_free([target for _, target in parts], False)


def _take_back(temporary: Path, target: Path, old: Path) -> None:
    if os.path.lexists(old):
        remove(target)
        os.replace(old, target)
    elif not os.path.lexists(temporary):
        remove(target)


def _tidy(moved: list[tuple[Path, Path, Path]]) -> None:
    for _, _, old in moved:
        with suppress(OSError):
            remove(old)


def remove(path: Path) -> None:
    """Remove a file or a folder, if there is one."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def recover(paths: Iterable[Path], seal: Path) -> None:
    """Clean up what killed runs left of these outputs; a half-done replacement is taken back.

    seal : the one that is renamed last
    """
    targets = [*paths, seal]
    for process in sorted({p for target in targets for p in _killed(target)}):
        complete = not os.path.lexists(part_of(seal, process))
        for target in targets:
            with suppress(OSError):
                old = _old_of(target, process)
                if not complete and os.path.lexists(old):
                    remove(target)
                    os.replace(old, target)
                remove(old)
                remove(part_of(target, process))


def _killed(path: Path) -> set[int]:
    """Processes that are no more and left parts of `path`."""
    pattern = re.compile(re.escape(f".{path.name}.") + r"(\d+)\.(?:old|part" + re.escape(path.suffix) + ")")
    try:
        names = os.listdir(path.parent)
    except OSError:
        return set()
    found = {int(m[1]) for m in map(pattern.fullmatch, names) if m}
    return {process for process in found if not _alive(process)}


def _alive(process: int) -> bool:
    if process == os.getpid():
        return False  # an earlier one of the same number: this run has not begun to write
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
