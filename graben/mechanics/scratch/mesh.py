"""Graded hexahedral mesh of the half specimen: fine under the path, coarse outside.

Axes: x along the scratch, y across (y = 0 is the plane of symmetry), z up (z = 0 is the free surface).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.elements.hex8 import CORNERS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class HexMesh:
    """Brick mesh on a tensor grid.

    points (n, 3) m; cells (e, 8) node numbers in VTK order; free (n, 3) 1 where a node may move, 0 where it is
    held; top (nx + 1, ny + 1) node numbers of the upper surface; x, y, z the grid lines.
    """

    points: Floats
    cells: Ints
    free: Floats
    top: Ints
    x: Floats
    y: Floats
    z: Floats


def graded_axis(start: float, stop: float, fine: tuple[float, float], size: float, growth: float) -> Floats:
    """Grid lines on [start, stop]: cells of about `size` within `fine`, growing by `growth` a cell outside.

    Raises
    ------
    Refused : sizes not positive, growth below 1, or the fine range not inside the axis
    """
    a, b = fine
    if not (size > 0.0 and growth >= 1.0 and start <= a < b <= stop):
        raise Refused(f"graded axis [{start}, {stop}]: fine range {fine}, size {size}, growth {growth}")
    count = max(1, round((b - a) / size))
    lines = np.linspace(a, b, count + 1)
    step = (b - a) / count
    return np.concatenate([a - _growing(a - start, step, growth)[::-1], lines, b + _growing(stop - b, step, growth)])


def cells_along(outside: float, fine: float, size: float, growth: float) -> float:
    """About as many cells as an axis gets: a fine range, and cells that grow on the rest of it."""
    rest = outside / size
    return fine / size + (rest if growth <= 1.0 else min(rest, math.log1p(rest * (growth - 1.0)) / math.log(growth)))


def _growing(length: float, first: float, growth: float) -> Floats:
    """Distances of grid lines beyond a fine range, ending exactly at `length`."""
    if length < 0.5 * first:
        return np.empty(0) if length <= 1e-9 * first else np.array([length])
    sizes: list[float] = []
    while sum(sizes) < length:
        sizes.append(first * growth ** (len(sizes) + 1))
    if len(sizes) > 1 and sum(sizes) - length > 0.6 * sizes[-1]:
        sizes.pop()
    lines = np.cumsum(sizes) * (length / sum(sizes))
    lines[-1] = length
    return lines


def brick(x: Floats, y: Floats, z: Floats) -> HexMesh:
    """Mesh on the grid lines x, y, z [m]; base, both ends and the far side held, y = 0 a plane of symmetry."""
    nx, ny, nz = len(x) - 1, len(y) - 1, len(z) - 1
    grid = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
    points = np.ascontiguousarray(grid.reshape(-1, 3))

    def number(i: Ints, j: Ints, k: Ints) -> Ints:
        return (i * (ny + 1) + j) * (nz + 1) + k

    i, j, k = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), np.arange(nz), indexing="ij"))
    cells = np.stack([number(i + a, j + b, k + c) for a, b, c in CORNERS], axis=1).astype(np.int64)
    free = np.ones_like(points)
    held = (points[:, 0] == x[0]) | (points[:, 0] == x[-1]) | (points[:, 1] == y[-1]) | (points[:, 2] == z[0])
    free[held] = 0.0
    free[points[:, 1] == y[0], 1] = 0.0
    ti, tj = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    top = number(ti, tj, np.full_like(ti, nz)).astype(np.int64)
    return HexMesh(points, np.ascontiguousarray(cells), free, top, x, y, z)


def specimen(
    length: float,
    half_width: float,
    thickness: float,
    start: float,
    path: float,
    contact_radius: float,
    size: float,
    growth: float = 1.25,
    growth_depth: float = 1.12,
) -> HexMesh:
    """Half specimen for a scratch from x = start over `path` with a contact of half-width `contact_radius`.

    The fine range reaches 1.6 contact radii around the path; `size` is the edge there, growth the ratio of
    neighbouring cells outside it, growth_depth the same from the surface down. All lengths in m.
    """
    reach = 1.6 * contact_radius
    x = graded_axis(0.0, length, (max(0.0, start - reach), min(length, start + path + reach)), size, growth)
    y = graded_axis(0.0, half_width, (0.0, min(reach, half_width)), size, growth)
    depth = graded_axis(0.0, thickness, (0.0, min(2.0 * size, thickness)), size, growth_depth)
    return brick(x, y, -depth[::-1])
