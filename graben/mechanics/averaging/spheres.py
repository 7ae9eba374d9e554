"""The same averages for spheres: Love-Weber stress and best-fit displacement gradient."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def love_weber(inside: Flags, centre: Floats, pair: Ints, force: Floats, point: Floats, volume: float) -> Floats:
    """Average stress of the spheres chosen: (1/V) sum over contacts of force (x) (contact - centre).

    A contact between two chosen spheres thereby counts its whole branch, one with a sphere or wall outside
    only the part up to the contact.

    Parameters
    ----------
    inside : (particle,) true for spheres inside the volume
    centre : (particle, 3) m
    pair : (contact, 2) particles; -1 in the second place for a wall
    force : (contact, 3) N on the first, its reverse on the second
    point : (contact, 3) m, where the force acts
    volume : m3, of the region

    Returns
    -------
    (3, 3) Pa, tension positive, not symmetrized (spheres that carry moments have an antisymmetric part)
    """
    if volume <= 0.0:
        raise Refused(f"the volume must be positive, found {volume}")
    total = np.zeros((3, 3))
    for side, sign in ((0, 1.0), (1, -1.0)):
        who = pair[:, side]
        chosen = (who >= 0) & inside[who]
        arm = point[chosen] - centre[who[chosen]]
        total += sign * np.einsum("ni,nj->ij", force[chosen], arm)
    return total / volume


def best_fit_gradient(position: Floats, displacement: Floats) -> Floats:
    """Displacement gradient du_i/dx_j that fits the displacements of sphere centres best (least squares).

    Parameters
    ----------
    position : (particle, d) m
    displacement : (..., particle, d) m

    Returns
    -------
    (..., d, d)

    Raises
    ------
    Refused : fewer spheres than needed, or all in one plane
    """
    x = position - position.mean(axis=0)
    u = displacement - displacement.mean(axis=-2, keepdims=True)
    spread = x.T @ x
    if position.shape[0] <= position.shape[1] or np.linalg.cond(spread) > 1e12:
        raise Refused(f"{position.shape[0]} spheres do not span the space: no strain can be fitted")
    drive = np.einsum("...ni,nj->...ij", u, x)
    return np.linalg.solve(spread, np.swapaxes(drive, -1, -2)).swapaxes(-1, -2)
