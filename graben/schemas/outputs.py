"""Every path that a run will write, derived once from the name of its artifact and checked before the run."""

from __future__ import annotations

import os
import re
import stat
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graben.errors import BadInput, Fault
from graben.schemas.artifact_marks import seal_broken
from graben.schemas.files import existing_folder, expect_free, machine, part_of, recover, unfit

# What is beside an artifact NAME.nc, by the end of its name.
FOLDER, PVD, MATERIAL = ".vtu", ".pvd", ".material.toml"
CHECKPOINT, STATE, PARTIAL, LAST_GOOD = ".checkpoint.npz", ".state.npz", ".partial.nc", ".last-good"

SERIES = (FOLDER, PVD)
PICTURES = (".png", ".pdf", ".svg")

_ROOM = 100_000  # bytes that must be free before a run starts
_RESERVED = (".partial", LAST_GOOD)


def name_of(output: Path) -> str:
    """NAME of an output: its file name without a final ".nc", otherwise whole."""
    return output.name.removesuffix(".nc") or output.name


def beside(output: Path, end: str) -> Path:
    """NAME + end in the folder of the output."""
    return output.parent / (name_of(output) + end)


@dataclass(frozen=True)
class Outputs:
    """The paths of one run.

    Attributes
    ----------
    main : the artifact, picture or page; it is put in place last
    ends : of the names of what is written beside it
    kept : the same, of what a run that is stopped or fails leaves behind
    others : pictures, named by the user
    """

    main: Path
    ends: tuple[str, ...] = ()
    kept: tuple[str, ...] = (PARTIAL,)
    others: tuple[Path, ...] = ()

    def paths(self) -> list[Path]:
        """All of them, the main one first."""
        return [self.main, *(beside(self.main, end) for end in (*self.ends, *self.kept)), *self.others]

    def claim(self, inputs: Iterable[Path | None], *, overwrite: bool = False, restart: bool = False) -> None:
        """Check that every output may and can be written; clean up what a killed run left of them.

        Parameters
        ----------
        inputs : what the run reads, which must outlive it; None counts for nothing
        overwrite : what graben wrote earlier may be replaced
        restart : what a stopped run kept may be replaced

        Raises
        ------
        BadInput : every output that lies on an input or on another output, that exists and may not be replaced, or
            that is no name for a regular file
        MachineFailed : a folder that cannot be written, or a full disk
        """
        if self.main.name in ("", ".."):
            raise BadInput(Fault(str(self.main), "", "", "a file name for the output, not a folder"))
        with machine(self.main):  # a working folder that is gone
            self._claim(inputs, overwrite, restart)

    def _claim(self, inputs: Iterable[Path | None], overwrite: bool, restart: bool) -> None:
        paths, kept = self.paths(), {beside(self.main, end) for end in self.kept}
        recover(paths[1:], self.main)
        faults = list(self._clashes([p for p in inputs if p is not None]))
        taken = {Path(f.file) for f in faults}
        for path in paths:
            # What a restart reads is judged, and named, where it is read.
            if path not in taken and not (restart and path in kept and path.is_file()):
                faults += self._faults_of(path, overwrite or (restart and path in kept), path in kept)
        faults += self._twin() if not faults else []
        faults += [f for p in paths for f in _misplaced(p)] if not faults else []
        faults += [f for p in (self.main, *self.others) for f in _among_fields(p)] if not faults else []
        if faults:
            raise BadInput(faults)
        expect_free([p for p in paths if p not in kept], not overwrite)
        for path in {p.parent.absolute(): p for p in reversed(paths)}.values():
            _try_to_write(path)

    def _clashes(self, inputs: list[Path]) -> Iterator[Fault]:
        paths = self.paths()
        for k, path in enumerate(paths):
            for other in inputs:
                if _same(path, other) or _within(other, path):
                    yield Fault(str(path), "", "", f"another name: the run would write over its input {other}")
                    break
            else:
                earlier = [p for p in paths[:k] if _same(path, p) or _within(path, p) or _within(p, path)]
                if earlier:
                    yield Fault(str(path), "", "", f"another name than that of the output {earlier[0]}")
        for path in self.others:
            if path.suffix not in PICTURES:
                yield Fault(str(path), "", "", "a picture name ending in " + ", ".join(PICTURES))
        if self.kept and unfit(self.main):
            yield Fault(str(self.main), "", "", unfit(self.main))
        if name_of(self.main).endswith(_RESERVED) and self.main.suffix == ".nc":
            yield Fault(str(self.main), "", "", "another name: runs that fail leave files of such names")

    def _faults_of(self, path: Path, may_replace: bool, kept: bool) -> Iterator[Fault]:
        try:
            found = path.lstat()
        except FileNotFoundError:
            return
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            yield Fault(str(path), "", "", f"a name under which a file can be written ({reason})")
            return
        folder = stat.S_ISDIR(found.st_mode)
        if folder and path == self.main:
            yield Fault(str(path), "", "", "a file name for the output, not a folder")
        elif not (folder or stat.S_ISREG(found.st_mode)):
            yield Fault(str(path), "", "", f"a regular file or a free name, not a {_what(found.st_mode)}")
        elif not may_replace:
            ways = "`restart` or `overwrite`" if kept and path.suffix == ".npz" else "`overwrite`"
            yield Fault(str(path), "", "", f"an output that does not exist yet (or {ways})")
        elif not self._ours(path):
            yield Fault(str(path), "", "", "a file that graben wrote, to replace it: move away what lies there")

    def _ours(self, path: Path) -> bool:
        """Whether graben wrote what lies there, so that `overwrite` may replace it."""
        with suppress(OSError, ValueError, KeyError, RuntimeError):
            if path.suffix == FOLDER and path.is_dir():
                return all(_is_state(p) for p in path.iterdir())
            if path.is_file():
                main = path == self.main and self.kept  # an artifact, whatever its name ends in
                mark = _artifact if main else _MARKS.get(path.suffix, _artifact)
                return path.stat().st_size == 0 or mark(path, self.main)
        return False

    def _twin(self) -> Iterator[Fault]:
        """Outputs "a" and "a.nc" would share what lies beside them."""
        name = self.main.name
        other = self.main.parent / (name.removesuffix(".nc") if name.endswith(".nc") else name + ".nc")
        if (self.ends or self.kept) and other != self.main and other.is_file() and _artifact(other, self.main):
            yield Fault(str(self.main), "", "", f"another name: files beside it would be those of {other.name}")


