"""Coordinates counted from a corner of the body where it lies far from zero, as in a national grid.

Products of coordinates of millions of metres leave few digits for lengths of metres. Geometry and mechanics therefore
count from an origin beside the body, and results go back to the user's coordinates when they are written.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# A body farther from zero than this many times its own size counts from its lower left corner.
_FAR = 100.0


def local_origin(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Origin (2,) [m] to count points (n, 2) from: zero where they lie near it, else the corner of their box."""
    low, high = points.min(axis=0), points.max(axis=0)
    far = float(np.abs(points).max()) > _FAR * float((high - low).max())
    return low.copy() if far else np.zeros(2)
