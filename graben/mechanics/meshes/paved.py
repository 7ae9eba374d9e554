"""Quads for any simple polygon: graded points, a Delaunay triangulation, and each triangle cut into three quads.

Points are laid on the outline by the wanted size, inner points start on a triangular lattice thinned by the size
field and are relaxed as a network of springs. Conforming on any outline and graded in all directions; the
elements are rougher than those of a mapped mesh (angles near 60 and 120 degrees), 3 to 8 of them at a node.
Deterministic: no random numbers.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from graben.errors import Refused
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.meshes.one_body import sound
from graben.mechanics.meshes.sizing import SizeField, distance_to_segment
from graben.mechanics.plane.rings import refuse_crossing, without_repeats

_RELAXATIONS = 40


def paved_mesh(outline: np.ndarray, size: SizeField) -> QuadMesh:
    """Mesh the inside of a simple polygon.

    Parameters
    ----------
    outline : (c, 2) corners in order (either sense), m; at least three
    size : wanted element edge of the quads

    Raises
    ------
    Refused : the outline crosses itself, or the mesh could not follow it
    """
    outline = np.asarray(outline, dtype=np.float64)
    if outline.ndim != 2 or outline.shape[1] != 2 or len(outline) < 3:
        raise Refused(f"outline must have shape (c, 2) with c >= 3, found {outline.shape}")
    outline = np.ascontiguousarray(without_repeats(outline))
    refuse_crossing(outline)
    x, y = (outline - outline.min(axis=0)).T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if area < 0:
        outline, area = outline[::-1], -area
    # A triangle of edge 2 h gives quads whose mean edge is close to h.
    coarse = SizeField(2 * size.size, size.segments, 2 * np.asarray(size.near_size), 2 * np.asarray(size.growth))
    border = _border(outline, coarse)
    inner = _lattice(outline, coarse)
    inner = _relaxed(outline, border, inner, coarse)
    points = np.concatenate([border, inner])
    triangles = _triangles(points, outline)
    _check_border(triangles, len(border))
    mesh = _three_quads_each(points, triangles)
    mesh = sound(mesh)
    if abs(mesh.areas().sum() - area) > 1e-9 * area:
        raise Refused("the mesh does not fill the outline; try a smaller size near its narrow parts")
    return mesh


def inside(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Whether points (n, 2) lie in the polygon (c, 2); even-odd rule."""
    x, y = points.T
    result = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(outline, np.roll(outline, -1, axis=0)):
        spans = (y0 > y) != (y1 > y)
        if y1 != y0:
            result ^= spans & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return result


def _border(outline: np.ndarray, size: SizeField) -> np.ndarray:
    pieces = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0)):
        count = max(1, round(size.elements_along(a, b)[1][-1]))
        t = size.divide(a, b, count)[:-1]
        pieces.append(a + t[:, None] * (b - a))
    return np.concatenate(pieces)


def _lattice(outline: np.ndarray, size: SizeField) -> np.ndarray:
    """Triangular lattices of halving pitch; each covers the places whose size calls for it."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    pitch = size.size
    kept = []
    while True:
        dy = pitch * np.sqrt(0.75)
        rows = np.arange(low[1] + 0.5 * dy, high[1], dy)
        columns = np.arange(low[0], high[0] + pitch, pitch)
        xx, yy = np.meshgrid(columns, rows)
        xx[1::2] += 0.5 * pitch
        points = np.stack([xx.ravel(), yy.ravel()], axis=1)
        points = points[inside(points, outline)]
        wanted = size(points)
        upper = np.inf if pitch == size.size else pitch * np.sqrt(2.0)
        last = pitch <= size.smallest()
        kept.append(points[(wanted < upper) & ((wanted >= pitch / np.sqrt(2.0)) | last)])
        if last:
            break
        pitch *= 0.5
    points = np.concatenate(kept)
    return points[_clear_of_border(points, outline, size, 0.6)]


def _clear_of_border(points: np.ndarray, outline: np.ndarray, size: SizeField, part: float) -> np.ndarray:
    """Points inside whose distance to the outline leaves room for a triangle."""
    keep = inside(points, outline)
    wanted = size(points)
    for a, b in zip(outline, np.roll(outline, -1, axis=0)):
        keep &= distance_to_segment(points, a, b) > part * wanted
    return keep


def _relaxed(outline: np.ndarray, border: np.ndarray, inner: np.ndarray, size: SizeField) -> np.ndarray:
    """Move inner points until the edges between neighbours have the wanted length, more or less."""
    fixed = len(border)
    for round_number in range(_RELAXATIONS):
        points = np.concatenate([border, inner])
        if round_number % 4 == 0:
            triangles = _triangles(points, outline)
            edges = np.unique(
                np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1),
                axis=0,
            )
        along = points[edges[:, 1]] - points[edges[:, 0]]
        length = np.hypot(*along.T)
        wanted = size(0.5 * (points[edges[:, 0]] + points[edges[:, 1]]))
        wanted *= 1.15 * np.sqrt((length**2).sum() / (wanted**2).sum())
        push = np.maximum(wanted - length, 0.0) / np.maximum(length, 1e-12)
        force = np.zeros_like(points)
        for axis in range(2):
            f = push * along[:, axis]
            force[:, axis] = np.bincount(edges[:, 1], f, len(points)) - np.bincount(edges[:, 0], f, len(points))
        moved = inner + 0.2 * force[fixed:]
        allowed = _clear_of_border(moved, outline, size, 0.35)
        inner = np.where(allowed[:, None], moved, inner)
    return inner


def _triangles(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    triangles = Delaunay(points).simplices
    corners = points[triangles]
    triangles = triangles[inside(corners.mean(axis=1), outline)]
    c = points[triangles]
    a, b = c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]
    double = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    triangles = np.where((double < 0)[:, None], triangles[:, ::-1], triangles)
    longest = np.max(np.hypot(*np.moveaxis(c - np.roll(c, 1, axis=1), 2, 0)), axis=1)
    return triangles[np.abs(double) > 1e-9 * longest**2]


def _check_border(triangles: np.ndarray, count: int) -> None:
    """Every edge of the outline must be an edge of the triangulation."""
    have = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    border = np.sort(np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1), axis=1)
    keys = set(map(tuple, have.tolist()))
    missing = [tuple(e) for e in border.tolist() if tuple(e) not in keys]
    if missing:
        raise Refused(f"{len(missing)} pieces of the outline are missing from the mesh; try a smaller size")


def _three_quads_each(points: np.ndarray, triangles: np.ndarray) -> QuadMesh:
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    unique, inverse = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    middle = len(points) + inverse.reshape(-1, 3)  # on the edge from corner i to corner i + 1
    centre = len(points) + len(unique) + np.arange(len(triangles))
    quads = [np.stack([triangles[:, i], middle[:, i], centre, middle[:, (i + 2) % 3]], axis=1) for i in range(3)]
    all_points = np.concatenate([points, points[unique].mean(axis=1), points[triangles].mean(axis=1)])
    return QuadMesh(all_points, np.ascontiguousarray(np.concatenate(quads)))
