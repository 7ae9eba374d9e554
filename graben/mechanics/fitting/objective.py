"""What the search minimises: the weighted residuals of the curves, and Gaussian priors on parameters beside them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.fitting.curves import CurveFit
from graben.mechanics.optimise.space import Box

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Priors:
    """Gaussian knowledge of some parameters, in the unit box: columns (j,), mean (j,), deviation (j,) > 0."""

    columns: NDArray[np.int64]
    mean: Array
    deviation: Array

    def __post_init__(self) -> None:
        if not (self.columns.shape == self.mean.shape == self.deviation.shape) or not (self.deviation > 0.0).all():
            raise ValueError("priors: expected as many columns, means and deviations above zero")

    @staticmethod
    def none() -> Priors:
        return Priors(np.empty(0, np.int64), np.empty(0), np.empty(0))

    def residuals(self, unit: Array, scale: float) -> Array:
        """(c, k) points -> (c, j) departures from the means in standard deviations, times `scale`."""
        return scale * (unit[:, self.columns] - self.mean) / self.deviation

    def precision(self, size: int) -> Array:
        """(size,) inverse variances, 0 where nothing is known."""
        out = np.zeros(size)
        out[self.columns] = self.deviation**-2.0
        return out


@dataclass(frozen=True)
class Objective:
    """Residuals over the unit box for the search; plain data, so that it can be sent to other processes.

    noise: expected misfit as a fraction of the stress that the curves are divided by; lag: points over which
    misfits are correlated. They set how much the priors weigh: with m residuals, a departure by one standard
    deviation costs noise^2 (1 + lag) / m, what one independent measurement of that misfit costs. That is the
    logarithm of the posterior, times the variance of a residual.
    """

    fit: CurveFit
    box: Box
    priors: Priors
    noise: float = 0.05
    lag: int = 0

    @property
    def prior_scale(self) -> float:
        return self.noise * math.sqrt((1.0 + self.lag) / self.fit.points)

    def data(self, unit: Array, shifts: Array | None = None) -> Array:
        """(c, k) -> (c, m): residuals of the curves alone; shifts as in `CurveFit.residuals`."""
        return self.fit.residuals(self.box.to_values(unit), shifts)

    def __call__(self, unit: Array, shifts: Array | None = None) -> Array:
        """(c, k) -> (c, m + j): residuals of curves and priors."""
        if self.priors.columns.size == 0:
            return self.data(unit, shifts)
        return np.concatenate([self.data(unit, shifts), self.priors.residuals(unit, self.prior_scale)], axis=1)
