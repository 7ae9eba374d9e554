"""Levenberg-Marquardt in the unit box: least squares, scaled, bounded, Y 2.6.3 (2.57)-(2.68).

Two liberties against Y: the trial steps of several damping values are evaluated in one call and the best is
taken (Y adjusts lambda one at a time), and a parameter held by a bound leaves the step's equations until the
gradient points inside again, so that no parameter ever leaves its bounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Residuals = Callable[[Array], Array]

_ROUNDING = 1e-7  # of the longest column of a Jacobian: what is shorter is not scaled to unit length


@dataclass(frozen=True)
class FitResult:
    """x (k,), residuals (m,), value = sum of their squares, jacobian (m, k) at x, what ended the search."""

    x: Array
    residuals: Array
    value: float
    jacobian: Array
    iterations: int
    evaluations: int
    reason: str


def jacobian(function: Residuals, x: Array, step: float) -> Array:
    """Central differences (m, k) inside the unit box, one-sided where a bound is nearer than the step."""
    k = x.size
    up, down = np.minimum(x + step, 1.0), np.maximum(x - step, 0.0)
    points = np.repeat(x[None], 2 * k, axis=0)
    points[np.arange(k), np.arange(k)] = up
    points[k + np.arange(k), np.arange(k)] = down
    r = function(points)
    return ((r[:k] - r[k:]) / (up - down)[:, None]).T


def levenberg_marquardt(
    function: Residuals,
    start: Array,
    *,
    damping: float = 1e-2,
    factor: float = 4.0,
    trials: int = 6,
    move_limit: float = 0.1,
    max_iterations: int = 40,
    tolerance: float = 1e-7,
    step: float = 1e-4,
    progress: Callable[[float, float], None] | None = None,
) -> FitResult:
    """Minimise the sum of squares of function(points (c, k)) -> residuals (c, m), all finite, over the unit
    box.

    Parameters
    ----------
    damping : lambda to begin with, on columns scaled to unit length
    factor, trials : each iteration tries `trials` values of lambda, a factor apart, around the last best
    move_limit : largest change of any parameter in one iteration, as a fraction of its range
    tolerance : ends when the sum of squares falls by less than this fraction
    step : of the finite differences, as a fraction of a parameter's range

    A step is taken only if it lowers the sum of squares.
    """
    x = np.clip(np.asarray(start, float), 0.0, 1.0)
    r = function(x[None])[0]
    if not np.isfinite(r).all():
        raise ValueError("levenberg_marquardt: residuals at the start are not finite")
    value = float(r @ r)
    evaluations, small, reason, iteration = 1, 0, "iterations used up", 0
    scale = np.zeros(x.size)
    jac = jacobian(function, x, step)
    for iteration in range(1, max_iterations + 1):
        evaluations += 2 * x.size
        gradient = jac.T @ r
        held = ((x <= 0.0) & (gradient > 0.0)) | ((x >= 1.0) & (gradient < 0.0))
        free = np.flatnonzero(~held)
        gram = jac.T @ jac
        norms = np.sqrt(np.diag(gram))
        scale = np.maximum(scale, norms)
        if free.size == 0 or value == 0.0 or not norms[free].any():
            reason = "no parameter can improve it"
            break
        # columns of rounding are not blown up: their steps would take the whole move
        s = np.maximum(scale[free], _ROUNDING * scale.max())
        # one decomposition serves every damping
        stiff, axes = np.linalg.eigh(gram[np.ix_(free, free)] / (s * s[:, None]))
        right = -(gradient[free] / s) @ axes
        lambdas = damping * factor ** np.arange(-(trials // 2), trials - trials // 2)
        points = np.repeat(x[None], trials, axis=0)
        moves = (right / (np.maximum(stiff, 0.0) + lambdas[:, None])) @ axes.T / s
        largest = np.maximum(np.abs(moves).max(axis=1), move_limit)
        points[:, free] = np.clip(x[free] + moves * (move_limit / largest)[:, None], 0.0, 1.0)
        tried = function(points)
        evaluations += trials
        totals = np.sum(np.ascontiguousarray(tried * tried), axis=1)
        totals[~np.isfinite(totals)] = np.inf
        i = int(np.argmin(totals))
        if totals[i] < value:
            gain = 1.0 - totals[i] / value
            x, r, value, damping = points[i], tried[i], float(totals[i]), float(max(lambdas[i], 1e-12))
            jac = jacobian(function, x, step)
            small = small + 1 if gain < tolerance else 0
        else:
            damping *= factor**trials
            small += 1
        if progress is not None:
            progress(iteration / max_iterations, value)
        if small >= 3 or damping > 1e12:
            reason = "converged"
            break
    return FitResult(x, r, value, jac, iteration, evaluations, reason)
