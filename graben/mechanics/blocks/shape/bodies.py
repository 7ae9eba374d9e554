"""Deformable blocks: own grid points for each block, zones (triangles), contact edges with chamfered corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.shape.tessellation import Tessellation
from graben.mechanics.plane.polygons import distance_to_sides

# A corner that turns less than this is no corner: neither chamfered nor counted [rad].
_STRAIGHT = np.radians(15.0)
# A chamfer takes at most this share of each edge beside it.
_CHAMFER_SHARE = 0.3


@dataclass(frozen=True)
class Bodies:
    """Blocks with grid points, zones and outlines; all arrays C-contiguous.

    Vertices, zones and edges lie block by block in memory, blocks along a curve that keeps neighbours close (see
    `along_curve`); the numbers of the blocks are those of the tessellation.
    position : (vertices, 2) [m], each block owns its vertices; vertex_block : (vertices,)
    block_start : (blocks + 1,), block_corner : vertex of each corner, counter-clockwise
    block_area : (blocks,) [m2]
    zone_vertex : (zones, 3) counter-clockwise; zone_block : (zones,)
    edge_from, edge_to : (outline edges,) vertices of the outline edges, block by block, counter-clockwise
    outline : (m, 2) of the domain [m]; vertex_side : (vertices, m) whether a vertex lies on a side of the domain;
    edge_side : (outline edges,) side of the domain on which an edge lies, -1 for inner ones; edge_set : (outline
    edges,) its set of joints, None: all of set 0; platens : how many of the last blocks are platens beside the
    outline, which are on none of its sides
    """

    position: np.ndarray
    vertex_block: np.ndarray
    block_start: np.ndarray
    block_corner: np.ndarray
    block_area: np.ndarray
    zone_vertex: np.ndarray
    zone_block: np.ndarray
    edge_from: np.ndarray
    edge_to: np.ndarray
    outline: np.ndarray
    vertex_side: np.ndarray
    edge_side: np.ndarray
    edge_set: np.ndarray | None = None
    platens: int = 0

    @property
    def rock(self) -> int:
        """Number of blocks that are no platens."""
        return len(self.block_area) - self.platens


def build_bodies(tessellation: Tessellation, zone_edge: float | None = None) -> Bodies:
    """Cut each block into triangles: from its corners alone, or refined until no zone edge exceeds `zone_edge` [m].

    A refined block is split evenly (each triangle into k x k), so its zones fit; blocks need not match.
    """
    points, start, corner = tessellation.points, tessellation.start, tessellation.corner
    position, zones, edges, sets = [], [], [], []
    corners: list = [None] * tessellation.size
    owner: list = []
    offset = 0
    for b in along_curve(_centres(tessellation)):
        ring = points[corner[start[b] : start[b + 1]]]
        triangles = ear_clip(ring)
        k = 1
        if zone_edge is not None and b < tessellation.size - tessellation.platens:
            sides = ring[triangles] - ring[np.roll(triangles, 1, axis=1)]
            k = max(1, int(np.ceil(np.linalg.norm(sides, axis=2).max() / zone_edge - 1e-9)))
        xy, tri, loop = _split(ring, triangles, k)
        position.append(xy)
        zones.append(tri + offset)
        edges.append(np.column_stack([loop, np.roll(loop, -1)]) + offset)
        if tessellation.edge_set is not None:
            sets.append(np.repeat(tessellation.edge_set[start[b] : start[b + 1]], k))
        corners[b] = np.arange(len(ring)) + offset
        owner.append(np.full(len(xy), b))
        offset += len(xy)
    x = np.vstack(position)
    edge = np.vstack(edges)
    block = np.concatenate(owner)
    tolerance = 1e-6 * float(np.ptp(tessellation.outline, axis=0).max())
    on_side = distance_to_sides(x, tessellation.outline) < tolerance
    on_side[block >= tessellation.size - tessellation.platens] = False
    both = on_side[edge[:, 0]] & on_side[edge[:, 1]]
    edge_side = np.where(both.any(axis=1), both.argmax(axis=1), -1)
    zone_vertex = np.vstack(zones)
    p, q, r = x[zone_vertex[:, 0]], x[zone_vertex[:, 1]], x[zone_vertex[:, 2]]
    zone_area = 0.5 * ((q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0])
    zone_block = block[zone_vertex[:, 0]]
    return Bodies(
        position=np.ascontiguousarray(x),
        vertex_block=block,
        block_start=start.astype(np.int64),
        block_corner=np.concatenate(corners),
        block_area=np.bincount(zone_block, weights=zone_area, minlength=tessellation.size),
        zone_vertex=np.ascontiguousarray(zone_vertex),
        zone_block=zone_block,
        edge_from=np.ascontiguousarray(edge[:, 0]),
        edge_to=np.ascontiguousarray(edge[:, 1]),
        outline=tessellation.outline,
        vertex_side=on_side,
        edge_side=edge_side,
        edge_set=np.concatenate(sets) if sets else None,
        platens=tessellation.platens,
    )


def _centres(tessellation: Tessellation) -> np.ndarray:
    start, corner = tessellation.start, tessellation.corner
    return np.add.reduceat(tessellation.points[corner], start[:-1], axis=0) / np.diff(start)[:, None]


def along_curve(points: np.ndarray) -> np.ndarray:
    """Order of points (n, 2) along Hilbert's curve: what is close on the plane is mostly close in memory."""
    low, span = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-300)
    x, y = (np.minimum((points - low) / span * 65536.0, 65535.0)).astype(np.int64).T
    place = np.zeros(len(points), dtype=np.int64)
    side = 32768
    while side:
        right, up = (x & side) > 0, (y & side) > 0
        place = 4 * place + np.where(right, np.where(up, 2, 3), up)
        # Each quarter holds the curve turned: mirrored in a diagonal at the bottom, kept at the top.
        mirrored = right & ~up
        x, y = np.where(mirrored, 65535 - x, x), np.where(mirrored, 65535 - y, y)
        x, y = np.where(up, x, y), np.where(up, y, x)
        side //= 2
    return np.argsort(place, kind="stable")


