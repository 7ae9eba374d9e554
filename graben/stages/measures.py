"""Error measures of a result, each with the threshold past which a person must be told, in plain words."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Measure:
    """An error measure.

    value : None where the run gives none (too few states)
    threshold : what is larger, or not finite, is doubtful
    sentence : says in plain words what that means and what to change; {value} and {percent} are filled in
    """

    name: str
    value: float | None
    threshold: float
    sentence: str

    @property
    def doubtful(self) -> bool:
        return self.value is not None and not self.value <= self.threshold

    def __str__(self) -> str:
        value = math.nan if self.value is None else self.value
        return self.sentence.format(value=f"{value:.3g}", percent=f"{100.0 * value:.3g} %")


def warnings_of(measures: Iterable[Measure]) -> list[str]:
    """What the measures past their thresholds say, for `warnings` of a headline and of an artifact."""
    return [str(m) for m in measures if m.doubtful]


def number(value: float) -> float | None:
    """A float for a headline; None where there is no number."""
    return float(value) if math.isfinite(value) else None


def tell(warnings: Iterable[str]) -> None:
    """..."""
    for text in warnings:
        logging.getLogger(__name__).warning(text)
