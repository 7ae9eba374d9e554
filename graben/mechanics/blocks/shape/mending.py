"""Given polygons made fit for blocks: shared points, slivers merged, short edges collapsed, outline found.

The rule: a block with less than `smallest` of the median area, or whose width (area over longest diagonal) is below
`thinnest`, is merged into the neighbour with which it shares the longest boundary, smallest first; then edges below
`shortest` are collapsed as in `tessellation.collapse_short_edges`; then corners that do not turn are dropped.

Edges keep the set of joints that they came with: parts of an edge that of the edge, edges that become one that of the
longest. Where two polygons disagree about their common edge, the first one counts.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from graben.errors import Refused
from graben.mechanics.blocks.shape.tessellation import (
    Marks,
    Mending,
    Tessellation,
    collapsed,
    edge_key,
    edges_of,
    from_rings,
    in_holes,
    shared_points,
)
from graben.mechanics.plane import polygons
from graben.mechanics.plane.rings import STRAIGHT, place, refuse_crossing

# A joint that turns by less has kept its direction [rad].
_TURNED = np.radians(0.1)
# A larger part of the area in blocks that mending takes away makes another rock of it.
MOST_SLIM = 0.5
# An opening that keeps less of its area has gone.
_STAYS = 0.5


def mend(
    shapes: list[np.ndarray],
    edge_sets: list[np.ndarray] | None = None,
    *,
    shortest: float,
    thinnest: float,
    smallest: float = 0.02,
    holes: Sequence[np.ndarray] = (),
    origin: np.ndarray | None = None,
) -> Tessellation:
    """Blocks from polygons (m, 2) [m] that fill a domain without overlaps. Refused where they do not.

    edge_sets : for each polygon the sets of joints (m,) of the edges from each corner to the next; None: one set
    shortest, thinnest : [m]; smallest : share of the median area
    holes : polygons (n, 2) [m] that take out the blocks whose middle lies in one, before any is mended: no sliver
    crosses the edge of a hole with its neighbour
    origin : (2,) what corners count from [m], for messages
    """
    given = [np.asarray(s, float) for s in shapes]
    shapes = [s if polygons.signed_area(s) > 0.0 else s[::-1] for s in given]
    for k, shape in enumerate(shapes):
        try:
            refuse_crossing(shape)
        except Refused as error:
            raise Refused(f"polygon {k}: {error}") from None
    points, rings = shared_points(shapes)
    marks = None if edge_sets is None else _marks(points, given, edge_sets)
    rings = _with_hanging_points(points, rings, marks)
    _refuse_overlaps(points, rings)
    outline = outer_boundary(points, rings)
    gone = in_holes(points, rings, holes)
    openings = _openings(points, rings, gone)
    rings = [ring for ring, out in zip(rings, gone) if not out]
    left, slivers = _merge_slivers(points, rings, thinnest, smallest)
    merged = [k for k in range(len(rings)) if k not in left]
    area = sum(polygons.signed_area(points[rings[k]]) for k in merged)
    blocks = from_rings(points, list(left.values()), outline, marks)
    before, used = points, np.unique(np.concatenate([np.array(ring) for ring in left.values()]))
    points, rings, marks, became = collapsed(blocks, shortest, given=True)
    change = _change(before, used, points[became], openings, np.zeros(2) if origin is None else origin)
    turning = [_turning(points, ring) for ring in rings]
    if marks is not None:
        for ring, kept in zip(rings, turning):
            _mark_straight_runs(points, ring, set(kept), marks)
    done = Mending(*_moves(blocks, points, became), len(merged), float(area), slivers, change)
    return replace(from_rings(points, turning, outline, marks), mending=done)


def _openings(points: np.ndarray, rings: list[list[int]], gone: np.ndarray) -> list[list[int]]:
    """Closed curves around what is taken out, and around voids that were there, by numbers of points."""
    out = [ring for ring, flag in zip(rings, gone) if flag]
    around = [loop for loop in _loops(out) if polygons.signed_area(points[loop]) > 0.0]
    return around + [loop for loop in _loops(rings) if polygons.signed_area(points[loop]) < 0.0]


def _change(
    points: np.ndarray, used: np.ndarray, moved: np.ndarray, openings: list[list[int]], origin: np.ndarray
) -> float:
    """Largest change of the area of an opening [m2], whose `used` points have `moved`. Refused where one closes."""
    after = points.copy()
    after[used] = moved
    change = 0.0
    for loop in openings:
        was, stays = (abs(polygons.signed_area(x[loop])) for x in (points, after))
        if stays < _STAYS * was:
            at = place(points[loop].mean(axis=0), origin)
            raise Refused(
                f"openings that mending leaves: one of {was:.3g} m2 at {at} would be {stays:.3g} m2; lower "
                "tessellation.shortest_edge, or leave the hole out"
            )
        change = max(change, abs(stays - was))
    return change


def _moves(blocks: Tessellation, points: np.ndarray, became: np.ndarray) -> tuple[int, float, int, float]:
    """Corners moved, largest move [m], joints turned, largest turn [rad]; each point became one of `points`."""
    far = np.hypot(*(points[became] - blocks.points).T)
    edge = np.array(sorted({edge_key(*e) for ring in blocks.rings for e in edges_of(ring)}))
    edge = edge[became[edge[:, 0]] != became[edge[:, 1]]]
    before, after = (x[edge[:, 1]] - x[edge[:, 0]] for x in (blocks.points, points[became]))
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(cross, (before * after).sum(axis=1)))
    size = float(np.ptp(blocks.points, axis=0).max())
    return int((far > 1e-9 * size).sum()), float(far.max()), int((turn > _TURNED).sum()), float(turn.max())


def _marks(points: np.ndarray, shapes: list[np.ndarray], edge_sets: list[np.ndarray]) -> Marks:
    number = np.split(cKDTree(points).query(np.vstack(shapes))[1], np.cumsum([len(s) for s in shapes])[:-1])
    marks: Marks = {}
    for ring, sets in zip(number, edge_sets, strict=True):
        for (a, b), mark in zip(edges_of(ring.tolist()), sets.tolist(), strict=True):
            if a != b:
                marks.setdefault(edge_key(a, b), mark)
    return marks


def _mark_straight_runs(points: np.ndarray, ring: list[int], kept: set[int], marks: Marks) -> None:
    """Edges that replace several edges of a ring in one line get the set of the longest."""
    first = next(k for k, p in enumerate(ring) if p in kept)
    ring = ring[first:] + ring[:first]
    begin, longest, mark = ring[0], 0.0, 0
    for a, b in edges_of(ring):
        length = float(np.hypot(*(points[b] - points[a])))
        if length > longest:
            longest, mark = length, marks.get(edge_key(a, b), 0)
        if b in kept:
            marks[edge_key(begin, b)] = mark
            begin, longest = b, 0.0


def outer_boundary(points: np.ndarray, rings: list[list[int]]) -> np.ndarray:
    """Corners (m, 2) of the largest closed curve of edges that belong to one block only, straight runs joined."""
    best, largest = None, 0.0
    for loop in _loops(rings):
        xy = points[_turning(points, loop)]
        area = polygons.signed_area(xy) if len(xy) > 2 else 0.0
        if area > largest:
            best, largest = xy, area
    if best is None:
        raise Refused("polygons with an outer boundary")
    return best


def _loops(rings: list[list[int]]) -> Iterator[list[int]]:
    """Closed curves of the edges that belong to one ring only, with the rings on their left."""
    following = defaultdict(list)
    twins = {(b, a) for ring in rings for a, b in edges_of(ring)}
    for ring in rings:
        for a, b in edges_of(ring):
            if (a, b) not in twins:
                following[a].append(b)
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
        yield loop


def _turning(points: np.ndarray, ring: list[int]) -> list[int]:
    """The corners of a ring at which it turns."""
    xy = points[ring]
    back, ahead = xy - np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0) - xy
    cross = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
    size = np.hypot(*back.T) * np.hypot(*ahead.T)
    kept = [p for p, c, s in zip(ring, cross, size) if abs(c) > STRAIGHT * s]
    return kept if len(kept) > 2 else ring


def _with_hanging_points(points: np.ndarray, rings: list[list[int]], marks: Marks | None) -> list[list[int]]:
    """Rings with the corners of others that lie on their edges put in, so that neighbours share edges."""
    tree = cKDTree(points)
    tolerance = 1e-7 * float(np.ptp(points, axis=0).max())
    twins = {(b, a) for ring in rings for a, b in edges_of(ring)}
    result = []
    for ring in rings:
        whole = []
        for a, b in edges_of(ring):
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
            between = near[on][np.argsort(along[on])].tolist()
            whole += between
            if marks is not None:
                for p, q in itertools.pairwise([a, *between, b]):
                    marks.setdefault(edge_key(p, q), marks.get(edge_key(a, b), 0))
        result.append(whole)
    return result


def _refuse_overlaps(points: np.ndarray, rings: list[list[int]]) -> None:
    seen: dict[tuple[int, int], int] = {}
    for k, ring in enumerate(rings):
        for edge in edges_of(ring):
            if edge in seen:
                raise Refused(f"polygons that do not overlap (polygons {seen[edge]} and {k} do)")
            seen[edge] = k
    total = sum(polygons.signed_area(points[ring]) for ring in rings)
    hull = float(np.prod(np.ptp(points, axis=0)))
    if total > hull * (1.0 + 1e-6):
        raise Refused("polygons that do not overlap (their areas add up to more than the box around them)")


def _merge_slivers(points, rings, thinnest: float, smallest: float) -> tuple[dict[int, list[int]], int]:
    """The rings that are left, by the numbers of the given ones, and how many slivers are among them."""
    area = np.array([polygons.signed_area(points[r]) for r in rings])
    limit = smallest * float(np.median(area))
    width = np.array([a / _longest(points[r]) for a, r in zip(area, rings)])
    slim = float(area[width < thinnest].sum() / area.sum())
    if slim > MOST_SLIM:
        raise Refused(
            f"blocks that mending leaves: {100.0 * slim:.0f} % of the area lies in blocks narrower than "
            f"{thinnest:.4g} m, which join their neighbours; lower tessellation.thinnest, or widen the blocks"
        )

    def sliver(ring: list[int]) -> bool:
        xy = points[ring]
        return polygons.signed_area(xy) < max(limit, thinnest * _longest(xy))

    alive: dict[int, list[int]] = dict(enumerate(rings))
    owner = {edge: k for k, ring in alive.items() for edge in edges_of(ring)}
    for k in np.argsort(area, kind="stable").tolist():
        ring = alive[k]
        if not sliver(ring):
            continue
        shared: dict[int, float] = defaultdict(float)
        for a, b in edges_of(ring):
            if (b, a) in owner:
                shared[owner[b, a]] += float(np.hypot(*(points[b] - points[a])))
        for other in sorted(shared, key=lambda n: (-shared[n], n)):
            merged = _union(ring, alive[other])
            if merged is None:
                continue
            for edge in edges_of(ring):
                owner.pop(edge)
            for edge in edges_of(alive[other]):
                owner.pop(edge)
            owner |= dict.fromkeys(edges_of(merged), other)
            alive[other] = merged
            del alive[k]
            break
    return {k: alive[k] for k in sorted(alive)}, sum(sliver(ring) for ring in alive.values())


def _longest(xy: np.ndarray) -> float:
    """Longest diagonal of corners (m, 2) [m]."""
    return float(np.hypot(*(xy[:, None] - xy[None]).reshape(-1, 2).T).max())


def _union(a: list[int], b: list[int]) -> list[int] | None:
    """The ring around two that share edges; None where it is not one simple ring."""
    both = list(edges_of(a)) + list(edges_of(b))
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
