"""What stages share when they report: the record of provenance and cost, and progress."""

from __future__ import annotations

from collections.abc import Callable

from graben.schemas.provenance import Record

Progress = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and a few words about the state."""


def silent(fraction: float, message: str) -> None:
    """The progress of a stage that nobody watches."""


__all__ = ["Progress", "Record", "silent"]
