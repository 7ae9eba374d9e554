"""Errors of the points of a study against a reference, with what is known of their uncertainty.

Rows are points, from coarse to fine, and columns are seeds. Points are compared seed by seed: what a seed adds to
both falls out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Orders of convergence that a sequence may show and still be believed.
_SLOWEST, _FASTEST = 0.3, 6.0

# Differences of a sequence must be so many times as large as what scatter makes of them.
_CLEAR = 2.0


@dataclass(frozen=True)
class Limit:
    """What a sequence of ever finer points tends to.

    value : (seeds,) None where it is not known; reason : why not, in words
    order : p in value = limit + c size^p
    """

    value: np.ndarray | None
    order: float | None
    reason: str = ""


@dataclass(frozen=True)
class Errors:
    """Relative errors (points,) and their 95 % intervals; nan where they are not known."""

    error: np.ndarray
    low: np.ndarray
    high: np.ndarray


def limit_of(values: np.ndarray, sizes: np.ndarray | None) -> Limit:
    """Limit of the last three points, after Richardson, with the order that they show.

    Parameters
    ----------
    values : (points, seeds); sizes : (points,) falling towards the fine end, None where points are no such sequence
    """
    if sizes is None or len(values) < 3:
        return Limit(None, None, "extrapolation needs one knob with three numbers at least, from coarse to fine")
    if not np.isfinite(values[-3:]).all():
        return Limit(None, None, "one of the three finest points has no value")
    means = values[-3:].mean(axis=1)
    first, last = means[0] - means[1], means[1] - means[2]
    if first * last <= 0.0:
        return Limit(None, None, "the three finest points do not settle")
    scatter = _scatter(values[-2] - values[-1])
    if abs(last) < _CLEAR * scatter:
        return Limit(None, None, "the two finest points differ by no more than their scatter")
    order = _order(first / last, sizes[-3:])
    if order is None:
        return Limit(None, None, f"no order of convergence from {_SLOWEST:g} to {_FASTEST:g} fits")
    share = 1.0 / ((sizes[-2] / sizes[-1]) ** order - 1.0)
    return Limit(values[-1] + share * (means[2] - means[1]), order)


def _order(ratio: float, sizes: np.ndarray) -> float | None:
    """p with (s0^p - s1^p) / (s1^p - s2^p) = ratio, by bisection: the left side grows with p."""

    def excess(p: float) -> float:
        a, b, c = (sizes / sizes[2]) ** p
        return float((a - b) / (b - c) - ratio)

    low, high = _SLOWEST, _FASTEST
    if excess(low) > 0.0 or excess(high) < 0.0:
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


def errors_of(
    values: np.ndarray, reference: np.ndarray, reference_low: float, reference_high: float,
    own_low: np.ndarray, own_high: np.ndarray,
) -> Errors:  # fmt: skip
    """Errors against a reference.

    Parameters
    ----------
    values : (points, seeds); reference : (seeds,)
    reference_low, reference_high : its own interval; nan where it is not known
    own_low, own_high : (points,) intervals that runs tell of themselves; nan where they tell none
    """
    ratio = values / reference - 1.0
    error = ratio.mean(axis=1)
    centre = float(reference.mean())
    if values.shape[1] > 1:
        half = np.array([_half(row) for row in ratio])
        low, high = error - half, error + half
    else:
        low, high = np.sort(np.array([own_low, own_high]) / centre - 1.0, axis=0)
    if np.isfinite(reference_low + reference_high):
        # The reference may be wrong as well: the two parts are independent of one another.
        known = [np.where(np.isfinite(end), end, error) for end in (low, high)]
        share = np.sort([reference_low / centre - 1.0, reference_high / centre - 1.0])
        low = error - np.hypot(error - known[0], share[1])
        high = error + np.hypot(known[1] - error, share[0])
    return Errors(error, low, high)


def _half(sample: np.ndarray) -> float:
    """Half a 95 % interval of the mean, after Student."""
    from scipy.special import stdtrit

    return float(stdtrit(len(sample) - 1, 0.975)) * _scatter(sample)


def _scatter(sample: np.ndarray) -> float:
    """Standard error of the mean; 0 of one value."""
    return float(sample.std(ddof=1) / np.sqrt(len(sample))) if len(sample) > 1 else 0.0


def front_of(cost: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which points (points,) no other one beats: as cheap or cheaper, and closer. No error, not on the front."""
    size = np.where(np.isfinite(error), np.abs(error), np.inf)
    better = (cost[None, :] <= cost[:, None]) & (size[None, :] <= size[:, None])
    strictly = (cost[None, :] < cost[:, None]) | (size[None, :] < size[:, None])
    return np.isfinite(error) & ~(better & strictly).any(axis=1)


def cheapest_within(wanted: float, cost: np.ndarray, errors: Errors) -> int | None:
    """The cheapest point whose error, with its interval where known, is within `wanted`; None: there is none."""
    size = np.abs(errors.error)
    for end in (errors.low, errors.high):
        size = np.maximum(size, np.where(np.isfinite(end), np.abs(end), 0.0))
    fit = np.flatnonzero(np.isfinite(size) & (size <= wanted))
    return int(fit[np.argmin(cost[fit])]) if len(fit) else None