def ear_clip(ring: np.ndarray) -> np.ndarray:
    """Triangles (n - 2, 3) of a simple counter-clockwise polygon (n, 2), best-shaped ear first."""
    left = list(range(len(ring)))
    triangles = []
    while len(left) > 3:
        best, best_shape = -1, -np.inf
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if _twice_area(ring[a], ring[b], ring[c]) <= 0.0:
                continue
            if any(_contains(ring[a], ring[b], ring[c], ring[p]) for p in left if p not in (a, b, c)):
                continue
            # Judge the ear together with what it leaves: its own shape and the sharpest angle left at its cut.
            shape = _shape(ring[a], ring[b], ring[c])
            if len(left) == 4:
                d = left[(k + 2) % 4]
                shape = min(shape, _shape(ring[a], ring[c], ring[d]))
            if shape > best_shape:
                best, best_shape = k, shape
        if best < 0:
            raise Refused("block outline is not a simple counter-clockwise polygon")
        triangles.append((left[best - 1], left[best], left[(best + 1) % len(left)]))
        del left[best]
    triangles.append((left[0], left[1], left[2]))
    return np.array(triangles)


def _twice_area(a, b, c) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _contains(a, b, c, p) -> bool:
    return _twice_area(a, b, p) >= 0.0 and _twice_area(b, c, p) >= 0.0 and _twice_area(c, a, p) >= 0.0


def _shape(a, b, c) -> float:
    """Area over the sum of squared sides: largest for the equilateral triangle, negative if turned over."""
    return _twice_area(a, b, c) / (((b - a) ** 2).sum() + ((c - b) ** 2).sum() + ((a - c) ** 2).sum())


