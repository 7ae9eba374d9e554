"""How a stage ended: the exit code and the words for each way it can fail."""

from __future__ import annotations

from graben.errors import BadInput, NotFinite, NumericsFailed

DONE, BAD_INPUT, NUMERICS, INTERRUPTED = 0, 2, 3, 130


def explain(error: BaseException) -> tuple[int, list[str]] | None:
    """Exit code and one line per fault for the errors a user can act on; None for a fault of the program."""
    if isinstance(error, BadInput):
        return BAD_INPUT, [str(fault) for fault in error.faults]
    if isinstance(error, NumericsFailed | NotFinite):
        return NUMERICS, [f"the numerics failed: {error}"]
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, ["interrupted; no output was written"]
    return None
