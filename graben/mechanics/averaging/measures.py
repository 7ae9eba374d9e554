"""Scalars of an average stress-strain curve: modulus, Poisson's ratio, peak, dilation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MEASURES = ("secant_modulus", "poisson_ratio", "peak_stress", "strain_at_peak", "dilation")
"""Names of the scalars, in the order of `curve_measures`."""


def curve_measures(stress: Floats, strain: Floats, level: float = 0.5) -> Floats:
    """Scalars of one curve of vertical compression (yy), since its first state.

    The secant point is where the vertical compression first reaches `level` of its rise to the peak, by linear
    interpolation between saved states.

    Parameters
    ----------
    stress, strain : (time, 4) Pa and 1, xx yy zz xy, tension positive
    level : between 0 and 1

    Returns
    -------
    (5,) in the order of MEASURES: secant modulus (Pa) rise of compression over shortening at the secant point;
    Poisson's ratio there, lateral extension over shortening (in plane strain: the plane's own, nu / (1 - nu) for an
    isotropic solid); peak compression (Pa); shortening at the peak; dilation angle (rad) between secant point and
    peak, sin psi = (de_xx + de_yy) / (de_xx - de_yy). nan where a curve has no rise, or no path to the peak
    """
    if not 0.0 < level < 1.0:
        raise ValueError(f"the secant level must lie between 0 and 1, found {level}")
    push, shortening, lateral = -stress[:, 1], -(strain[:, 1] - strain[0, 1]), strain[:, 0] - strain[0, 0]
    peak = int(np.argmax(push))
    result = np.full(5, np.nan)
    result[2], result[3] = push[peak], shortening[peak]
    rise = push[peak] - push[0]
    if peak == 0 or rise <= 0.0:
        return result
    target = push[0] + level * rise
    k = int(np.argmax(push[: peak + 1] >= target))
    t = (target - push[k - 1]) / (push[k] - push[k - 1])
    short = shortening[k - 1] + t * (shortening[k] - shortening[k - 1])
    wide = lateral[k - 1] + t * (lateral[k] - lateral[k - 1])
    if short > 0.0:
        result[0], result[1] = level * rise / short, wide / short
    d_short, d_wide = shortening[peak] - short, lateral[peak] - wide
    if d_short > 0.0 and d_wide > 0.0:
        result[4] = np.arcsin((d_wide - d_short) / (d_wide + d_short))
    return result
