"""Random insertion: spheres that do not touch, largest first, uniformly over a column."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graben.errors import NumericsFailed, Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.particles.neighbours import grid_shape


@kernel
def try_places(draws, radius, begin, width, height, periodic, counts, size, head, following, x):
    """Place particles begin, begin + 1, ... at the next fitting draw each; returns (next particle, draws used)."""
    n = radius.shape[0]
    i = begin
    cell = np.zeros(3, np.int64)
    for q in range(draws.shape[0]):
        if i == n:
            return i, q
        r = radius[i]
        margin = 0.0 if periodic else r
        x[i, 0] = margin + draws[q, 0] * (width[0] - 2.0 * margin)
        x[i, 1] = margin + draws[q, 1] * (width[1] - 2.0 * margin)
        x[i, 2] = r + draws[q, 2] * (height - 2.0 * r)
        for a in range(3):
            cell[a] = min(np.int64(x[i, a] / size[a]), counts[a] - 1)
        free = True
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                for dz in range(-1, 2):
                    cx, cy, cz = cell[0] + dx, cell[1] + dy, cell[2] + dz
                    if cz < 0 or cz >= counts[2]:
                        continue
                    if periodic:
                        cx, cy = cx % counts[0], cy % counts[1]
                    elif cx < 0 or cx >= counts[0] or cy < 0 or cy >= counts[1]:
                        continue
                    j = head[(cx * counts[1] + cy) * counts[2] + cz]
                    while free and j >= 0:
                        d2 = 0.0
                        for a in range(3):
                            g = x[j, a] - x[i, a]
                            if periodic and a < 2:
                                g -= width[a] * np.rint(g / width[a])
                            d2 += g * g
                        if d2 < (r + radius[j]) ** 2:
                            free = False
                        j = following[j]
        if free:
            c = (cell[0] * counts[1] + cell[1]) * counts[2] + cell[2]
            following[i] = head[c]
            head[c] = i
            i += 1
    return i, draws.shape[0]


def insert(
    radius: NDArray[np.float64],
    width: tuple[float, float],
    height: float,
    rng: np.random.Generator,
    *,
    periodic: bool = True,
) -> NDArray[np.float64]:
    """Positions (n, 3) m of spheres with the given radii (n,) m, none touching, in a column of that height.

    radius must not increase along the array: small grains fill the space that large ones leave.
    Raises NumericsFailed when no room is found after 2,000 draws per particle.
    """
    radius = np.ascontiguousarray(radius, dtype=np.float64)
    if radius.size == 0 or np.any(np.diff(radius) > 0.0):
        raise ValueError("radius: expected at least one radius, in falling order")
    sides = np.array(width, dtype=np.float64)
    if height <= 2.0 * radius[0]:
        raise Refused(f"height: expected more than one grain, {2.0 * radius[0]:.6g} m, found {height:.6g} m")
    extent = np.array([*sides, height])
    counts = grid_shape(extent, 2.0 * radius[0])
    head = np.full(int(np.prod(counts)), -1, np.int64)
    following = np.full(radius.size, -1, np.int64)
    x = np.zeros((radius.size, 3))
    placed, budget = 0, 2000 * radius.size
    while placed < radius.size:
        draws = rng.random((min(20_000, max(1000, radius.size)), 3))
        placed, used = try_places(
            draws, radius, placed, sides, height, periodic, counts, extent / counts, head, following, x
        )
        budget -= used
        if budget < 0 and placed < radius.size:
            raise NumericsFailed(
                f"found room for {placed} of {radius.size} particles",
                advice="insert into a taller column (lower loose_fraction)",
            )
    return x
