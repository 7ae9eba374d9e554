"""Closed rings of corners that users give: outlines, holes, regions, blocks. Lengths decide, not where they lie."""

from __future__ import annotations

import re

import numpy as np

from graben.errors import Refused

# Two edges of which one turns less from the other lie in one line [rad].
STRAIGHT = 1e-6


def refuse_crossing(polygon: np.ndarray, origin: np.ndarray | None = None) -> None:
    """Raise Refused, with the place [m], where sides of a polygon (m, 2) cross or touch beside their common corners.

    Corners may lie in one line. origin : (2,) what the corners count from, for the message
    """
    import shapely

    if len(polygon) < 3:
        raise Refused("a polygon of at least three corners")
    shape = shapely.Polygon(polygon)
    if not shapely.is_valid(shape):
        found = re.search(r"\[(\S+) (\S+)\]", shapely.is_valid_reason(shape))
        at = np.array(found.groups(), dtype=float) if found else polygon[0]
        raise Refused(f"a simple polygon; its sides cross or touch at {place(at, origin)}")


def place(point: np.ndarray, origin: np.ndarray | None = None) -> str:
    """A point (2,) [m] in words; origin : (2,) what it counts from."""
    x, y = point if origin is None else point + origin
    return f"({x:.10g}, {y:.10g})"


def without_repeats(polygon: np.ndarray) -> np.ndarray:
    """Corners (k, 2) of a polygon (m, 2) without those that repeat the one before."""
    size = float(np.ptp(polygon, axis=0).max())
    return polygon[np.hypot(*(polygon - np.roll(polygon, 1, axis=0)).T) > 1e-9 * size]


def turning_corners(polygon: np.ndarray) -> np.ndarray:
    """Corners (k, 2) of a polygon (m, 2) without those that repeat another one or lie on a straight side."""
    ring = without_repeats(polygon)
    back, ahead = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
    straight = (np.abs(cross) <= STRAIGHT * np.hypot(*back.T) * np.hypot(*ahead.T)) & ((back * ahead).sum(1) > 0.0)
    return ring[~straight]