def _split(ring: np.ndarray, triangles: np.ndarray, k: int):
    """Each triangle into k x k; corners keep the first numbers. Returns points, triangles, boundary loop."""
    n = len(ring)
    if k == 1:
        return ring, triangles, np.arange(n)
    number: dict[tuple, int] = {(c,): c for c in range(n)}
    points = [tuple(p) for p in ring]

    def point(tri, i, j) -> int:
        weights = ((tri[0], k - i - j), (tri[1], i), (tri[2], j))
        present = tuple(sorted((int(c), w) for c, w in weights if w))
        key = (present[0][0],) if len(present) == 1 else present
        if key not in number:
            number[key] = len(points)
            points.append(tuple(sum(w * ring[c] for c, w in present) / k))
        return number[key]

    cut = []
    for tri in triangles:
        for i in range(k):
            for j in range(k - i):
                cut.append((point(tri, i, j), point(tri, i + 1, j), point(tri, i, j + 1)))
                if i + j < k - 1:
                    cut.append((point(tri, i + 1, j), point(tri, i + 1, j + 1), point(tri, i, j + 1)))
    loop = []
    for a in range(n):
        b = (a + 1) % n
        loop.append(a)
        for s in range(1, k):
            loop.append(number[tuple(sorted(((a, k - s), (b, s))))])
    return np.array(points), np.array(cut), np.array(loop)


@dataclass(frozen=True)
class Skin:
    """The contact surface of all blocks: nodes that blend two vertices, and edges between them.

    Node i is (1 - weight[i]) * vertex first[i] + weight[i] * vertex second[i]; edge i runs from node i to node
    follow[i], counter-clockwise, the block on its left. block : (nodes,); is_chamfer : (nodes,) flags;
    edge : (nodes,) outline edge of the bodies; a chamfer counts to the one that follows.
    """

    first: np.ndarray
    second: np.ndarray
    weight: np.ndarray
    follow: np.ndarray
    block: np.ndarray
    is_chamfer: np.ndarray
    edge: np.ndarray


def chamfered_skin(bodies: Bodies, rounding: float) -> Skin:
    """Contact surface with each outward corner cut off at a distance `rounding` [m] from it along both edges.

    Sharp corners lock where four blocks meet. A cut corner is an edge like the others, so a block slides past
    it without loss of contact; its ends blend two vertices with fixed weights, and forces go back with the same ones.
    """
    x = bodies.position
    n = len(bodies.edge_from)
    block = bodies.vertex_block[bodies.edge_from]
    # Outline edges come block by block, each block a closed loop in order.
    loop_start = np.flatnonzero(np.append(True, block[1:] != block[:-1]))
    loop_end = np.append(loop_start[1:], n)
    previous = np.arange(n) - 1
    previous[loop_start] = loop_end - 1
    here, after, before = bodies.edge_from, bodies.edge_to, bodies.edge_from[previous]
    din, dout = x[here] - x[before], x[after] - x[here]
    turn = np.arctan2(din[:, 0] * dout[:, 1] - din[:, 1] * dout[:, 0], (din * dout).sum(axis=1))
    cut = (turn > _STRAIGHT) & (rounding > 0.0)
    counts = np.where(cut, 2, 1)
    node = np.concatenate([[0], np.cumsum(counts)])
    first = np.empty(node[-1], dtype=np.int64)
    second = np.empty_like(first)
    weight = np.zeros(node[-1])
    is_chamfer = np.zeros(node[-1], dtype=np.bool_)
    # The last node of each outline point starts the edge that follows it.
    last = node[1:] - 1
    first[last], second[last] = here, after
    lead, tail = np.linalg.norm(dout, axis=1), np.linalg.norm(din, axis=1)
    weight[last[cut]] = np.minimum(rounding / lead[cut], _CHAMFER_SHARE)
    k = node[:-1][cut]
    first[k], second[k] = here[cut], before[cut]
    weight[k] = np.minimum(rounding / tail[cut], _CHAMFER_SHARE)
    is_chamfer[k] = True
    follow = np.arange(1, node[-1] + 1)
    follow[node[loop_end] - 1] = node[loop_start]
    return Skin(first, second, weight, follow, np.repeat(block, counts), is_chamfer, np.repeat(np.arange(n), counts))
