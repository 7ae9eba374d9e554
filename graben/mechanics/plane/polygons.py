"""Plain polygon geometry: area, centroid, point in polygon, clipping by half-planes."""

from __future__ import annotations

import numpy as np


def signed_area(polygon: np.ndarray) -> float:
    """Area of a polygon (n, 2), positive when its corners run counter-clockwise [m2]."""
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def areas_and_centroids(points: np.ndarray, start: np.ndarray, corner: np.ndarray):
    """Signed area (n,) and centroid (n, 2) of ragged polygons.

    points : (p, 2); corner : indices into points, polygon k is corner[start[k]:start[k + 1]].
    """
    first = start[:-1]
    origin = points[corner[first]]
    owner = np.repeat(np.arange(len(first)), np.diff(start))
    following = np.arange(1, len(corner) + 1)
    following[start[1:] - 1] = first
    a = points[corner] - origin[owner]
    b = points[corner[following]] - origin[owner]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * np.add.reduceat(cross, first)
    moment = np.add.reduceat((a + b) * cross[:, None], first, axis=0)
    return area, origin + moment / (6.0 * area)[:, None]


def inside(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Which of the points (n, 2) lie inside a simple polygon (m, 2), by the crossing number."""
    px, py = points[:, 0], points[:, 1]
    result = np.zeros(len(points), dtype=bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        if ay == by:
            continue
        straddles = (ay > py) != (by > py)
        result ^= straddles & (px < ax + (py - ay) * (bx - ax) / (by - ay))
    return result


def distance_to_sides(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Distance (n, m) of points (n, 2) to each side (from corner k to k + 1) of a polygon (m, 2) [m]."""
    a = polygon
    d = np.roll(polygon, -1, axis=0) - a
    r = points[:, None, :] - a[None]
    along = np.clip((r * d).sum(-1) / (d * d).sum(-1), 0.0, 1.0)
    return np.linalg.norm(r - along[..., None] * d[None], axis=-1)


def clip_to_convex(subject: np.ndarray, window: np.ndarray) -> np.ndarray:
    """The part of a simple polygon that lies in a convex counter-clockwise window (Sutherland-Hodgman).

    A result in several pieces comes back joined by edges of zero width; callers check areas.
    """
    result = [tuple(p) for p in subject]
    for (ax, ay), (bx, by) in zip(window, np.roll(window, -1, axis=0)):
        if not result:
            break
        dx, dy = bx - ax, by - ay
        side = [dx * (y - ay) - dy * (x - ax) for x, y in result]
        kept = []
        for k, p in enumerate(result):
            q, sp, sq = result[k - 1], side[k], side[k - 1]
            if (sp >= 0.0) != (sq >= 0.0):
                f = sq / (sq - sp)
                kept.append((q[0] + f * (p[0] - q[0]), q[1] + f * (p[1] - q[1])))
            if sp >= 0.0:
                kept.append(p)
        result = kept
    return np.array(result).reshape(-1, 2)
