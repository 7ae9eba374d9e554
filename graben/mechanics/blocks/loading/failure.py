"""The load that a body bears at rest, read from a test that went past it.

A test of finite speed shows more: what moves has inertia and is damped. Both are known along the way, so their
share of the load can be taken off. With P = dF/ds . v the power of the load per unit of it, and R the power that
inertia and damping take up, the load in balance with the rock alone is s - R / P, both averaged over a stretch.

Friction that grows with the load takes up a part of what the load is too large by: s - R / P then is too high. On a
plane of slope a, R / P is the share 1 - tan(phi) / tan(a) of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Averages of inertia are taken over this share of the way so far, half of it before and half behind.
_STRETCH = 0.05

# What friction may hide, over what inertia and damping were seen to bear: enough where R / P is a third of it.
_HIDDEN = 2.0

# Two looks are far apart if their loads differ by this share.
_APART = 0.1

# Steps over which a speed is a mean.
_SPEED = 200


class Failure(NamedTuple):
    """In units of the load: what is borne at rest, an interval that holds it, and the index of the look there.

    inertia : what inertia and damping bear at that look
    """

    load: float
    low: float
    high: float
    look: int
    inertia: float = 0.0


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
    """The largest static load of a test, with its interval; arguments as in `static_load`.

    high is the largest load of the test; low lies twice as far below the static one, for what friction hides.
    """
    static = static_load(load, way, resisted)
    look = int(np.argmax(static))
    most, largest = float(static[look]), float(load.max())
    return Failure(most, most - _HIDDEN * (largest - most), largest, look, float(load[look]) - most)


def loss_of_balance(load: np.ndarray, step: np.ndarray, balanced: int, out: int, lost: int, share: float) -> Failure:
    """The load at which a block loses its balance, between a look at which it had it and one at which it had not.

    What moves it grows with the load from there on, and so does the share of it that inertia and damping take up.
    Where the two looks are far apart, the load lies between them: the block does not tell more.

    Parameters
    ----------
    load, step : (n,) at each look
    balanced, out, lost : steps at which it was last in balance, was out of it, and had lost it beyond doubt
    share : what inertia and damping took up at the first over what they took up at the second
    """
    look, after, last = (int(np.clip(np.searchsorted(step, s), 0, len(step) - 1)) for s in (balanced, out, lost))
    there, beyond = float(load[look]), float(load[after])
    high = float(load[look : max(last, look) + 1].max())
    if beyond - there > _APART * abs(beyond):
        return Failure(beyond, there, high, after)
    most = there - share / (1.0 - share) * max(beyond - there, 0.0)
    return Failure(most, 2.0 * most - high, high, look)


def tenfold_speed(load: np.ndarray, way: np.ndarray, step: np.ndarray) -> float | None:
    """The load at which the way first grew ten times as fast as it did at first; None where it never did.

    Arguments as above. The first speed is the mean one up to a twentieth of the largest load.
    """
    apart = np.flatnonzero(np.diff(step // _SPEED, prepend=-1.0))
    if len(apart) < 3 or not load.max() > 0.0:
        return None
    load, way, step = load[apart], way[apart], step[apart]
    k = max(1, int(np.argmax(load >= 0.05 * load.max())))
    first = (way[k] - way[0]) / (step[k] - step[0])
    fast = np.diff(way[k:]) > 10.0 * first * np.diff(step[k:])
    return float(load[k:][int(np.argmax(fast))]) if first > 0.0 and fast.any() else None
