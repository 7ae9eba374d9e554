"""Representative elementary volumes in the plane: circles and polygons, and how blocks lie to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.averaging.network import Network
from graben.mechanics.plane.rings import refuse_crossing

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Rev(Protocol):
    """A region that blocks can intersect."""

    @property
    def centre(self) -> tuple[float, float]: ...

    @property
    def radius(self) -> float: ...

    def crossed(self, network: Network, position: Floats) -> Flags:
        """(block,) true where the region's boundary runs through the block."""
        ...

    def contains(self, points: Floats) -> Flags:
        """(n,) true where a point (n, 2) lies in the region."""
        ...

    def outside_by(self, outline: Floats) -> float:
        """How far (m) the region reaches beyond a closed curve (n, 2); 0 when it lies inside."""
        ...


@dataclass(frozen=True)
class Circle:
    """A circular region: centre and radius in m."""

    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0.0 and np.isfinite(self.centre).all()):
            raise Refused(f"a circle needs a finite centre and a positive radius, found {self.centre}, {self.radius}")

    def crossed(self, network: Network, position: Floats) -> Flags:
        centre = np.asarray(self.centre)
        a, b = position[network.edge[:, 0]], position[network.edge[:, 1]]
        nearest = np.full(network.block_count, np.inf)
        np.minimum.at(nearest, network.edge_block, segment_distance(centre[None, :], a, b))
        farthest = np.zeros(network.block_count)
        np.maximum.at(farthest, network.edge_block, np.hypot(*(a - centre).T))
        nearest[blocks_with_point(network, position, centre)] = 0.0
        return (nearest < self.radius) & (farthest > self.radius)

    def contains(self, points: Floats) -> Flags:
        return np.hypot(points[:, 0] - self.centre[0], points[:, 1] - self.centre[1]) <= self.radius

    def outside_by(self, outline: Floats) -> float:
        centre = np.asarray(self.centre)[None, :]
        distance = float(segment_distance(centre, outline, np.roll(outline, -1, axis=0)).min())
        inside = bool(in_polygon(centre, outline)[0])
        return max(0.0, self.radius - distance if inside else self.radius + distance)


@dataclass(frozen=True)
class Polygon:
    """A simple polygon: (n, 2) corners in m, in either sense."""

    corners: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        points = self.points
        if points.ndim != 2 or points.shape[0] < 3 or points.shape[1] != 2 or not np.isfinite(points).all():
            raise Refused("a polygon needs at least three corners, each with two finite coordinates")
        refuse_crossing(points)

    @property
    def points(self) -> Floats:
        return np.asarray(self.corners, dtype=np.float64)

    @property
    def centre(self) -> tuple[float, float]:
        """Centroid of the area."""
        p = self.points
        q = np.roll(p, -1, axis=0)
        cross = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
        x, y = ((p + q) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())
        return float(x), float(y)

    @property
    def radius(self) -> float:
        """Radius of the circle of equal area."""
        return float(np.sqrt(abs(polygon_area(self.points)) / np.pi))

    def crossed(self, network: Network, position: Floats) -> Flags:
        a, b = position[network.edge[:, 0]], position[network.edge[:, 1]]
        crossed = np.zeros(network.block_count, dtype=bool)
        points = self.points
        # What is nearer than this lies on a side; far from zero coordinates have fewer digits.
        near = max(1e-9 * self.radius, 4.0 * np.finfo(float).eps * float(np.abs(position).max()))
        for p, q in zip(points, np.roll(points, -1, axis=0)):
            crossed[network.edge_block[segments_cross(a, b, p, q)]] = True
            # A corner on the joint between two blocks lies in neither.
            for block in blocks_with_point(network, position, p):
                rim = slice(*network.edge_offset[[block, block + 1]])
                crossed[block] |= segment_distance(p[None, :], a[rim], b[rim]).min() > near
        # Corners on both sides: also where the polygon's side runs exactly through corners of the block.
        start = position[network.edge[:, 0]]
        ends = np.roll(points, -1, axis=0)
        clear = np.min([segment_distance(start, p[None, :], q[None, :]) for p, q in zip(points, ends)], axis=0)
        clear = clear > near
        within = in_polygon(start, points)
        block = network.edge_block
        count = network.block_count
        some_in = np.bincount(block, clear & within, minlength=count) > 0
        some_out = np.bincount(block, clear & ~within, minlength=count) > 0
        return crossed | (some_in & some_out)

    def contains(self, points: Floats) -> Flags:
        return in_polygon(points, self.points)

    def outside_by(self, outline: Floats) -> float:
        corners = self.points
        closing = np.roll(outline, -1, axis=0)
        out = ~in_polygon(corners, outline)
        distance = np.array([segment_distance(p[None, :], outline, closing).min() for p in corners])
        worst = float(distance[out].max()) if out.any() else 0.0
        # An outline that bends into the polygon between its corners.
        inside = in_polygon(outline, corners)
        if inside.any():
            ends = np.roll(corners, -1, axis=0)
            depth = [segment_distance(p[None, :], corners, ends).min() for p in outline[inside]]
            worst = max(worst, float(np.max(depth)))
        return worst


def polygon_area(points: Floats) -> float:
    """Signed area of a closed polygon (n, 2), counter-clockwise positive, Y (2.5)."""
    x, y = points[:, 0], points[:, 1]
    return 0.5 * float(np.sum(x * (np.roll(y, -1) - np.roll(y, 1))))


def segment_distance(point: Floats, a: Floats, b: Floats) -> Floats:
    """Distance (n,) of points (n or 1, 2) from segments a-b (n, 2)."""
    along = b - a
    size = np.maximum((along * along).sum(axis=1), 1e-300)
    t = np.clip(((point - a) * along).sum(axis=1) / size, 0.0, 1.0)
    away = point - a - t[:, None] * along
    return np.hypot(away[:, 0], away[:, 1])


def in_polygon(points: Floats, polygon: Floats) -> Flags:
    """(n,) true where points (n, 2) lie inside a closed polygon (m, 2): a ray crosses it an odd number of times."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    x, y = points[:, 0:1], points[:, 1:2]
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])
    hits = spans & (x < a[:, 0] + (y - a[:, 1]) * ((b[:, 0] - a[:, 0]) / rise))
    return hits.sum(axis=1) % 2 == 1


def blocks_with_point(network: Network, position: Floats, point: Floats) -> NDArray[np.int64]:
    """Blocks that a point (2,) lies in (several where blocks overlap)."""
    a, b = position[network.edge[:, 0]], position[network.edge[:, 1]]
    spans = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])
    hits = spans & (point[0] < a[:, 0] + (point[1] - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise)
    odd = np.bincount(network.edge_block[hits], minlength=network.block_count) % 2 == 1
    return np.flatnonzero(odd)


def segments_cross(a: Floats, b: Floats, p: Floats, q: Floats) -> Flags:
    """(n,) true where segments a-b (n, 2) properly cross the segment p-q, or segments p-q (n, 2)."""

    def side(u: Floats, v: Floats, w: Floats) -> Floats:
        return (v[..., 0] - u[..., 0]) * (w[..., 1] - u[..., 1]) - (v[..., 1] - u[..., 1]) * (w[..., 0] - u[..., 0])

    return (side(a, b, p) * side(a, b, q) < 0.0) & (side(p, q, a) * side(p, q, b) < 0.0)
