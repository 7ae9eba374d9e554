"""Confidence intervals of contacts per area, over beds or over parts of one floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Floats = NDArray[np.float64]


def interval_over_beds(density: Floats, level: float = 0.95) -> tuple[Floats, Floats, Floats]:
    """Mean and Student-t interval of contacts per area (c,) from beds (b, c), b >= 2, independent of each other."""
    density = np.asarray(density, dtype=np.float64)
    if density.ndim != 2 or density.shape[0] < 2:
        raise ValueError(f"density: expected shape (beds >= 2, classes), found {density.shape}")
    mean = density.mean(axis=0)
    half = stdtrit(density.shape[0] - 1, 0.5 + level / 2.0) * density.std(axis=0, ddof=1) / np.sqrt(density.shape[0])
    return mean, np.maximum(mean - half, 0.0), mean + half


def interval_over_areas(
    position: Floats,
    kind: NDArray[np.int64],
    classes: int,
    width: tuple[float, float],
    parts: int,
    level: float = 0.95,
) -> tuple[Floats, Floats, Floats]:
    """The same from one floor cut into parts x parts equal areas.

    position (m, 2) and kind (m,) are those of the grains that touch. Areas side by side exclude each other's
    grains, so the interval is a little wide: on the safe side.
    """
    if parts < 2:
        raise ValueError(f"parts: expected at least 2, found {parts}")
    area = width[0] * width[1] / parts**2
    table = np.zeros((parts * parts, classes))
    for c in range(classes):
        p = position[kind == c]
        count, _, _ = np.histogram2d(
            np.clip(p[:, 0], 0.0, width[0]), np.clip(p[:, 1], 0.0, width[1]),
            bins=parts, range=((0.0, width[0]), (0.0, width[1])),
        )  # fmt: skip
        table[:, c] = count.ravel() / area
    return interval_over_beds(table, level)
