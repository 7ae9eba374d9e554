"""What the data can tell about the parameters at an optimum, and what they cannot.

With residuals r (m,) and their Jacobian J (m, k) in the unit box, the usual linear estimate of the covariance
is s^2 (J^T J)^-1, s^2 = r.r / (m - k). Residuals along one curve are not independent (a slip event moves many
points at once), so a second estimate lets residuals within a curve be correlated in any way up to a lag
(Newey-West weights): it is the one to quote. Each right singular vector of J is a combination of parameters;
its standard deviation is s over the singular value. A combination whose standard deviation exceeds what the
bounds alone give (1/sqrt(12) of the range) is unseen by the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UNSEEN = 12.0**-0.5  # standard deviation of a uniform distribution over the range


@dataclass(frozen=True)
class Identifiability:
    """Linear uncertainty at an optimum; all in the unit box (fractions of each parameter's range).

    free (k,) false where a bound holds the parameter (it is left out of the rest); standard_error,
    covariance, correlation: (k,), (k, k), (k, k), nan where not free or not identifiable; robust_error (k,):
    with correlated residuals; identifiable (k,): the data narrow the parameter down beyond its bounds;
    direction_error (j,), directions (j, k): of the combinations, worst seen first; unseen (j,).
    """

    free: NDArray[np.bool_]
    standard_error: Array
    robust_error: Array
    covariance: Array
    correlation: Array
    identifiable: NDArray[np.bool_]
    direction_error: Array
    directions: Array
    unseen: NDArray[np.bool_]


def identify(
    x: Array,
    residuals: Array,
    jacobian: Array,
    *,
    groups: NDArray[np.int64] | None = None,
    lag: int = 0,
    edge: float = 1e-6,
) -> Identifiability:
    """Analyse an optimum x (k,) with residuals (m,) and jacobian (m, k), both from the unit box.

    groups (m,) numbers the curve and quantity a residual belongs to, in order along it; residuals of one
    group are taken as correlated up to `lag` points apart. edge: nearer to a bound than this counts as held
    by it.
    """
    k = x.size
    if jacobian.shape != (residuals.size, k):
        raise ValueError(f"jacobian: expected ({residuals.size}, {k}), found {jacobian.shape}")
    free = (x > edge) & (x < 1.0 - edge)
    index = np.flatnonzero(free)
    j = jacobian[:, index]
    nan = np.full((k, k), np.nan)
    empty = Identifiability(
        free, nan[0].copy(), nan[0].copy(), nan.copy(), nan.copy(), np.zeros(k, bool), np.empty(0),
        np.empty((0, k)),
        np.empty(0, bool),
    )  # fmt: skip
    if index.size == 0:
        return empty
    freedom = max(1, residuals.size - index.size)
    s = float(np.sqrt(residuals @ residuals / freedom))
    _u, values, vt = np.linalg.svd(j, full_matrices=False)
    floor = 1e-10 * max(values.max(), 1e-300)
    seen = values > floor
    spread = np.where(seen, s / np.maximum(values, floor), np.inf)
    # a flat direction is known no better than the bounds, however small the residuals are
    unseen = (spread > UNSEEN) | ~seen
    inverse = (vt[seen].T / values[seen] ** 2) @ vt[seen]
    covariance = s * s * inverse
    meat = _meat(j, residuals, groups, lag)
    robust = inverse @ meat @ inverse * residuals.size / freedom
    lost = (vt[~seen] ** 2).sum(axis=0) > 1e-6
    errors = np.sqrt(np.diag(covariance))
    robust_errors = np.sqrt(np.maximum(np.diag(robust), 0.0))
    identifiable = ~lost & (errors < UNSEEN)
    errors = np.where(lost, np.nan, errors)
    robust_errors = np.where(lost, np.nan, robust_errors)
    correlation = covariance / np.maximum(
        np.outer(np.sqrt(np.diag(covariance)), np.sqrt(np.diag(covariance))), 1e-300
    )
    correlation[lost], correlation[:, lost] = np.nan, np.nan
    order = np.argsort(-spread, kind="stable")
    directions = np.zeros((index.size, k))
    directions[:, index] = vt[order]
    flip = np.sign(directions[np.arange(index.size), np.abs(directions).argmax(axis=1)])
    directions *= flip[:, None]  # the largest entry positive: the sign of a singular vector is arbitrary
    full = np.ix_(index, index)
    out_cov, out_cor = nan.copy(), nan.copy()
    out_cov[full], out_cor[full] = covariance, correlation
    out_error, out_robust, out_known = nan[0].copy(), nan[0].copy(), np.zeros(k, bool)
    out_error[index], out_robust[index], out_known[index] = errors, robust_errors, identifiable
    return Identifiability(
        free, out_error, out_robust, out_cov, out_cor, out_known, spread[order], directions, unseen[order]
    )


def _meat(j: Array, r: Array, groups: NDArray[np.int64] | None, lag: int) -> Array:
    """Sum over pairs of residuals of one group up to `lag` apart of J_a r_a r_b J_b, with Bartlett
    weights."""
    scores = j * r[:, None]
    total = scores.T @ scores
    if groups is None or lag < 1:
        return total
    for d in range(1, lag + 1):
        same = groups[d:] == groups[:-d]
        a, b = scores[d:][same], scores[:-d][same]
        cross = a.T @ b
        total += (1.0 - d / (lag + 1.0)) * (cross + cross.T)
    return total
