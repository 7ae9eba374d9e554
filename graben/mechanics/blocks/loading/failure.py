"""The load that a body bears at rest, read from a test that went past it.

A test of finite speed shows more: what moves has inertia and is damped. Both are known along the way, so their
share of the load can be taken off. With P = dF/ds . v the power of the load per unit of it, and R the power that
inertia and damping take up, the load in balance with the rock alone is s - R / P, both averaged over a stretch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Averages of inertia are taken over this share of the way so far, half of it before and half behind.
_STRETCH = 0.05

# What a test repeated with other steps differs by, where inertia has no share in it.
_REPEATS = 0.005


class Failure(NamedTuple):
    """In units of the load: what is borne at rest, an interval that holds it, and the index of the look there.

    high is the largest load of the test; low lies as far below what is borne at rest as high lies above it.
    """

    load: float
    low: float
    high: float
    look: int


def static_load(load: np.ndarray, way: np.ndarray, resisted: np.ndarray) -> np.ndarray:
    """Load (n,) in balance with the rock alone, never more than the load itself.

    Parameters
    ----------
    load : (n,) at each look; way : (n,) work of a load of one, P summed over time; resisted : (n,) R summed over time
    """
    farthest = np.maximum.accumulate(way)
    first = np.searchsorted(farthest, (1.0 - 0.5 * _STRETCH) * farthest)
    last = np.minimum(np.searchsorted(farthest, (1.0 + 0.5 * _STRETCH) * farthest), len(way) - 1)
    gone = way[last] - way[first]
    share = np.divide(resisted[last] - resisted[first], gone, out=np.zeros_like(gone), where=gone > 0.0)
    return load - np.maximum(share, 0.0)


def failure_of(load: np.ndarray, way: np.ndarray, resisted: np.ndarray) -> Failure:
    """The largest static load of a test, with its interval; arguments as in `static_load`."""
    static = static_load(load, way, resisted)
    look = int(np.argmax(static))
    most, largest = float(static[look]), float(load.max())
    slack = _REPEATS * abs(most)
    return Failure(most, 2.0 * most - largest - slack, largest + slack, look)
