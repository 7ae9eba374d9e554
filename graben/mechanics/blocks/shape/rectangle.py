"""The sides of an upright rectangle, by their direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused


@dataclass(frozen=True)
class Sides:
    """Sides of the outline by their direction: indices of bottom, right, top and left."""

    bottom: int
    right: int
    top: int
    left: int


def rectangle_sides(outline: np.ndarray) -> Sides:
    """Sides of an upright rectangle (4, 2), counter-clockwise; Refused for anything else."""
    d = np.roll(outline, -1, axis=0) - outline
    if len(outline) != 4 or np.any(np.abs(d[:, 0] * d[:, 1]) > 1e-6 * np.abs(d).max() ** 2):
        raise Refused("an upright rectangle as domain of biaxial compression")
    return Sides(int(np.argmax(d[:, 0])), int(np.argmax(d[:, 1])), int(np.argmin(d[:, 0])), int(np.argmin(d[:, 1])))
