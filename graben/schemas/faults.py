"""Faults in input: what a file should have held, what it held, and where. Exit code 2 on the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One fault: the file, the key or variable in it, the value found, and what was expected."""

    file: str
    key: str
    value: str
    expected: str

    def __str__(self) -> str:
        place = f"{self.file}: {self.key}" if self.key else self.file
        found = f" = {self.value}" if self.value else ""
        return f"{place}{found}: expected {self.expected}"


class BadInput(ValueError):
    """Raised with every fault of the input at once; nothing has been written."""

    def __init__(self, faults: Sequence[Fault] | Fault) -> None:
        self.faults: list[Fault] = [faults] if isinstance(faults, Fault) else list(faults)
        super().__init__("\n".join(str(f) for f in self.faults))

    def __reduce__(self) -> tuple[type[BadInput], tuple[list[Fault]]]:
        return BadInput, (self.faults,)  # as it is when it comes from a worker process


class NotFinite(ArithmeticError):
    """A result to be written holds nan or infinity where its layout allows none. Exit code 3."""
