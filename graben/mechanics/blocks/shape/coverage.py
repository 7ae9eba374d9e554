"""A map of given polygons checked as a coverage: they fill a domain, share edges, and neither overlap nor leave gaps.

The rule for small faults: a map with any fault is snapped once, and what remains is refused. Corners closer than
`SNAP` of the median edge to each other meet; those closer to an edge of another polygon, or to the domain's outline,
go onto it. A map without faults stays as it is. Where coordinates have few decimals, corners miss edges by more:
corners go onto edges within `_STEPS` of the last decimal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from graben.errors import Refused
from graben.mechanics.blocks.shape.tessellation import equal_points
from graben.mechanics.plane.polygons import distance_to_sides
from graben.mechanics.plane.rings import place, refuse_crossing

# Corners that miss each other, or an edge, by less than this share of the median edge are meant to meet.
SNAP = 1e-3
# Rounding to a step moves a corner by up to 0.71 steps, and an edge that it should lie on by as much the other way.
# Steps above that share of the median edge are taken for numbers that happen to be round.
_STEPS, _COARSEST = 1.5, 0.02
# A slit that opens to the outside and is narrower than this share of the median edge is a gap between polygons.
SLIT = 0.05
# Corners as close as this share of the map's extent are one; digits of coordinates.
_EQUAL, _DIGITS = 1e-7, 4.0 * np.finfo(float).eps


@dataclass(frozen=True)
class Given:
    """A map as it was given.

    rings : of each polygon (m, 2) [m]; sets : of each the sets of joints (m,) of its edges; names : for messages
    origin : (2,) what corners count from [m]; domain : (k, 2) corners that it must fill, None: it is the domain
    openings : polygons (n, 2) in which nothing needs to lie
    """

    rings: list[np.ndarray]
    sets: list[np.ndarray]
    names: Sequence[str]
    origin: np.ndarray
    domain: np.ndarray | None = None
    openings: Sequence[np.ndarray] = ()


@dataclass(frozen=True)
class Misfit:
    """One fault of a map: what was found, where, and what a map must be."""

    found: str
    expected: str


@dataclass(frozen=True)
class Snapped:
    """A sound map: rings and sets as in `Given`, corners that moved and how far the farthest went [m], and faults."""

    rings: list[np.ndarray]
    sets: list[np.ndarray]
    corners: int = 0
    largest_move: float = 0.0
    faults: list[Misfit] = field(default_factory=list)


def median_edge(rings: list[np.ndarray]) -> float:
    """Median length of the edges [m]; repeated corners make none."""
    length = np.concatenate([np.hypot(*(np.roll(r, -1, axis=0) - r).T) for r in rings])
    return float(np.median(length[length > 0.0])) if (length > 0.0).any() else 0.0


def sound(given: Given) -> Snapped:
    """The map, snapped where it has faults; `faults` are those that remain."""
    points, typical = np.vstack(given.rings), median_edge(given.rings)
    coordinates = float(np.abs(points).max() + np.abs(given.origin).max())
    extent = float(np.ptp(points, axis=0).max())
    equal = max(min(_EQUAL * extent, 0.1 * SNAP * typical), _DIGITS * coordinates)
    rings, sets = _without_repeats(given.rings, given.sets, equal)
    faults = _faults(given, rings, equal, typical)
    if not faults and equal <= _EQUAL * extent:
        return Snapped(rings, sets)
    reach = max(SNAP * typical, equal)
    beside = max(reach, _STEPS * _rounding(given, _COARSEST * typical))
    rings, sets, corners, largest = _snap(given, reach, beside, equal)
    return Snapped(rings, sets, corners, largest, _faults(given, rings, equal, typical))


def _rounding(given: Given, coarsest: float) -> float:
    """The decimal step, at most `coarsest` [m], of which all coordinates are multiples; 0 where there is none."""
    values = np.vstack(given.rings) + given.origin
    digits = 4.0 * np.spacing(np.abs(values).max())
    for step in (10.0**n for n in range(3, -7, -1)):
        fits = 4.0 * digits < step <= coarsest
        if fits and np.abs(values - step * np.rint(values / step)).max() <= digits:
            return step
    return 0.0


def _without_repeats(rings, sets, equal: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Rings and sets without the edges that are shorter than `equal`."""
    kept = [np.hypot(*(np.roll(r, -1, axis=0) - r).T) > equal for r in rings]
    return [r[k] for r, k in zip(rings, kept)], [s[k] for s, k in zip(sets, kept)]


