"""Element size wanted at each place: a background size, smaller near given segments, growing linearly away."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from graben.errors import Refused

# Spacing of the samples along a line, as a part of the smallest size that can occur on it.
_SAMPLES_PER_ELEMENT = 8


@dataclass(frozen=True)
class SizeField:
    """Wanted element edge h(x) = min(size, min_k(near_size_k + growth_k * distance to segment k)).

    Parameters
    ----------
    size : background size, m
    segments : (k, 2, 2) end points of the segments near which elements are smaller, m (a point: equal ends)
    near_size : (k,) size at each segment, m
    growth : (k,) growth of the size per metre of distance
    """

    size: float
    segments: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 2)))
    near_size: np.ndarray = field(default_factory=lambda: np.zeros(0))
    growth: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not self.size > 0 or np.any(np.asarray(self.near_size) <= 0) or np.any(np.asarray(self.growth) < 0):
            raise Refused("element sizes must be positive and growth not negative")
        if len(self.segments) != len(self.near_size) or len(self.segments) != len(self.growth):
            raise ValueError("segments, near_size and growth must have one entry per refinement")

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Size at points (n, 2), m; returns (n,)."""
        points = np.asarray(points, dtype=float)
        size = np.full(len(points), float(self.size))
        for (start, end), near, growth in zip(self.segments, self.near_size, self.growth):
            distance = distance_to_segment(points, start, end)
            np.minimum(size, near + growth * distance, out=size)
        return size

    def smallest(self) -> float:
        """The smallest size that can occur anywhere, m."""
        return float(min([self.size, *self.near_size]))

    def elements_along(self, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Parameter t in [0, 1] along a line and the number of elements that fit from its start to t."""
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        length = float(np.hypot(*(end - start)))
        count = int(np.clip(_SAMPLES_PER_ELEMENT * length / self.smallest(), 64, 20000))
        t = np.linspace(0.0, 1.0, count + 1)
        middle = 0.5 * (t[1:] + t[:-1])
        density = length / self(start + middle[:, None] * (end - start))
        return t, np.concatenate([[0.0], np.cumsum(density * np.diff(t))])

    def divide(self, start: np.ndarray, end: np.ndarray, count: int) -> np.ndarray:
        """Parameters (count + 1,) of the nodes that share out a line evenly in units of the local size."""
        t, elements = self.elements_along(start, end)
        nodes = np.interp(np.linspace(0.0, elements[-1], count + 1), elements, t)
        nodes[0], nodes[-1] = 0.0, 1.0
        return nodes


def distance_to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance of points (n, 2) to the segment from `start` to `end`; returns (n,)."""
    points, start, end = (np.asarray(a, dtype=float) for a in (points, start, end))
    along = end - start
    square = float(along @ along)
    t = np.clip(((points - start) @ along) / square, 0.0, 1.0) if square > 0 else np.zeros(len(points))
    return np.hypot(*(points - start - t[:, None] * along).T)