def files_of(scene: Any) -> list[Path]:
    """The scene's own file and every file that it names."""
    from pydantic import BaseModel

    def walk(value: Any) -> Iterator[Path]:
        if isinstance(value, Path):
            yield value
        elif isinstance(value, BaseModel):
            for name in type(value).model_fields:
                yield from walk(getattr(value, name))
        elif isinstance(value, dict):
            yield from walk(list(value.values()))
        elif isinstance(value, list | tuple):
            for part in value:
                yield from walk(part)

    return [scene.source.path, *walk(scene)]


def _misplaced(path: Path) -> Iterator[Fault]:
    """Names that are too long, and a file where the path has a folder."""
    folder = existing_folder(path)
    for name in (*path.absolute().relative_to(folder).parts[:-1], part_of(path).name):
        if len(os.fsencode(name)) > 255:
            yield Fault(str(path), "", "", f"shorter names (the longest that is needed: {name})")
    for above in path.absolute().parents:
        if above != folder and folder in above.parents and os.path.lexists(above):
            yield Fault(str(path), "", "", f"a folder to write to; {above} is none")


def _among_fields(path: Path) -> Iterator[Fault]:
    folder = existing_folder(path)
    if folder.suffix == FOLDER and any(map(_is_state, folder.iterdir())):
        yield Fault(str(path), "", "", f"a folder for outputs; {folder} holds the fields of a run")


def _is_state(path: Path) -> bool:
    """Whether a file is one of a series of VTU files, by name and content."""
    if not (re.fullmatch(r"\d{4,}\.vtu", path.name) and path.is_file()):
        return False
    with open(path, "rb") as stream:
        return b'type="UnstructuredGrid"' in stream.read(300)


