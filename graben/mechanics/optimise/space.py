"""The box that a search works in: each parameter mapped to 0..1, on a linear or a logarithmic scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Box:
    """Bounds of k parameters. names (k,); lower, upper (k,) in SI; log (k,) true where the scale is
    logarithmic.

    ValueError names every parameter whose bounds are inverted, not finite, or not positive on a log scale.
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    log: NDArray[np.bool_]

    @staticmethod
    def of(names: Sequence[str], lower: Sequence[float], upper: Sequence[float], log: Sequence[bool] = ()) -> Box:
        """A Box from plain sequences; log defaults to all linear."""
        flags = np.array(log if len(log) else [False] * len(names), dtype=bool)
        return Box(tuple(names), np.asarray(lower, float), np.asarray(upper, float), flags)

    def __post_init__(self) -> None:
        k = len(self.names)
        if not (self.lower.shape == self.upper.shape == self.log.shape == (k,)):
            raise ValueError(f"bounds: expected {k} of each, found {self.lower.shape} and {self.upper.shape}")
        faults = []
        for name, low, high, log in zip(self.names, self.lower, self.upper, self.log):
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                faults.append(f"{name}: expected lower < upper, found {low:g} and {high:g}")
            elif log and low <= 0.0:
                faults.append(f"{name}: a log scale needs a positive lower bound, found {low:g}")
        if faults:
            raise Refused("; ".join(faults))

    @property
    def size(self) -> int:
        return len(self.names)

    def to_values(self, unit: Array) -> Array:
        """(..., k) in 0..1 -> (..., k) parameter values, inside the bounds to the last bit."""
        unit = np.clip(unit, 0.0, 1.0)
        low = np.where(self.log, 0.0, self.lower)
        values = low + unit * (np.where(self.log, 0.0, self.upper) - low)
        if self.log.any():
            a, b = np.log(self.lower[self.log]), np.log(self.upper[self.log])
            values[..., self.log] = np.exp(a + unit[..., self.log] * (b - a))
        return np.clip(values, self.lower, self.upper)

    def to_unit(self, values: Array) -> Array:
        """(..., k) parameter values -> (..., k) in 0..1."""
        values = np.clip(np.asarray(values, float), self.lower, self.upper)
        unit = (values - self.lower) / (self.upper - self.lower)
        if self.log.any():
            a, b = np.log(self.lower[self.log]), np.log(self.upper[self.log])
            unit[..., self.log] = (np.log(values[..., self.log]) - a) / (b - a)
        return np.clip(unit, 0.0, 1.0)

    def slope(self, unit: Array) -> Array:
        """d values / d unit (k,) at one point of the box."""
        values = self.to_values(unit)
        safe_low = np.where(self.log, self.lower, 1.0)
        safe_high = np.where(self.log, self.upper, np.e)
        return np.where(self.log, values * np.log(safe_high / safe_low), self.upper - self.lower)
