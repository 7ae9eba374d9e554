"""The first state of a curve is a measurement too: its errors as more unknowns of the fit.

A fit starts from the first axial stress of a curve, so an error there moves all that follows until flow forgets it;
taken as exact, a scatter of 1 % makes 95 % intervals hold the truth 34 to 85 times in 100. So after the search the
first axial stress of every noisy curve is fitted along: it may leave its measured value at the cost of a residual of
its own, like every other point. Lateral strain counts from its first reading, whose error all points share: a
constant is fitted along in the same way. The parameters' Jacobian is then cleared of what the first states can
explain as well (Q Q^T of their columns), which leaves the parameters' block of the whole covariance.

Noisy is a curve whose misfit its own scatter explains: less than `_EXPLAINED` times the roughness, 1.48 median |third
differences| / sqrt(20), which is the standard deviation where errors are independent. Averages of blocks are
smooth where they begin and miss the law by ten times their roughness: their first state stays exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.fitting.objective import Objective
from graben.mechanics.optimise.levenberg_marquardt import FitResult, jacobian, levenberg_marquardt

Array = NDArray[np.float64]

_EXPLAINED = 3.5
_REACH = 10.0  # a first state may leave its measured value by so many times the curve's misfit
_ENOUGH = 8  # points, for a roughness


def roughness(along: Array) -> float:
    """Scatter of (steps,) from point to point, in its unit; 0 where there are too few points to tell."""
    if len(along) < _ENOUGH:
        return 0.0
    third = np.diff(along, 3)
    return float(1.4826 * np.median(np.abs(third)) / np.sqrt(20.0))


@dataclass(frozen=True)
class Settled:
    """best: the fit, x (k,) and jacobian (m, k) of the parameters alone; noise (m, k): by how much that differs from
    one with steps twice as large; shifts (2, curves): how far each first axial stress (Pa) and lateral strain was
    moved; beside (m, b): the jacobian of those b that were free."""

    best: FitResult
    noise: Array
    shifts: Array
    beside: Array


def settle(objective: Objective, best: FitResult) -> Settled:
    """Refine `best` together with the first states of noisy curves; as it is where there are none."""
    fit = objective.fit
    errors = fit.errors(objective.box.to_values(best.x))
    misfit = np.array([errors["stress_per_curve"], errors["strain_per_curve"]])
    scatter = np.array(
        [[roughness(c.stress[:, 1]) for c in fit.curves], [roughness(c.strain[:, 0]) for c in fit.curves]]
    )
    free = np.array([fit.starts_free, fit.zeros_free])
    reach = np.where(free & (misfit < _EXPLAINED * scatter), _REACH * misfit, 0.0).ravel()
    columns = np.flatnonzero(reach)
    k = best.x.size
    if columns.size == 0:
        noise = jacobian(objective, best.x, 2e-4) - best.jacobian
        return Settled(best, noise, np.zeros_like(misfit), np.empty((len(noise), 0)))

    def shifts(unit: Array) -> Array:
        out = np.zeros((len(unit), reach.size))
        out[:, columns] = (2.0 * unit[:, k:] - 1.0) * reach[columns]
        return out.reshape(len(unit), *misfit.shape)

    def whole(unit: Array) -> Array:
        return objective(unit[:, :k], shifts(unit))

    found = levenberg_marquardt(whole, np.append(best.x, np.full(columns.size, 0.5)))
    slopes = jacobian(whole, found.x, 1e-4)
    basis = np.linalg.qr(slopes[:, k:])[0]
    noise = jacobian(whole, found.x, 2e-4)[:, :k] - slopes[:, :k]
    cleared, noise = (a - basis @ (basis.T @ a) for a in (slopes[:, :k], noise))
    evaluations = best.evaluations + found.evaluations
    own = replace(found, x=found.x[:k], jacobian=cleared, evaluations=evaluations)
    return Settled(own, noise, shifts(found.x[None])[0], slopes[:, k:])