def _snap(given: Given, reach: float, beside: float, equal: float):
    """Rings, sets, corners that moved or bent an edge, largest move: corners within `reach` brought together, and
    onto edges within `beside`."""
    ends = np.cumsum([len(r) for r in given.rings])[:-1]
    points = np.vstack(given.rings)
    number, _ = equal_points(points, reach)
    # Corners meet where most of them are.
    same, _ = equal_points(points, equal)
    order = np.lexsort((-np.bincount(same)[same], number))
    target = points[order[np.unique(number[order], return_index=True)[1]]]
    if given.domain is not None:
        target = _onto(target, given.domain, reach, beside)
    moved = target[number]
    rings, sets = [], []
    tree = cKDTree(target)
    bent, bend = 0, 0.0
    for ring, mark in zip(np.split(moved, ends), given.sets, strict=True):
        ring, mark = (part[0] for part in _without_repeats([ring], [mark], equal))
        if len(ring):
            ring, mark, off = _with_corners_beside(ring, mark, target, tree, beside, equal)
            bent, bend = bent + int((off > equal).sum()), max(bend, float(off.max(initial=0.0)))
        rings.append(ring)
        sets.append(mark)
    far = np.hypot(*(moved - points).T)
    return rings, sets, int((far > equal).sum()) + bent, max(float(far.max()), bend)


def _onto(points: np.ndarray, domain: np.ndarray, reach: float, beside: float) -> np.ndarray:
    """Points within `reach` of corners of the domain's outline (k, 2), or `beside` of its sides, moved onto them."""
    away, corner = cKDTree(domain).query(points)
    side = distance_to_sides(points, domain)
    k = side.argmin(axis=1)
    a, d = domain[k], np.roll(domain, -1, axis=0)[k] - domain[k]
    foot = a + ((((points - a) * d).sum(1) / (d * d).sum(1))[:, None]) * d
    near = np.where((side.min(axis=1) < beside)[:, None], foot, points)
    return np.where((away < reach)[:, None], domain[corner], near)


def _with_corners_beside(ring, sets, points, tree, reach: float, equal: float):
    """A ring and its sets with the corners of others put in that lie within `reach` of its edges, and how far off."""
    whole, marks, bends = [], [], [np.zeros(0)]
    for a, b, mark in zip(ring, np.roll(ring, -1, axis=0), sets, strict=True):
        d = b - a
        length = float(np.hypot(*d))
        near = points[np.sort(tree.query_ball_point(0.5 * (a + b), 0.5 * length + reach))]
        along = (near - a) @ d / length
        off = np.abs((near - a)[:, 0] * d[1] - (near - a)[:, 1] * d[0]) / length
        on = (off < reach) & (along > equal) & (along < length - equal)
        bends.append(off[on])
        between = near[on]
        between = between[np.argsort((between - a) @ d, kind="stable")]
        whole += [a, *between]
        marks += [mark] * (1 + len(between))
    return np.array(whole), np.array(marks), np.concatenate(bends)


def _faults(given: Given, rings: list[np.ndarray], equal: float, typical: float) -> list[Misfit]:
    """What keeps rings from being a coverage of the domain; of crossings first, alone."""
    import shapely

    crossings = []
    for name, ring in zip(given.names, rings, strict=True):
        try:
            refuse_crossing(ring, given.origin)
        except Refused as error:
            crossings.append(Misfit(name, str(error)))
    if crossings:
        return crossings
    shapes = np.array([shapely.Polygon(r) for r in rings])
    overlaps = _overlaps(given, shapes, equal)
    if overlaps:
        return overlaps
    covered = shapely.union_all(shapes)
    lone = _islands(given, shapes, equal)
    return lone or _gaps(given, covered, shapes, equal, typical)


