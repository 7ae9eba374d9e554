"""Given polygons made fit for blocks: shared points, slivers merged, short edges collapsed, outline found.

The rule: a block with less than `smallest` of the median area, or whose width (area over longest diagonal) is below
`thinnest`, is merged into the neighbour with which it shares the longest boundary, smallest first; then edges below
`shortest` are collapsed as in `tessellation.collapse_short_edges`; then corners that do not turn are dropped.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.spatial import cKDTree

from graben.mechanics.blocks import polygons
from graben.mechanics.blocks.tessellation import Tessellation, collapse_short_edges, from_rings, shared_points

_STRAIGHT = 1e-6


def mend(shapes: list[np.ndarray], *, shortest: float, thinnest: float, smallest: float = 0.02) -> Tessellation:
    """Blocks from polygons (m, 2) [m] that fill a domain without overlaps. ValueError where they do not.

    shortest, thinnest : [m]; smallest : share of the median area
    """
    shapes = [s if polygons.signed_area(s) > 0.0 else s[::-1] for s in (np.asarray(s, float) for s in shapes)]
    for k, shape in enumerate(shapes):
        if len(shape) < 3 or not polygons.is_simple(shape):
            raise ValueError(f"polygon {k} is no simple polygon")
    points, rings = shared_points(shapes)
    rings = _with_hanging_points(points, rings)
    _refuse_overlaps(points, rings)
    rings = _merge_slivers(points, rings, thinnest, smallest)
    outline = outer_boundary(points, rings)
    blocks = from_rings(points, rings, outline)
    if shortest > 0.0:
        blocks = collapse_short_edges(blocks, shortest)
    rings = [blocks.corner[a:b].tolist() for a, b in zip(blocks.start[:-1], blocks.start[1:])]
    return from_rings(blocks.points, [_turning(blocks.points, ring) for ring in rings], outline)


def outer_boundary(points: np.ndarray, rings: list[list[int]]) -> np.ndarray:
    """Corners (m, 2) of the largest closed curve of edges that belong to one block only, straight runs joined."""
    following = defaultdict(list)
    twins = {(b, a) for ring in rings for a, b in _edges(ring)}
    for ring in rings:
        for a, b in _edges(ring):
            if (a, b) not in twins:
                following[a].append(b)
    best, largest = None, 0.0
    while following:
        start = at = min(following)
        loop = []
        while at in following:
            loop.append(at)
            ahead = following[at]
            onward = ahead.pop()
            if not ahead:
                del following[at]
            at = onward
            if at == start:
                break
        xy = points[_turning(points, loop)]
        area = polygons.signed_area(xy) if len(xy) > 2 else 0.0
        if area > largest:
            best, largest = xy, area
    if best is None:
        raise ValueError("the polygons have no outer boundary")
    return best


def _edges(ring: list[int]):
    return zip(ring, ring[1:] + ring[:1])


def _turning(points: np.ndarray, ring: list[int]) -> list[int]:
    """The corners of a ring at which it turns."""
    xy = points[ring]
    back, ahead = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
    cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
    size = np.hypot(*back.T) * np.hypot(*ahead.T)
    kept = [p for p, c, s in zip(ring, cross, size) if abs(c) > _STRAIGHT * s]
    return kept if len(kept) > 2 else ring


def _with_hanging_points(points: np.ndarray, rings: list[list[int]]) -> list[list[int]]:
    """Rings with the corners of others that lie on their edges put in, so that neighbours share edges."""
    tree = cKDTree(points)
    tolerance = 1e-7 * float(np.ptp(points, axis=0).max())
    twins = {(b, a) for ring in rings for a, b in _edges(ring)}
    result = []
    for ring in rings:
        whole = []
        for a, b in _edges(ring):
            whole.append(a)
            if (a, b) in twins:
                continue
            d = points[b] - points[a]
            length = float(np.hypot(*d))
            near = np.array(tree.query_ball_point(0.5 * (points[a] + points[b]), 0.5 * length + tolerance))
            r = points[near] - points[a]
            along = r @ d / length
            off = np.abs(r[:, 0] * d[1] - r[:, 1] * d[0]) / length
            on = (off < tolerance) & (along > tolerance) & (along < length - tolerance)
            whole += near[on][np.argsort(along[on])].tolist()
        result.append(whole)
    return result


def _refuse_overlaps(points: np.ndarray, rings: list[list[int]]) -> None:
    seen: dict[tuple[int, int], int] = {}
    for k, ring in enumerate(rings):
        for edge in _edges(ring):
            if edge in seen:
                raise ValueError(f"polygons {seen[edge]} and {k} overlap")
            seen[edge] = k
    total = sum(polygons.signed_area(points[ring]) for ring in rings)
    hull = float(np.prod(np.ptp(points, axis=0)))
    if total > hull * (1.0 + 1e-6):
        raise ValueError("polygons overlap: their areas add up to more than the box around them")


def _merge_slivers(points, rings, thinnest: float, smallest: float) -> list[list[int]]:
    area = np.array([polygons.signed_area(points[r]) for r in rings])
    limit = smallest * float(np.median(area))
    alive: dict[int, list[int]] = dict(enumerate(rings))
    owner = {edge: k for k, ring in alive.items() for edge in _edges(ring)}
    for k in np.argsort(area, kind="stable").tolist():
        ring = alive[k]
        xy = points[ring]
        longest = float(np.hypot(*(xy[:, None] - xy[None]).reshape(-1, 2).T).max())
        if polygons.signed_area(xy) >= limit and polygons.signed_area(xy) >= thinnest * longest:
            continue
        shared: dict[int, float] = defaultdict(float)
        for a, b in _edges(ring):
            if (b, a) in owner:
                shared[owner[b, a]] += float(np.hypot(*(points[b] - points[a])))
        for other in sorted(shared, key=lambda n: (-shared[n], n)):
            merged = _union(ring, alive[other])
            if merged is None:
                continue
            for edge in _edges(ring):
                owner.pop(edge)
            for edge in _edges(alive[other]):
                owner.pop(edge)
            owner |= dict.fromkeys(_edges(merged), other)
            alive[other] = merged
            del alive[k]
            break
    return [alive[k] for k in sorted(alive)]


def _union(a: list[int], b: list[int]) -> list[int] | None:
    """The ring around two that share edges; None where it is not one simple ring."""
    both = list(_edges(a)) + list(_edges(b))
    inside = set(both)
    ahead = {p: q for p, q in both if (q, p) not in inside}
    if len(ahead) != sum((q, p) not in inside for p, q in both) or not ahead:
        return None
    start = at = min(ahead)
    ring = []
    while at in ahead:
        ring.append(at)
        at = ahead.pop(at)
    return ring if at == start and not ahead and len(ring) > 2 else None
