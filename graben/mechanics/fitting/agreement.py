"""Do the starts of a search agree, do laws differ: verdicts with a grey zone, which rounding cannot turn round.

Starts agree if another one ends at the objective of the best and at its parameters. Root mean squares within 1 % of
one another count as the same, 5 % apart as different; parameters within two standard errors as the same, four apart
as different. Between lies doubt. What the model's own iterations leave (`floor`) is added to both root mean squares,
so that fits to exact data are not told apart by rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SAME, _OTHER = 1.01, 1.05  # ratios of root mean squares
_WITHIN, _BEYOND = 2.0, 4.0  # standard errors
_LEAST, _HELD = 1e-4, 0.1  # of a range: errors are not taken smaller; what a bound holds has none, so a tenth
_CLOSE = 0.05  # cross-validated errors this much apart choose between laws


@dataclass(frozen=True)
class Agreement:
    """verdict: agree, doubtful, disagree, or single for one start; ratio: of the root mean square of the second best
    start to the best; apart: largest difference of a parameter between them in standard errors, and which one."""

    verdict: str
    ratio: float
    apart: float
    parameter: int


def agreement(ends: Array, values: Array, error: Array, *, points: int, floor: float = 0.0) -> Agreement:
    """Compare the two best of the starts.

    ends (starts, k): where each start ended, in the unit box; values (starts,): sums of squares there; error (k,):
    standard errors in the box, nan where a bound holds; points: number of residuals; floor: as in `identify`.
    """
    order = np.argsort(values, kind="stable")
    if len(order) < 2:
        return Agreement("single", 1.0, 0.0, 0)
    best, second = order[:2]
    rms = np.sqrt(np.maximum(values[[best, second]], 0.0) + points * floor**2)
    ratio = float(rms[1] / rms[0]) if rms[0] > 0.0 else (1.0 if rms[1] == 0.0 else np.inf)
    least = np.where(np.isnan(error), _HELD, np.maximum(error, _LEAST))
    apart = np.abs(ends[second] - ends[best]) / least
    worst = int(np.argmax(apart))
    if ratio <= _SAME and apart[worst] <= _WITHIN:
        verdict = "agree"
    elif ratio > _OTHER or apart[worst] > _BEYOND:
        verdict = "disagree"
    else:
        verdict = "doubtful"
    return Agreement(verdict, ratio, float(apart[worst]), worst)


def rank(errors: Array, parameters: NDArray[np.int64]) -> tuple[list[int], list[int]]:
    """Candidates by cross-validated error (n,), best first, and those that are as good as the best: within 5 % of it.

    Errors that agree to three digits count as equal; then the fewer parameters win, then the order given.
    """
    rounded = [float(f"{e:.3g}") if np.isfinite(e) else np.inf for e in errors]
    order = sorted(range(len(errors)), key=lambda i: (rounded[i], int(parameters[i]), i))
    if not np.isfinite(errors[order[0]]):
        return order, order
    return order, [i for i in order if errors[i] <= (1.0 + _CLOSE) * errors[order[0]]]
