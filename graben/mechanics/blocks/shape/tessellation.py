"""Voronoi blocks in a simple polygon, with Lloyd passes and short edges collapsed.

A Voronoi diagram of Lloyd-relaxed seeds has many very short edges, which carry next to no contact and spoil
zones and time steps. They are collapsed, shortest first, the ones that the outline cuts included; that is also what
brings the blocks to the corner statistics of the reference model (4.3 to 4.4 corners a block).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Voronoi, cKDTree

from graben.errors import Refused
from graben.mechanics.plane import polygons
from graben.mechanics.plane.rings import refuse_crossing

# Mean block area over the square of the nominal edge: UDEC's generator made 419 blocks on 100 m2 for 0.5 m.
AREA_PER_EDGE_SQUARED = 100.0 / 419.0 / 0.25
# An edge is not collapsed where a block would get a corner that turns inwards by more than asin of this.
_REFLEX_SINE = 0.05
# ... or a corner sharper than asin of this: a needle would carry a huge scaled mass.
_NEEDLE_SINE = 0.17


# Sets of joints by the numbers of the points at both ends of an edge, the lower first.
Marks = dict[tuple[int, int], int]


def edge_key(a: int, b: int) -> tuple[int, int]:
    """Key of an edge in `Marks`."""
    return (a, b) if a < b else (b, a)


def edges_of(ring: list[int]) -> Iterator[tuple[int, int]]:
    """Pairs of corners along a ring, from its first."""
    return zip(ring, ring[1:] + ring[:1])


@dataclass(frozen=True)
class Mending:
    """What mending moved: corners and the farthest of their moves [m], joints turned and the largest turn [rad],
    blocks merged into others and their area [m2], slivers that stay since no neighbour makes one block with them, and
    the largest change of the area of an opening [m2]."""

    corners: int = 0
    largest_move: float = 0.0
    joints: int = 0
    largest_turn: float = 0.0
    blocks: int = 0
    area: float = 0.0
    slivers: int = 0
    opening: float = 0.0


@dataclass(frozen=True)
class Tessellation:
    """Blocks that fill an outline; blocks share points here, and part when zones are made.

    points : (p, 2) [m]; start : (blocks + 1,); corner : indices into points, counter-clockwise per block;
    outline : (m, 2) [m] counter-clockwise; edge_set : (corners,) set of joints of the edge from each corner to the
    next, None: all of set 0; mending : what was moved to make blocks of given or cut polygons; platens : how many of
    the last blocks are platens beside the outline.
    """

    points: np.ndarray
    start: np.ndarray
    corner: np.ndarray
    outline: np.ndarray
    edge_set: np.ndarray | None = None
    mending: Mending | None = None
    platens: int = 0

    @property
    def rings(self) -> list[list[int]]:
        """Point numbers of the corners, block by block."""
        return [self.corner[a:b].tolist() for a, b in itertools.pairwise(self.start)]

    @property
    def marks(self) -> Marks | None:
        """Set of joints of each edge, by the numbers of its ends."""
        if self.edge_set is None:
            return None
        return dict(zip((edge_key(*e) for ring in self.rings for e in edges_of(ring)), self.edge_set.tolist()))

    @property
    def size(self) -> int:
        """Number of blocks."""
        return len(self.start) - 1

    def statistics(self) -> dict[str, float]:
        """Corner shares, area quantiles (inner blocks: none on the outline) and edge lengths, SI units."""
        counts = np.diff(self.start)
        area, _ = polygons.areas_and_centroids(self.points, self.start, self.corner)
        tolerance = 1e-6 * np.ptp(self.outline, axis=0).max()
        on_side = polygons.distance_to_sides(self.points, self.outline).min(axis=1) < tolerance
        inner = ~np.logical_or.reduceat(on_side[self.corner], self.start[:-1])
        following = np.arange(1, len(self.corner) + 1)
        following[self.start[1:] - 1] = self.start[:-1]
        edge = np.linalg.norm(self.points[self.corner[following]] - self.points[self.corner], axis=1)
        pool = area[inner] if inner.any() else area
        result = {"blocks": float(self.size), "corners_mean": float(counts.mean())}
        for n in (3, 4, 5, 6):
            result[f"share_{n}_corners"] = float((counts == n).mean())
        for q in (5, 50, 95):
            result[f"inner_area_q{q:02d}_m2"] = float(np.percentile(pool, q))
        result["area_min_m2"] = float(area.min())
        result["area_max_m2"] = float(area.max())
        result["edge_min_m"] = float(edge.min())
        result["edge_mean_m"] = float(edge.mean())
        return result


def voronoi_blocks(
    outline: np.ndarray,
    edge: float,
    seed: int,
    lloyd_passes: int = 4,
    shortest_edge: float | None = None,
    count: int | None = None,
) -> Tessellation:
    """Blocks by a Voronoi diagram of random seeds, relaxed by Lloyd passes (each seed to its cell's centroid).

    outline : (m, 2) simple polygon [m], any direction; edge : nominal edge [m]; shortest_edge : edges below are
    collapsed [m], by default 0.48 edge; count : number of seeds, by default from `edge` as UDEC's generator.
    Raises Refused on an outline that is not simple or is too thin for the block size.
    """
    outline = np.asarray(outline, dtype=float)
    if outline.ndim != 2 or outline.shape[1] != 2 or len(outline) < 3:
        raise Refused(f"outline: expected (m, 2) with m >= 3, found shape {outline.shape}")
    refuse_crossing(outline)
    area = polygons.signed_area(outline)
    if area < 0.0:
        outline, area = outline[::-1].copy(), -area
    n = count if count is not None else round(area / (AREA_PER_EDGE_SQUARED * edge**2))
    if n < 1:
        raise Refused(f"outline of {area:.3g} m2 is too small for blocks of edge {edge:.3g} m")
    limit = 0.48 * edge if shortest_edge is None else shortest_edge
    seeds = _random_points(outline, n, np.random.Generator(np.random.PCG64(seed)))
    for _ in range(lloyd_passes):
        points, start, corner = _cells(seeds, outline)
        _, seeds = polygons.areas_and_centroids(points, start, corner)
    points, start, corner = _cells(seeds, outline)
    tessellation = _conforming(points, start, corner, outline)
    return collapse_short_edges(tessellation, limit)


def from_polygons(shapes: list[np.ndarray], outline: np.ndarray) -> Tessellation:
    """A tessellation from given counter-clockwise polygons, for instance a regular block pattern."""
    start = np.concatenate([[0], np.cumsum([len(s) for s in shapes])])
    return _conforming(np.vstack(shapes), start, np.arange(start[-1]), np.asarray(outline, float), check=False)


def without(tessellation: Tessellation, holes: list[np.ndarray]) -> Tessellation:
    """The blocks whose centroid lies in none of the holes (polygons (m, 2) [m])."""
    gone = in_holes(tessellation.points, tessellation.rings, holes)
    if not gone.any():
        return tessellation
    rings = [ring for ring, out in zip(tessellation.rings, gone) if not out]
    return from_rings(tessellation.points, rings, tessellation.outline, tessellation.marks)


def in_holes(points: np.ndarray, rings: list[list[int]], holes: Sequence[np.ndarray]) -> np.ndarray:
    """Flags of the rings whose middle lies in a hole. Refused where none is left."""
    gone = np.zeros(len(rings), dtype=bool)
    if not holes:
        return gone
    start = np.cumsum([0, *map(len, rings)])
    _, centre = polygons.areas_and_centroids(points, start, np.concatenate([np.array(r) for r in rings]))
    for hole in holes:
        gone |= polygons.inside(centre, hole)
    if gone.all():
        raise Refused("holes: no block is left")
    return gone


def _random_points(outline: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    low, high = outline.min(axis=0), outline.max(axis=0)
    found = np.empty((0, 2))
    while len(found) < n:
        trial = low + (high - low) * rng.random((n, 2))
        found = np.vstack([found, trial[polygons.inside(trial, outline)]])
    return found[:n]


def _cells(seeds: np.ndarray, outline: np.ndarray):
    """Voronoi cells clipped by the outline, as ragged polygons that do not yet share points."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    centre, reach = 0.5 * (low + high), float(np.max(high - low))
    angle = np.arange(8) * (np.pi / 4.0)
    ghosts = centre + 20.0 * reach * np.column_stack([np.cos(angle), np.sin(angle)])
    diagram = Voronoi(np.vstack([seeds, ghosts]))
    vertex_inside = polygons.inside(diagram.vertices, outline)
    # A cell can hold a corner of the outline although all its own corners lie inside.
    touched = set(cKDTree(seeds).query(outline)[1].tolist())
    shapes = []
    for k, region in enumerate(diagram.point_region[: len(seeds)]):
        index = np.array(diagram.regions[region])
        xy = diagram.vertices[index]
        turn = np.argsort(np.arctan2(xy[:, 1] - seeds[k, 1], xy[:, 0] - seeds[k, 0]), kind="stable")
        xy = xy[turn]
        if k in touched or not vertex_inside[index].all():
            xy = polygons.clip_to_convex(outline, xy)
        shapes.append(xy)
    start = np.concatenate([[0], np.cumsum([len(s) for s in shapes])])
    points = np.vstack(shapes)
    area, _ = polygons.areas_and_centroids(points, start, np.arange(start[-1]))
    total = polygons.signed_area(outline)
    if abs(area.sum() - total) > 1e-6 * total or area.min() <= 0.0:
        raise Refused("outline: a part is thinner than a block, so a cell falls apart; use a smaller edge")
    return points, start, np.arange(start[-1])


def _conforming(points, start, corner, outline, check: bool = True) -> Tessellation:
    """Give equal points one number, and drop repeated corners."""
    number, first = equal_points(points, 1e-7 * float(np.ptp(outline, axis=0).max()))
    rings = [_without_repeats(number[corner[a:b]].tolist()) for a, b in itertools.pairwise(start)]
    if check and min(len(r) for r in rings) < 3:
        raise Refused("tessellation: a block has fewer than three corners")
    return from_rings(points[first], rings, outline)


def _without_repeats(ring: list[int]) -> list[int]:
    return [p for k, p in enumerate(ring) if p != ring[k - 1]]


def shared_points(shapes: list[np.ndarray]) -> tuple[np.ndarray, list[list[int]]]:
    """Points (p, 2) of polygons (m, 2), equal ones once, and each polygon's corners as numbers of points."""
    points = np.vstack(shapes)
    tolerance = 1e-7 * float(np.ptp(points, axis=0).max())
    number, first = equal_points(points, tolerance)
    ends = np.cumsum([len(s) for s in shapes])[:-1]
    return points[first], [_without_repeats(r.tolist()) for r in np.split(number, ends)]


def equal_points(points: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """The number of each point among the different ones, and the first of each of these."""
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    n = len(points)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    _, first, number = np.unique(label, return_index=True, return_inverse=True)
    return number, first


def from_rings(
    points: np.ndarray, rings: list[list[int]], outline: np.ndarray, marks: Marks | None = None
) -> Tessellation:
    """A tessellation of rings of point numbers; points that no ring uses are dropped. Edges not in marks have 0."""
    used = np.unique(np.concatenate([np.array(r) for r in rings]))
    renumber = np.full(len(points), -1)
    renumber[used] = np.arange(len(used))
    start = np.concatenate([[0], np.cumsum([len(r) for r in rings])]).astype(np.int64)
    corner = renumber[np.concatenate([np.array(r) for r in rings])].astype(np.int64)
    sets = None
    if marks is not None:
        sets = np.array([marks.get(edge_key(*e), 0) for ring in rings for e in edges_of(ring)], dtype=np.int64)
    return Tessellation(np.ascontiguousarray(points[used]), start, corner, outline, sets)


def collapse_short_edges(tessellation: Tessellation, shortest: float, given: bool = False) -> Tessellation:
    """Collapse edges below `shortest` [m], the shortest first, wherever all blocks around stay sound.

    The ends of an inner edge meet in its middle; an end on the outline stays on it, a corner of the outline
    stays put. An edge stays if a block around it would lose its third corner, or get a corner that turns inwards or
    is a needle, or if its ends lie on different sides. The other edges keep their sets of joints.
    given : the blocks did not come from a Voronoi diagram. They may have such corners from the start: a collapse must
    not add to them; and the ends may meet at one of them.
    """
    points, rings, marks, _ = collapsed(tessellation, shortest, given)
    return from_rings(points, rings, tessellation.outline, marks)


def collapsed(
    tessellation: Tessellation, shortest: float, given: bool
) -> tuple[np.ndarray, list[list[int]], Marks | None, np.ndarray]:
    """Points, rings and sets of joints after `collapse_short_edges`, and the point (p,) that each point became."""
    points = tessellation.points.copy()
    outline = tessellation.outline
    rings, marks = tessellation.rings, tessellation.marks
    became = np.arange(len(points))
    tolerance = 1e-6 * float(np.ptp(outline, axis=0).max())
    on_side = polygons.distance_to_sides(points, outline) < tolerance
    sides = [frozenset(np.flatnonzero(row).tolist()) for row in on_side]
    blocks_at: list[set[int]] = [set() for _ in points]
    for b, ring in enumerate(rings):
        for p in ring:
            blocks_at[p].add(b)
    alive = [True] * len(points)
    heap: list[tuple[float, int, int]] = []

    def push(i: int, j: int) -> None:
        length = float(np.hypot(*(points[i] - points[j])))
        if length < shortest:
            heapq.heappush(heap, (length, min(i, j), max(i, j)))

    for ring in rings:
        for k, p in enumerate(ring):
            push(ring[k - 1], p)
    while heap:
        length, i, j = heapq.heappop(heap)
        stale = not (alive[i] and alive[j]) or abs(np.hypot(*(points[i] - points[j])) - length) > 1e-12
        if stale or not _joined(rings, blocks_at, i, j):
            continue
        if sides[i] == sides[j] and len(sides[i]) < 2:
            targets = [0.5 * (points[i] + points[j])]
            if given:
                targets += [points[i].copy(), points[j].copy()]
        elif sides[i] > sides[j]:
            targets = [points[i].copy()]
        elif sides[i] < sides[j]:
            targets = [points[j].copy()]
        else:
            continue
        around = sorted(blocks_at[i] | blocks_at[j])
        before = points[i].copy(), points[j].copy()
        most = {b: _bad_corners(points, rings[b], sides) if given else 0.0 for b in around}
        changed = {b: _without_repeats([i if p == j else p for p in rings[b]]) for b in around}
        for target in targets:
            points[i] = points[j] = target
            if all(_bad_corners(points, ring, sides) <= most[b] for b, ring in changed.items()):
                break
        else:
            points[i], points[j] = before
            continue
        alive[j] = False
        became[became == j] = i
        if marks is not None:
            for b in blocks_at[j]:
                k = rings[b].index(j)
                for p in (rings[b][k - 1], rings[b][(k + 1) % len(rings[b])]):
                    marks.setdefault(edge_key(p, i), marks.get(edge_key(p, j), 0))
        for b, ring in changed.items():
            rings[b] = ring
        blocks_at[i] |= blocks_at[j]
        sides[i] = sides[i] | sides[j]
        for ring in changed.values():
            k = ring.index(i)
            push(i, ring[k - 1])
            push(i, ring[(k + 1) % len(ring)])
    return points, rings, marks, became


def _joined(rings, blocks_at, i: int, j: int) -> bool:
    for b in blocks_at[i] & blocks_at[j]:
        ring = rings[b]
        k = ring.index(i)
        if ring[k - 1] == j or ring[(k + 1) % len(ring)] == j:
            return True
    return False


def _bad_corners(points: np.ndarray, ring: list[int], sides) -> float:
    """How many corners turn inwards (corners of the outline aside) or are needles; infinite where it is no block."""
    if len(ring) < 3 or len(set(ring)) < len(ring):
        return np.inf
    xy = points[ring]
    before = xy - np.roll(xy, 1, axis=0)
    after = np.roll(before, -1, axis=0)
    length = np.hypot(before[:, 0], before[:, 1]) * np.hypot(after[:, 0], after[:, 1])
    sine = (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / length
    cosine = (before * after).sum(axis=1) / length
    bad = (sine < -_REFLEX_SINE) | ((cosine < 0.0) & (sine < _NEEDLE_SINE))
    bad &= np.array([len(sides[p]) < 2 for p in ring])
    return float(bad.sum()) if polygons.signed_area(xy) > 0.0 else np.inf
