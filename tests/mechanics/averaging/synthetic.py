"""Blocks with known geometry for the tests of averages: Voronoi cells, bricks, chamfered corners, fine sides."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import Voronoi

from graben.mechanics.averaging.network import Network, build_network


@dataclass
class Model:
    position: np.ndarray
    vertex_block: np.ndarray
    zone_vertex: np.ndarray
    zone_block: np.ndarray
    corner_count: np.ndarray
    corner: np.ndarray

    @property
    def block_count(self) -> int:
        return self.corner_count.size

    @property
    def rings(self) -> list[np.ndarray]:
        return np.split(self.corner, np.cumsum(self.corner_count)[:-1])

    def network(self, position=None, **options) -> Network:
        place = self.position if position is None else position
        return build_network(
            place, self.block_count, self.zone_vertex, self.zone_block, self.corner_count, self.corner, **options
        )


def from_polygons(polygons: list[np.ndarray], fine: bool = False, zones: bool = True) -> Model:
    """Blocks from convex polygons. fine: a grid point in the middle of each side and one inside each block."""
    position, block, triangles, triangle_block, count, corner = [], [], [], [], [], []
    for b, p in enumerate(polygons):
        first, n = len(position), len(p)
        ring = p
        if fine:
            ring = np.stack([p, 0.5 * (p + np.roll(p, -1, axis=0))], axis=1).reshape(-1, 2)
        position.extend(ring)
        m = len(ring)
        if fine:
            position.append(p.mean(axis=0))
            fan = [(first + m, first + k, first + (k + 1) % m) for k in range(m)]
        else:
            fan = [(first, first + k, first + k + 1) for k in range(1, m - 1)]
        block.extend([b] * (len(position) - first))
        if zones:
            triangles.extend(fan)
            triangle_block.extend([b] * len(fan))
        count.append(n)
        corner.extend(range(first, first + m, 2 if fine else 1))
    return Model(
        np.asarray(position, dtype=float),
        np.asarray(block, dtype=np.int64),
        np.asarray(triangles, dtype=np.int64).reshape(-1, 3),
        np.asarray(triangle_block, dtype=np.int64),
        np.asarray(count, dtype=np.int64),
        np.asarray(corner, dtype=np.int64),
    )


def voronoi_polygons(count: int, size: float, seed: int, lloyd: int = 3) -> list[np.ndarray]:
    """Voronoi cells of a square; mirrored seeds make its sides exact."""
    rng = np.random.Generator(np.random.PCG64(seed))
    points = rng.uniform(0.0, size, (count, 2))
    for _ in range(lloyd + 1):
        mirrored = [points]
        for axis in (0, 1):
            for wall in (0.0, size):
                image = points.copy()
                image[:, axis] = 2.0 * wall - image[:, axis]
                mirrored.append(image)
        cells = Voronoi(np.concatenate(mirrored))
        polygons = []
        for k in range(count):
            ring = cells.vertices[cells.regions[cells.point_region[k]]]
            around = ring - ring.mean(axis=0)
            polygons.append(ring[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])
        points = np.array([p.mean(axis=0) for p in polygons])
    return polygons


def bricks(nx: int, ny: int, width: float, height: float) -> list[np.ndarray]:
    """Running bond: every second row shifted by half a brick, half bricks at its ends. Only edge T-contacts."""
    polygons = []
    for row in range(ny):
        cuts = np.arange(nx + 1) * width
        if row % 2:
            cuts = np.concatenate([[0.0], cuts[:-1] + 0.5 * width, [nx * width]])
        for a, b in pairwise(cuts):
            y0, y1 = row * height, (row + 1) * height
            polygons.append(np.array([[a, y0], [b, y0], [b, y1], [a, y1]]))
    return polygons


def chamfered(polygons: list[np.ndarray], cut: float) -> list[np.ndarray]:
    """Every corner cut off at the distance `cut` along both of its sides (at most 0.3 of them)."""
    result = []
    for p in polygons:
        ahead, back = np.roll(p, -1, axis=0) - p, np.roll(p, 1, axis=0) - p
        fa = np.minimum(cut / np.hypot(*ahead.T), 0.3)[:, None]
        fb = np.minimum(cut / np.hypot(*back.T), 0.3)[:, None]
        result.append(np.stack([p + fb * back, p + fa * ahead], axis=1).reshape(-1, 2))
    return result


def separate(model: Model, seed: int, shift: float, turn: float) -> np.ndarray:
    """Displacement that moves and turns each block on its own: joints open and slide."""
    rng = np.random.Generator(np.random.PCG64(seed))
    move = rng.normal(0.0, shift, (model.block_count, 2))[model.vertex_block]
    angle = rng.normal(0.0, turn, model.block_count)[model.vertex_block]
    middle = np.array([model.position[ring].mean(axis=0) for ring in model.rings])[model.vertex_block]
    arm = model.position - middle
    return move + angle[:, None] * np.stack([-arm[:, 1], arm[:, 0]], axis=1)


def plain_outline(model: Model, chosen: np.ndarray, tolerance: float = 1e-9):
    """Reference for conforming blocks: sides of chosen blocks that no other chosen block has. Slow and obvious.

    Returns a list of (start vertex, end vertex).
    """
    sides = [
        (int(a), int(b)) for k, ring in enumerate(model.rings) if chosen[k] for a, b in zip(ring, np.roll(ring, -1))
    ]
    x = model.position
    lone = []
    for a, b in sides:
        shared = any(np.hypot(*(x[a] - x[d])) < tolerance and np.hypot(*(x[b] - x[c])) < tolerance for c, d in sides)
        if not shared:
            lone.append((a, b))
    return lone


def plain_gradient(sides, position, displacement, area):
    """Reference of Y (2.13): one side after the other."""
    total = np.zeros((2, 2))
    for a, b in sides:
        dx, dy = position[b] - position[a]
        mean = 0.5 * (displacement[a] + displacement[b])
        total += np.outer(mean, [dy, -dx])
    return total / area
