"""The record by which a law declares one of its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Parameter:
    """One parameter of a law.

    unit is SI ("Pa", "rad", "m", "1"); lower and upper are inclusive bounds of what the law can compute, not of
    what is usual (`usual` says that). default None means required. `choices` makes it a word, stored as its index.
    `when = (other, word)` says that it counts only if the choice parameter `other` is `word` (or one of
    several, "a|b").
    `table` makes it an (n, 2) array with rising first column, a plastic strain; unit is then that of the second.
    """

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf
    default: Any = None
    description: str = ""
    usual: str = ""
    choices: tuple[str, ...] = ()
    when: tuple[str, str] | None = None
    table: bool = False

    @property
    def form(self) -> Literal["number", "word", "table"]:
        """What a value of it is."""
        return "table" if self.table else "word" if self.choices else "number"

    @property
    def bounds(self) -> str:
        """Its bounds, for messages."""
        return f"from {self.lower:g} to {self.upper:g} {self.unit}"

    def holds(self, value: float) -> bool:
        """Whether a number lies within the bounds; nan does not."""
        return math.isfinite(value) and self.lower <= value <= self.upper