def _overlaps(given: Given, shapes, equal: float) -> list[Misfit]:
    import shapely

    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    pair = first < second
    faults = []
    for i, j in sorted(zip(first[pair].tolist(), second[pair].tolist(), strict=True)):
        common = _wide_parts(shapely.intersection(shapes[i], shapes[j]), equal)
        if not common:
            continue
        area = sum(p.area for p in common)
        same = area > (1.0 - SNAP) * max(shapes[i].area, shapes[j].area)
        what = "are the same polygon" if same else f"overlap by {area:.3g} m2"
        found = f"{given.names[i]} and {given.names[j]} {what} at {_middle(common[0], given)}"
        faults.append(Misfit(found, "polygons that share edges and do not overlap"))
    return faults


def _islands(given: Given, shapes, equal: float) -> list[Misfit]:
    """Polygons that touch no other of the largest connected part."""
    import shapely
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    first, second = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=equal)
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(len(shapes),) * 2)
    count, label = connected_components(graph, directed=False)
    if count == 1:
        return []
    area = np.bincount(label, shapely.area(shapes))
    lone = np.flatnonzero(label != np.argmax(area))
    names = ", ".join(given.names[k] for k in lone[:5]) + (", ..." if len(lone) > 5 else "")
    found = f"{names} at {_middle(shapes[lone[0]], given)} touch no other part of the map"
    return [Misfit(found, "one connected map without gaps")]


def _gaps(given: Given, covered, shapes, equal: float, typical: float) -> list[Misfit]:
    import shapely

    openings = shapely.union_all([shapely.Polygon(o) for o in given.openings])
    expected = "polygons without gaps; a void that is meant is named in domain.holes"
    if given.domain is None:
        # Inner voids, and slits that open to the outside: what widening by half their width closes.
        half = 0.5 * SLIT * typical
        widened = shapely.buffer(covered, half, join_style="mitre", mitre_limit=100.0)
        closed = shapely.buffer(widened, -half, join_style="mitre", mitre_limit=100.0)
        filled = shapely.union_all([shapely.Polygon(p.exterior) for p in shapely.get_parts(closed)])
        missing, beyond = shapely.difference(filled, covered), shapely.Polygon()
    else:
        domain = shapely.Polygon(given.domain)
        missing, beyond = shapely.difference(domain, covered), shapely.difference(covered, domain)
        expected = (
            f"polygons that fill the domain of {domain.area:.6g} m2; a void that is meant is named in domain.holes"
        )
    faults = []
    for part in _wide_parts(shapely.difference(missing, openings), equal):
        near = shapely.STRtree(shapes).query(part, predicate="dwithin", distance=equal)
        names = " and ".join(given.names[k] for k in sorted(near.tolist())[:3])
        beside = f" beside {names}" if names else ""
        faults.append(Misfit(f"a gap of {part.area:.3g} m2 at {_middle(part, given)}{beside}", expected))
    for part in _wide_parts(beyond, equal):
        k = int(shapely.STRtree(shapes).query_nearest(part.representative_point())[0])
        found = f"{given.names[k]} reaches beyond the domain at {_middle(part, given)}"
        faults.append(Misfit(found, "a map that ends at the domain's outline"))
    return faults


def _wide_parts(shape, equal: float) -> list[Any]:
    """The areas of a shape whose mean width is above `equal`, largest first."""
    import shapely

    parts = [p for p in shapely.get_parts(shape) if p.area > 0.5 * equal * p.length]
    return sorted(parts, key=lambda p: -p.area)


def _middle(shape, given: Given) -> str:
    point = shape.representative_point()
    return place(np.array([point.x, point.y]), given.origin)
