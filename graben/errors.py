"""The errors that graben raises on purpose; one family, so that a caller can tell them from faults of the program.

``BadInput`` is exit code 2 on the command line; ``NumericsFailed``, ``NotFinite`` and ``MachineFailed`` are 3.
Mechanics, which knows no file, raises ``Refused`` for input that it cannot take; the stage turns it into ``BadInput``
with the file and key. A plain ``ValueError`` is a fault of the program.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class GrabenError(Exception):
    """Root of the family."""


@dataclass(frozen=True)
class Fault:
    """One fault: the file, the key or variable in it, the value found, and what was expected.

    argument : the key is no key of a file but an argument of the call. Texts name arguments in `backticks`; the
        command line shows both as its options
    """

    file: str
    key: str
    value: str
    expected: str
    argument: bool = False

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.file, self.key) if part)
        found = f" = {self.value}" if self.value else ""
        return f"{place}{found}: expected {self.expected}"


class BadInput(GrabenError, ValueError):
    """Raised with every fault of the input at once; nothing has been written."""

    def __init__(self, faults: Sequence[Fault] | Fault) -> None:
        self.faults: list[Fault] = [faults] if isinstance(faults, Fault) else list(faults)
        super().__init__("\n".join(str(f) for f in self.faults))

    def __reduce__(self) -> tuple[type[BadInput], tuple[list[Fault]]]:
        return BadInput, (self.faults,)  # as it is when it comes from a worker process


class Incomplete(BadInput):
    """The only faults of a scene are files that the call may still name: no fault of the scene by itself."""


class Refused(GrabenError, ValueError):
    """Mechanics cannot take this input; says what was expected, without file or key."""


class NotFinite(GrabenError, ArithmeticError):
    """A result to be written holds nan or infinity where its layout allows none."""


class MachineFailed(GrabenError):
    """The machine refused what a run needs: space, permission, or a folder that went away. Names path and reason."""

    def __init__(self, path: str, reason: str) -> None:
        self.path, self.reason = path, reason
        super().__init__(f"{path}: cannot be written ({reason})")

    def __reduce__(self) -> tuple[type[MachineFailed], tuple[str, str]]:
        return MachineFailed, (self.path, self.reason)


class NumericsFailed(GrabenError, RuntimeError):
    """A computation cannot go on. Says what failed, where, at which step, and what to change.

    Parameters
    ----------
    what : the quantity that failed and by how much, e.g. ``"energy error 4.1 % (limit 3 %)"``
    where : the block, element or particle concerned, if known
    step : the step at which it was noticed, if stepping
    advice : what a user can change in the scene
    """

    def __init__(self, what: str, *, where: str = "", step: int | None = None, advice: str = "") -> None:
        self.what, self.where, self.step, self.advice = what, where, step, advice
        parts = [what]
        if where:
            parts.append(f"at {where}")
        if step is not None:
            parts.append(f"in step {step}")
        text = " ".join(parts)
        super().__init__(f"{text}; {advice}" if advice else text)
