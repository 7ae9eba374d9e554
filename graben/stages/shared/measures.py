"""Error measures of a result, each with the threshold past which a person must be told, in plain words."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Measure:
    """An error measure of a headline.

    value : None or nan where the run gives none (too few states)
    threshold : what is larger is doubtful, and what is smaller than `least`
    sentence : what that means and what to change; {value} and {percent} are filled in
    """

    name: str
    value: float | None
    threshold: float
    sentence: str
    least: float = -math.inf

    @property
    def doubtful(self) -> bool:
        return self.value is not None and (self.value < self.least or self.value > self.threshold)

    def __str__(self) -> str:
        value = math.nan if self.value is None else self.value
        return self.sentence.format(value=f"{value:.3g}", percent=f"{100.0 * value:.3g} %")


def warnings_of(measures: Iterable[Measure]) -> list[str]:
    """What the measures past their thresholds say, for `warnings` of a headline and of an artifact."""
    return [str(m) for m in measures if m.doubtful]


def number(value: float) -> float | None:
    """A float for a headline; None where there is no number."""
    return float(value) if math.isfinite(value) else None
