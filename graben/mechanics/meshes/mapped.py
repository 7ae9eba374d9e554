"""Mapped multi-block mesher: convex quadrilateral patches, conforming and graded.

Each patch is meshed as a structured grid. Opposite sides of a patch carry the same number of elements, and a
side shared by two patches carries the same nodes, so numbers of elements propagate through rows of patches.
Along every side the nodes share out the wanted size evenly. Best element shapes, exact edges, and a refinement
that reaches from side to side; for outlines that do not fall into quadrilaterals see `paved.py`.
"""

from __future__ import annotations

import numpy as np

from graben.errors import Refused
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.meshes.one_body import sound
from graben.mechanics.meshes.sizing import SizeField, distance_to_segment


def mapped_mesh(corners: np.ndarray, patches: np.ndarray, size: SizeField) -> QuadMesh:
    """Mesh a domain made of convex quadrilateral patches.

    Parameters
    ----------
    corners : (c, 2) corner points of the patches, m
    patches : (p, 4) corner indices of each patch, in order around it (either sense)
    size : wanted element size

    Raises
    ------
    Refused : a patch is not convex, or a corner lies inside the side of another patch
    """
    corners = np.ascontiguousarray(corners, dtype=np.float64)
    patches = np.ascontiguousarray(patches, dtype=np.int64)
    if corners.ndim != 2 or corners.shape[1] != 2:
        raise ValueError(f"corners must have shape (c, 2), found {corners.shape}")
    if patches.ndim != 2 or patches.shape[1] != 4:
        raise ValueError(f"patches must have shape (p, 4), found {patches.shape}")
    if patches.size == 0 or patches.min() < 0 or patches.max() >= len(corners):
        raise Refused(f"patches must name corners 0 to {len(corners) - 1}")
    coarse = QuadMesh(corners, patches)
    turned = (coarse.areas() < 0)[:, None]
    patches = np.where(turned, patches[:, ::-1], patches)
    for number, quality in enumerate(QuadMesh(corners, patches).corner_quality()):
        if quality < 0.05:
            raise Refused(f"patch {number} is not a convex quadrilateral (corner sine {quality:.3g})")
    _refuse_hanging_corners(corners, patches)

    sides, side_of = _sides(patches)
    counts = _counts(corners, sides, side_of, size)
    nodes_t = [size.divide(corners[a], corners[b], n) for (a, b), n in zip(sides, counts)]

    # Global numbering: corners, then the inner nodes of sides, then the inner nodes of patches.
    first_on_side = len(corners) + np.concatenate([[0], np.cumsum(counts - 1)])
    points = [corners]
    points += [corners[a] + t[1:-1, None] * (corners[b] - corners[a]) for (a, b), t in zip(sides, nodes_t)]
    total = int(first_on_side[-1])
    quads = []
    for patch, own in zip(patches, side_of):
        grid, inner = _grid(corners, patch, own, sides, nodes_t, first_on_side, total)
        points.append(inner)
        total += len(inner)
        quads.append(np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4))
    all_points, all_quads = np.concatenate(points), np.concatenate(quads)
    used, inverse = np.unique(all_quads, return_inverse=True)  # corners that no patch uses are dropped
    mesh = QuadMesh(all_points[used], np.ascontiguousarray(inverse.reshape(all_quads.shape)))
    mesh = sound(mesh)
    return mesh


def _sides(patches: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unique sides (s, 2), lower corner first, and the four side numbers of each patch (p, 4)."""
    edges = np.stack([patches, np.roll(patches, -1, axis=1)], axis=2).reshape(-1, 2)
    sides, inverse = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return sides, inverse.reshape(-1, 4)


def _counts(corners: np.ndarray, sides: np.ndarray, side_of: np.ndarray, size: SizeField) -> np.ndarray:
    """Elements along each side: the largest number wanted in each row of patches."""
    group = np.arange(len(sides))
    changed = True
    while changed:
        before = group.copy()
        for own in side_of:
            for a, b in ((own[0], own[2]), (own[1], own[3])):
                group[a] = group[b] = min(group[a], group[b])
        changed = not np.array_equal(before, group)
    wanted = np.array([size.elements_along(corners[a], corners[b])[1][-1] for a, b in sides])
    return np.array(
        [max(1, int(np.ceil(wanted[group == g].max() - 1e-9))) for g in group],
        dtype=np.int64,
    )


def _grid(
    corners: np.ndarray,
    patch: np.ndarray,
    own: np.ndarray,
    sides: np.ndarray,
    nodes_t: list[np.ndarray],
    first_on_side: np.ndarray,
    first_inner: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Node numbers (m + 1, n + 1) of one patch and its inner points (k, 2)."""

    def along(local: int, start: int) -> tuple[np.ndarray, np.ndarray]:
        """Parameters and node numbers of a side, walked from the corner `start`."""
        side = own[local]
        a, b = sides[side]
        t = nodes_t[side]
        ids = np.concatenate([[a], first_on_side[side] + np.arange(len(t) - 2), [b]])
        return (t, ids) if a == start else (1.0 - t[::-1], ids[::-1])

    bottom, bottom_ids = along(0, patch[0])
    right, right_ids = along(1, patch[1])
    top, top_ids = along(2, patch[3])
    left, left_ids = along(3, patch[0])
    m, n = len(bottom) - 1, len(left) - 1
    # A grid line runs straight, in the unit square, between the matching nodes of opposite sides; nodes are
    # where two of them cross. The bilinear map then carries the square into the patch.
    skew_u, skew_v = (top - bottom)[:, None], (right - left)[None, :]
    u = (bottom[:, None] + left[None, :] * skew_u) / (1.0 - skew_u * skew_v)
    v = left[None, :] + u * skew_v
    p = corners[patch]
    xy = (
        ((1 - u) * (1 - v))[..., None] * p[0]
        + (u * (1 - v))[..., None] * p[1]
        + (u * v)[..., None] * p[2]
        + ((1 - u) * v)[..., None] * p[3]
    )
    ids = np.empty((m + 1, n + 1), dtype=np.int64)
    ids[1:-1, 1:-1] = first_inner + np.arange((m - 1) * (n - 1)).reshape(m - 1, n - 1)
    ids[:, 0], ids[:, -1], ids[0, :], ids[-1, :] = bottom_ids, top_ids, left_ids, right_ids
    return ids, xy[1:-1, 1:-1].reshape(-1, 2)


def _refuse_hanging_corners(corners: np.ndarray, patches: np.ndarray) -> None:
    used = np.unique(patches)
    reach = np.hypot(*np.ptp(corners, axis=0))
    sides, _ = _sides(patches)
    for a, b in sides:
        others = used[(used != a) & (used != b)]
        close = distance_to_segment(corners[others], corners[a], corners[b]) < 1e-9 * reach
        if np.any(close):
            raise Refused(
                f"corner {others[close][0]} lies on the side from corner {a} to corner {b}: "
                "patches must meet along whole sides"
            )
