"""Several files appear together or not at all, whatever the machine refuses and whenever."""

import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from graben.errors import MachineFailed
from graben.schemas.files import together, whole_file
from tests.schemas.test_outputs import tree


def write(folder: Path, text: str) -> None:
    """A folder of two files, a file, and the file that seals them."""
    with together():
        with whole_file(folder / "a.vtu") as part:
            part.mkdir()
            for k in range(2):
                (part / f"{k}.vtu").write_text(text)
        for name in ("a.pvd", "a.nc"):
            with whole_file(folder / name) as part:
                part.write_text(text)


def test_nothing_is_seen_before_all_is_there(tmp_path):
    with together():
        with whole_file(tmp_path / "a") as part:
            part.write_text("1")
        assert not (tmp_path / "a").exists()
    assert tree(tmp_path) == {str(tmp_path / "a"): b"1"}


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt(), MemoryError()])
@pytest.mark.parametrize("call", ["replace", "mkdir", "open"])
@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("there", [False, True])
def test_an_error_at_any_moment_leaves_what_was_there(error, call, after, there, tmp_path, monkeypatch):
    if there:
        write(tmp_path, "old")
    before = tree(tmp_path)
    write(tmp_path, "new")
    new = tree(tmp_path)
    for moment in range(12):
        for name in list(tree(tmp_path)):
            Path(name).unlink() if Path(name).is_file() else None
        if (tmp_path / "a.vtu").is_dir():
            (tmp_path / "a.vtu").rmdir()
        if there:
            write(tmp_path, "old")
        left = moment
        holder, name = (os, "replace") if call == "replace" else (Path, call)
        plain = getattr(holder, name)

        def refuse(*arguments, plain=plain, **options):
            nonlocal left
            left -= 1
            if left == -1 and not after:
                raise error
            result = plain(*arguments, **options)
            if left == -1:
                if hasattr(result, "close"):
                    result.close()
                raise error
            return result

        with monkeypatch.context() as patch:
            patch.setattr(holder, name, refuse)
            try:
                write(tmp_path, "new")
                failed = False
            except (MachineFailed, KeyboardInterrupt, MemoryError):
                failed = True
        assert tree(tmp_path) in ((before, new) if failed else (new,))
        if not failed:
            return
    raise AssertionError("more moments than were tried")


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """The operating system refuses to let any file grow beyond `size` bytes."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


def test_a_file_that_the_machine_does_not_take_is_named(tmp_path):
    with files_of_at_most(1000), pytest.raises(MachineFailed, match=r"a\.vtu.*File too large"):
        write(tmp_path, "x" * 2000)
    assert tree(tmp_path) == {}


def test_a_folder_that_vanishes_is_made_again_and_one_that_cannot_be_is_named(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(MachineFailed, match=r"out/a\.nc"), whole_file(folder / "a.nc") as part:
        folder.rmdir()
        part.write_text("x")
    folder.write_text("a file now")
    with pytest.raises(MachineFailed, match=r"out/a\.nc"), whole_file(folder / "a.nc"):
        raise AssertionError
    folder.unlink()
    with whole_file(folder / "a.nc") as part:
        part.write_text("x")
    assert (folder / "a.nc").read_text() == "x"