def _try_to_write(path: Path) -> None:
    """Raise MachineFailed where no file can be written; nothing is left, not even a folder."""
    with machine(path), tempfile.NamedTemporaryFile(dir=existing_folder(path), prefix=".", suffix=".part") as probe:
        probe.write(bytes(_ROOM))
        probe.flush()


def _same(a: Path, b: Path) -> bool:
    with suppress(OSError):
        if a.samefile(b):
            return True
    a, b = _real(a), _real(b)
    return a == b or (a.parent == b.parent and a.name.casefold() == b.name.casefold() and not a.exists())


def _real(path: Path) -> Path:
    """Without links; a loop of them stays as it is."""
    return Path(os.path.realpath(path))


def _within(path: Path, folder: Path) -> bool:
    """Whether `path` lies in the folder of VTU files that will be at `folder`."""
    return folder.suffix == FOLDER and _real(folder) in _real(path).parents


def _what(mode: int) -> str:
    kinds: list[tuple[Callable[[int], bool], str]] = [
        (stat.S_ISLNK, "symbolic link"), (stat.S_ISFIFO, "named pipe"), (stat.S_ISSOCK, "socket"),
    ]  # fmt: skip
    return next((words for test, words in kinds if test(mode)), "device")


def _artifact(path: Path, main: Path) -> bool:
    import netCDF4

    with open(path, "rb") as stream:
        if stream.read(4) != b"\x89HDF":
            return False
    if seal_broken(path):
        return True
    with netCDF4.Dataset(path.absolute()) as data:  # it would take a leading ~ as the home folder
        return getattr(data, "software", "") == "graben" or "schema_kind" in data.ncattrs()


def _text(pattern: str) -> Callable[[Path, Path], bool]:
    def test(path: Path, main: Path) -> bool:
        return re.search(pattern.encode(), path.read_bytes()) is not None

    return test


def _pvd(path: Path, main: Path) -> bool:
    """A PVD of this artifact: -joints.pvd of one run and the .pvd of another called NAME-joints have one name."""
    # The last good state of a run that failed is an artifact of its own.
    owner = path.with_suffix(".nc") if path.stem == name_of(main) + LAST_GOOD else main
    return owner_mark(owner) in path.read_text(encoding="utf-8")


def owner_mark(output: Path) -> str:
    """A comment by which a PVD names the artifact that it belongs to."""
    name = re.sub("-(?=-)", "- ", output.name)  # XML ends comments by two of them
    return f"<!-- graben: fields of {name} -->"


def picture_mark(form: str) -> dict[str, str]:
    """Metadata by which a picture of that form, such as ".png", shows that graben drew it."""
    return {"Software" if form == ".png" else "Creator": _DRAWN}


_OF_MATERIAL = {"law", "parameters", "warnings"}


def _material(path: Path, main: Path) -> bool:
    text = path.read_text(encoding="utf-8")
    keys = set(tomllib.loads(text))
    return text.startswith("#") and {"law", "parameters"} <= keys <= _OF_MATERIAL and "# fitted to" in text


def _npz(path: Path, main: Path) -> bool:
    """A checkpoint or state, even a damaged one: its members are named in the headers and again at the end."""
    with open(path, "rb") as stream:
        text = stream.read(1000)
        stream.seek(max(0, path.stat().st_size - 100_000))
        text += stream.read()
    return text.startswith(b"PK") and (b"scene.npy" in text or b"digest.npy" in text)


_DRAWN = "graben, drawn by Matplotlib"
_PICTURE = _text(_DRAWN)
# By the end of the name; anything else is an artifact.
_MARKS: dict[str, Callable[[Path, Path], bool]] = {
    FOLDER: _text("UnstructuredGrid"),
    PVD: _pvd,
    ".toml": _material,
    ".npz": _npz,
    ".png": _PICTURE,
    ".pdf": _PICTURE,
    ".svg": _PICTURE,
    ".html": _text("<title>graben: "),
    ".htm": _text("<title>graben: "),
}
