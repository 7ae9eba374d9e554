"""What the data can tell about the parameters at an optimum, and what they cannot.

With residuals r (m,) and their Jacobian J (m, k) in the unit box, the usual linear estimate of the covariance
is s^2 (J^T J)^-1, s^2 = r.r / (m - k). Two things are added to it.

The bounds: a parameter that the data do not see would get an error beyond its own range, and spoil those that
it is correlated with. So the bounds enter as the precision 12 I of a uniform distribution over each range:
covariance (J^T J / s^2 + 12 I)^-1. Where the data see much, nothing changes. A Gaussian prior adds its
inverse variance there.

Correlation: residuals along one curve are not independent (a slip event moves many points at once). The
robust errors are the largest of the plain ones, of those that let residuals within a curve be correlated in any way
up to a lag (Newey-West weights: no assumption, but too small where lags are few), and of those of an autoregressive
sequence (`autocorrelation.py`). They are the ones to quote.

Each right singular vector of J is a combination of parameters; its standard deviation from the data alone is
s over the singular value. A combination whose standard deviation exceeds what the bounds alone give
(1/sqrt(12) of the range) is unseen by the data.

Noise of the computation: J comes from differences, whose error shows in the difference N between two sizes of step. A
singular value v of direction d counts as sqrt(max(v^2 - 4 |N d|^2, 0)): untouched where the law's answer is smooth, 0
where it is rounding. A search ends with residuals above the `floor` that the law's own iterations leave; exact data
would claim less, so s is at least the floor. Neither depends on units.

A search that has not ended where the linear problem has its minimum leaves a step to go (with priors the data alone
do not say which). It is added to the robust errors in quadrature.

Verdicts have a grey zone, so that rounding cannot turn a yes into a no: what leaves open less than 0.45 of the range
(or of the prior) is identifiable, from 0.55 on it is not, and between it is doubtful. A direction is unseen above 1.2
of what the bounds give, seen below 1 / 1.2, doubtful between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.fitting.autocorrelation import lasting_meat

Array = NDArray[np.float64]

UNSEEN = 12.0**-0.5  # standard deviation of a uniform distribution over the range
_CLEAR, _LOST = 0.45, 0.55  # of what was open before: identifiable below, not above, doubtful between
_GREY = 1.2  # ratio to either side of UNSEEN within which a direction is doubtful


@dataclass(frozen=True)
class Identifiability:
    """Linear uncertainty at an optimum; all in the unit box (fractions of each parameter's range).

    free (k,) false where a bound holds the parameter (it is left out of the rest); standard_error,
    covariance, correlation: (k,), (k, k), (k, k), nan where not free; robust_error (k,): with correlated
    residuals; identifiable, doubtful (k,): free, and the data clearly more than halve what the bounds (and the
    prior) leave open, or about halve it; pending (k,): the step still to go over the robust error; near_bound (k,):
    free, a bound lies within a robust error. direction_error (j,), directions (j, k): of the combinations, worst
    seen first, inf where flat; unseen, direction_doubtful (j,).
    """

    free: NDArray[np.bool_]
    standard_error: Array
    robust_error: Array
    covariance: Array
    correlation: Array
    identifiable: NDArray[np.bool_]
    doubtful: NDArray[np.bool_]
    pending: Array
    near_bound: NDArray[np.bool_]
    direction_error: Array
    directions: Array
    unseen: NDArray[np.bool_]
    direction_doubtful: NDArray[np.bool_]


def identify(
    x: Array,
    residuals: Array,
    jacobian: Array,
    *,
    groups: NDArray[np.int64] | None = None,
    lag: int = 0,
    edge: float = 1e-6,
    bounded: bool = True,
    precision: Array | None = None,
    beside: Array | None = None,
    noise: Array | None = None,
    floor: float = 0.0,
) -> Identifiability:
    """Analyse an optimum x (k,) with residuals (m,) and jacobian (m, k), both from the unit box.

    groups (m,) numbers the curve and quantity a residual belongs to, in order along it; residuals of one
    group are taken as correlated up to `lag` points apart, and beyond as an autoregressive sequence is; lag 0:
    independent. edge: nearer to a bound than this counts as held
    by it. bounded: the bounds count as knowledge (without, a direction that the data do not see makes the
    covariance singular). precision (k,): inverse variances of Gaussian priors; residuals and jacobian are
    those of the data alone. beside (m, b): jacobian of b unknowns that were fitted along, which the
    parameters' jacobian has been cleared of.
    noise (m, k): difference to the jacobian of another step; floor: root mean square of what the model's own
    iterations leave in a residual.

    Raises Refused for shapes that do not fit.
    """
    k = x.size
    if jacobian.shape != (residuals.size, k):
        raise Refused(f"jacobian: expected ({residuals.size}, {k}), found {jacobian.shape}")
    free = (x > edge) & (x < 1.0 - edge)
    index = np.flatnonzero(free)
    error, robust_error = np.full(k, np.nan), np.full(k, np.nan)
    covariance, correlation = np.full((k, k), np.nan), np.full((k, k), np.nan)
    known = np.zeros(k, bool)
    if index.size == 0:
        none, nothing = np.empty(0), np.zeros(0, bool)
        return Identifiability(
            free, error, robust_error, covariance, correlation, known, known, error, known, none, np.empty((0, k)),
            nothing, nothing,
        )  # fmt: skip
    # what never moves says nothing: the first point, where a path starts, and parts without a penalty
    counts = (residuals != 0.0) | jacobian.any(axis=1)
    j, residuals = jacobian[counts][:, index], residuals[counts]
    u, values, vt = np.linalg.svd(j, full_matrices=False)
    if noise is not None:
        blurred = np.linalg.norm(noise[counts][:, index] @ vt.T, axis=0)
        values = np.sqrt(np.maximum(values**2 - 4.0 * blurred**2, 0.0))
        j = (u * values) @ vt
    groups = None if groups is None else groups[counts]
    others = np.empty((residuals.size, 0)) if beside is None else beside[counts]
    freedom = max(1, residuals.size - index.size - others.shape[1])
    # a perfect fit leaves no scatter to judge by; what the model leaves open is then the scatter
    s2 = max(float(residuals @ residuals) / freedom, floor**2, 1e-30)
    known_before = np.full(index.size, UNSEEN**-2.0 if bounded else 0.0)
    if precision is not None:
        known_before += precision[index]
    prior = np.diag(known_before)
    inverse = np.linalg.inv(j.T @ j / s2 + prior)
    meat = _meat(j, residuals, groups, lag) * (residuals.size / freedom) / s2**2 + prior
    robust = np.diag(inverse @ meat @ inverse)
    if groups is not None and lag > 0:
        lasting = lasting_meat(j, residuals, groups, others)[0] / s2**2 + prior
        robust = np.maximum(robust, np.diag(inverse @ lasting @ inverse))
    deviation = np.sqrt(np.diag(inverse))
    full = np.ix_(index, index)
    covariance[full], correlation[full] = inverse, inverse / np.outer(deviation, deviation)
    error[index] = deviation
    # neither estimate may claim less than the other by chance: a few slips can make the sandwich too small
    scatter = np.maximum(np.sqrt(np.maximum(robust, 0.0)), deviation)
    to_go = np.zeros(index.size) if precision is not None and precision.any() else inverse @ (j.T @ residuals) / s2
    robust_error[index] = np.hypot(scatter, to_go)
    pending = np.full(k, np.nan)
    pending[index] = np.abs(to_go) / robust_error[index]
    near_bound = free & (np.minimum(x, 1.0 - x) < np.nan_to_num(robust_error))
    open_still = robust_error[index] * np.sqrt(np.maximum(known_before, UNSEEN**-2.0))
    doubtful = np.zeros(k, bool)
    known[index], doubtful[index] = open_still < _CLEAR, (open_still >= _CLEAR) & (open_still < _LOST)
    seen = values > 1e-10 * max(values.max(), 1e-300)
    spread = np.where(seen, np.sqrt(s2) / np.maximum(values, 1e-300), np.inf)
    order = np.argsort(-spread, kind="stable")
    directions = np.zeros((order.size, k))
    directions[:, index] = vt[order]
    flip = np.sign(directions[np.arange(order.size), np.abs(directions).argmax(axis=1)])
    directions *= flip[:, None]  # the largest entry positive: the sign of a singular vector is arbitrary
    return Identifiability(
        free, error, robust_error, covariance, correlation, known, doubtful, pending, near_bound, spread[order],
        directions, spread[order] > _GREY * UNSEEN, np.abs(np.log(spread[order] / UNSEEN)) <= np.log(_GREY),
    )  # fmt: skip


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
