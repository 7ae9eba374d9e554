"""How many grains touch the tool: laws for contacts per unit area, by size class.

A mixture is described by diameters D_i (m) and volume shares theta_i that sum to 1, H (8.9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CountLaw:
    """N_i = a theta_i^alpha / D_i^2, H (8.10); alpha differs between the large and the small class.

    ratio_limits : diameter ratios that the exponents were found for (outside them a caller should warn)
    """

    name: str
    factor: float
    source: str
    ratio_limits: tuple[float, float]

    def exponents(self, ratio: float) -> tuple[float, float]:
        """alpha of the large and of the small class for D_large / D_small = ratio."""
        if self.name == "hoormazdi-2021":
            return 2.0 - 1.0 / ratio, 1.0 / ratio  # H (8.11a), (8.11b)
        return 1.33, 0.63


LAWS = {
    law.name: law
    for law in (
        CountLaw("hoormazdi-2021", 0.9, "H (8.7), (8.12): beds in small boxes with hard walls, shaken", (1.0, 3.0)),
        CountLaw("graben", 0.98, "our frictionless beds with periodic sides, not shaken, size ratio 2", (1.8, 2.2)),
    )
}


def contacts_per_area(law: str, diameter: Floats, share: Floats) -> Floats:
    """Contacts per unit area of each class (c,), 1/m2.

    diameter : (c,) m; share : (c,) volume shares that sum to 1. At most two classes may have a share.

    Raises
    ------
    ValueError : unknown law, arrays that do not match, shares that are no partition, or a third class
    """
    if law not in LAWS:
        raise ValueError(f"unknown law {law!r}; expected one of {', '.join(LAWS)}")
    d = np.asarray(diameter, dtype=np.float64)
    theta = np.asarray(share, dtype=np.float64)
    if d.ndim != 1 or d.shape != theta.shape or d.size == 0:
        raise ValueError(f"expected one diameter and one share per class, found shapes {d.shape} and {theta.shape}")
    if not np.all(np.isfinite(d) & (d > 0.0)):
        raise Refused(f"diameter: expected positive values, found {d.tolist()}")
    if not np.all(theta >= 0.0) or abs(float(theta.sum()) - 1.0) > 1e-6:
        raise Refused(f"share: expected values >= 0 with sum 1, found {theta.tolist()}")
    present = np.flatnonzero(theta > 0.0)
    if present.size > 2:
        raise Refused(f"{law} holds for one or two sizes; found {present.size} classes (count them in a bed)")
    out = np.zeros_like(d)
    if present.size == 1:
        out[present] = LAWS[law].factor / d[present] ** 2
        return out
    large, small = present[np.argsort(-d[present], kind="stable")]
    for i, alpha in zip((large, small), LAWS[law].exponents(float(d[large] / d[small]))):
        out[i] = LAWS[law].factor * theta[i] ** alpha / d[i] ** 2
    return out


def doubts(law: str, diameter: Floats, share: Floats) -> list[str]:
    """What speaks against using the law here, in words; empty when it was made for this mixture."""
    d = np.asarray(diameter)[np.asarray(share) > 0.0]
    if d.size != 2:
        return []
    low, high = LAWS[law].ratio_limits
    ratio = float(d.max() / d.min())
    if low <= ratio <= high:
        return []
    return [f"counts: law {law} was found for diameter ratios of {low:g} to {high:g}; this mixture has {ratio:.3g}"]
