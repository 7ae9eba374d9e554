"""The first state of a curve is a measurement too: its error as one more unknown of the fit.

A fit starts from the first axial stress of a curve, so an error there moves all that follows until flow forgets it;
taken as exact, a scatter of 1 % makes 95 % intervals hold the truth 34 to 85 times in 100. So after the search the
first axial stress of every noisy curve is fitted along: it may leave its measured value at the cost of a residual of
its own, like every other point. The parameters' Jacobian is then cleared of what the first states can explain as
well (Q Q^T of their columns), which leaves the parameters' block of the whole covariance.

Noisy is a curve whose misfit its own scatter explains: less than `_EXPLAINED` times the roughness, 1.48 median |third
differences| / sqrt(20), which is the standard deviation where errors are independent. Averages of blocks are
smooth where they begin and miss the law by ten times their roughness: their first state stays exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.search.curves import Curve
from graben.mechanics.search.levenberg_marquardt import FitResult, jacobian, levenberg_marquardt
from graben.mechanics.search.objective import Objective

Array = NDArray[np.float64]

_EXPLAINED = 3.5
_REACH = 10.0  # a first state may leave its measured value by so many times the curve's misfit
_ENOUGH = 8  # points, for a roughness


def roughness(curve: Curve) -> float:
    """Scatter of the axial stress from point to point, in Pa; 0 where there are too few points to tell."""
    if len(curve.stress) < _ENOUGH:
        return 0.0
    third = np.diff(curve.stress[:, 1], 3)
    return float(1.4826 * np.median(np.abs(third)) / np.sqrt(20.0))


@dataclass(frozen=True)
class Settled:
    """best: the fit, x (k,) and jacobian (m, k) of the parameters alone; shifts (curves,) in Pa: how far each first
    axial stress was moved; moved: how many of them were free."""

    best: FitResult
    shifts: Array
    moved: int


def settle(objective: Objective, best: FitResult) -> Settled:
    """Refine `best` together with the first axial stresses of noisy curves; as it is where there are none."""
    fit = objective.fit
    misfit = fit.errors(objective.box.to_values(best.x))["stress_per_curve"]
    scatter = np.array([roughness(c) for c in fit.curves])
    reach = np.where(fit.starts_free & (misfit < _EXPLAINED * scatter), _REACH * misfit, 0.0)
    columns = np.flatnonzero(reach)
    k = best.x.size
    if columns.size == 0:
        return Settled(best, np.zeros(len(fit.curves)), 0)

    def shifts(unit: Array) -> Array:
        out = np.zeros((len(unit), len(fit.curves)))
        out[:, columns] = (2.0 * unit[:, k:] - 1.0) * reach[columns]
        return out

    def whole(unit: Array) -> Array:
        return objective(unit[:, :k], shifts(unit))

    found = levenberg_marquardt(whole, np.append(best.x, np.full(columns.size, 0.5)))
    slopes = jacobian(whole, found.x, 1e-4)
    basis = np.linalg.qr(slopes[:, k:])[0]
    cleared = slopes[:, :k] - basis @ (basis.T @ slopes[:, :k])
    evaluations = best.evaluations + found.evaluations
    own = replace(found, x=found.x[:k], jacobian=cleared, evaluations=evaluations)
    return Settled(own, shifts(found.x[None])[0], columns.size)
