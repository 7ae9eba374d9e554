"""How a stage ended: the exit code and the words for each way it can fail."""

from __future__ import annotations

import errno
import re
from dataclasses import replace

from graben.errors import BadInput, Fault, MachineFailed, NotFinite, NumericsFailed

DONE, BAD_INPUT, FAILED, INTERRUPTED = 0, 2, 3, 130
# What the operating system says when the machine is at fault, not the program.
_MACHINE = {
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
    errno.ESTALE, errno.EAGAIN,
}  # fmt: skip
_LOST = {"BrokenExecutor", "KilledWorker"}  # of pools of processes, and of Dask, which may not be installed
# What the loader of libraries and the interpreter say of the same.
_NO_MEMORY = re.compile(r"failed to map segment|[Cc]annot allocate memory|can't start new thread")


def as_options(fault: Fault) -> Fault:
    """The fault with arguments of the call spelled as options: chosen_at is --chosen-at."""
    key = _option(fault.key) if fault.argument else fault.key
    return replace(fault, key=key, expected=re.sub("`([a-z_]+)`", lambda m: _option(m[1]), fault.expected))


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def explain(error: BaseException) -> tuple[int, list[str]] | None:
    """Exit code and one line per fault for the errors a user can act on; None for a fault of the program.

    Arguments of the call are shown as options of the command line.
    """
    if isinstance(error, BadInput):
        return BAD_INPUT, [str(as_options(fault)) for fault in error.faults]
    if isinstance(error, NumericsFailed | NotFinite):
        return FAILED, [f"the numerics failed: {error}", *getattr(error, "__notes__", [])]
    if isinstance(error, MachineFailed):
        return FAILED, [str(error)]
    if isinstance(error, MemoryError) or (
        type(error) in (ImportError, RuntimeError) and _NO_MEMORY.search(str(error))
    ):
        return FAILED, [f"not enough memory: {error}".rstrip(": ")]
    if _LOST & {kind.__name__ for kind in type(error).__mro__}:
        return FAILED, ["a worker was ended from outside, as when memory runs out; take fewer, or smaller ones"]
    if isinstance(error, OSError) and error.errno in _MACHINE:
        return FAILED, [f"the machine failed: {error}"]
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, ["interrupted; no output was written"]
    return None
