"""A mesh of 4-node quadrilaterals, and the questions that the solver asks of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.meshes.sizing import distance_to_segment


@dataclass(frozen=True)
class QuadMesh:
    """Nodes and quadrilaterals; corners counter-clockwise.

    Parameters
    ----------
    points : (n, 2) float, m
    quads : (e, 4) int
    """

    points: np.ndarray
    quads: np.ndarray

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 2:
            raise Refused(f"points must have shape (n, 2), found {self.points.shape}")
        if self.quads.ndim != 2 or self.quads.shape[1] != 4 or len(self.quads) == 0:
            raise Refused(f"quads must have shape (e, 4) with e > 0, found {self.quads.shape}")
        if not np.all(np.isfinite(self.points)):
            raise Refused("points must be finite")
        if self.quads.min() < 0 or self.quads.max() >= len(self.points):
            raise Refused(f"quads name node {self.quads.max()} of {len(self.points)}")

    def areas(self) -> np.ndarray:
        """Area of each quadrilateral (e,), m2; negative where the corners run clockwise."""
        c = self.points[self.quads]
        d1, d2 = c[:, 2] - c[:, 0], c[:, 3] - c[:, 1]
        return 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])

    def corner_quality(self) -> np.ndarray:
        """Smallest sine of the corner angles of each element (e,); 1 for a rectangle, <= 0 when not convex."""
        c = self.points[self.quads]
        ahead = np.roll(c, -1, axis=1) - c
        back = np.roll(c, 1, axis=1) - c
        cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
        lengths = np.hypot(ahead[..., 0], ahead[..., 1]) * np.hypot(back[..., 0], back[..., 1])
        return (cross / np.where(lengths > 0, lengths, 1.0)).min(axis=1)

    def boundary_edges(self) -> np.ndarray:
        """Edges (b, 2) that belong to one element only, with the material on their left."""
        edges = np.stack([self.quads, np.roll(self.quads, -1, axis=1)], axis=2).reshape(-1, 2)
        _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
        if np.any(count > 2):
            raise Refused("an edge belongs to more than two elements")
        return edges[np.sort(first[count == 1])]

    def diameter(self) -> float:
        """Diagonal of the bounding box, m."""
        return float(np.hypot(*np.ptp(self.points, axis=0)))

    def nodes_on_segment(self, start: np.ndarray, end: np.ndarray, tolerance: float = 1e-6) -> np.ndarray:
        """Nodes on the segment, ordered from `start` to `end`; tolerance relative to the mesh's diameter."""
        along = np.asarray(end, dtype=float) - np.asarray(start, dtype=float)
        near = distance_to_segment(self.points, start, end) <= tolerance * self.diameter()
        nodes = np.flatnonzero(near)
        return nodes[np.argsort((self.points[nodes] - start) @ along, kind="stable")]
