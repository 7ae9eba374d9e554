"""What a failed run leaves: its last good state, or the reason why there is none; either is a note of the error."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from graben.errors import MachineFailed, NotFinite, NumericsFailed
from graben.schemas.artifact import Layout, write_artifact
from graben.schemas.outputs import PARTIAL, beside
from graben.stages.shared.record import Record

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")
Keep = Callable[[str], Path | None]

_keep: ContextVar[Keep | None] = ContextVar("how to keep the last good state", default=None)


def keeps_last_good(nothing_yet: str) -> Callable[[Callable[Parameters, Result]], Callable[Parameters, Result]]:
    """For the `run` of a stage: when it fails, keep what was said by `keep_by`, and add a note with the file.

    nothing_yet : why nothing can be kept before that
    """

    def decorated(run: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
        @functools.wraps(run)
        def guarded(*arguments: Parameters.args, **named: Parameters.kwargs) -> Result:
            before = _keep.set(None)
            try:
                return run(*arguments, **named)
            except (NumericsFailed, NotFinite) as failure:
                failure.add_note(_kept(str(failure), nothing_yet))
                raise
            finally:
                _keep.reset(before)

        return guarded

    return decorated


def keep_by(keep: Keep) -> None:
    """From now on a failure keeps the last good state so: keep(why) writes a file and returns it, or None if there is
    no such state."""
    _keep.set(keep)


def write_whole(
    output: Path,
    layout: Layout,
    arrays: Mapping[str, Any],
    record: Record,
    attributes: Mapping[str, Any] | None = None,
) -> None:
    """Write the artifact of a run; where its numbers are not all finite, NAME.partial.nc keeps those that are."""

    def keep(why: str) -> Path:
        path = beside(output, PARTIAL)
        write_artifact(path, layout, arrays, record, attributes, partial=why)
        return path

    keep_by(keep)
    write_artifact(output, layout, arrays, record, attributes)


def _kept(why: str, nothing_yet: str) -> str:
    keep = _keep.get()
    try:
        path = keep(why) if keep is not None else None
    except (NumericsFailed, NotFinite, MachineFailed) as error:
        return f"the last good state could not be kept ({error})"
    return f"nothing is kept: {nothing_yet}" if path is None else f"the last good state is in {path}"
