"""Is a mesh one body? Elements that are no quads, doubled or overlapping, seams that are not joined, loose parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from graben.errors import Refused
from graben.mechanics.meshes.mesh2d import QuadMesh

# Part of an element's edge within which nodes count as one place.
SAME_PLACE = 1e-3
# Smallest sine of a corner, and smallest area over the longest edge squared.
FLAT_CORNER = 1e-3
NO_AREA = 1e-9


@dataclass(frozen=True)
class MeshFault:
    """What is wrong, with a cure, the numbers of the elements (k,) and their places (k, 2), m."""

    what: str
    elements: np.ndarray
    places: np.ndarray

    def __str__(self) -> str:
        x, y = self.places[0]
        named = ", ".join(str(n) for n in self.elements[:5]) + (", ..." if len(self.elements) > 5 else "")
        return f"{self.what}; elements {named}, the first near ({x:.6g}, {y:.6g}) m"


class NotOneBody(Refused):
    """A mesh with faults, all of them in `faults`."""

    def __init__(self, faults: list[MeshFault]) -> None:
        self.faults = faults
        super().__init__("; ".join(str(f) for f in faults))


def one_body(points: np.ndarray, quads: np.ndarray, numbers: np.ndarray | None = None) -> tuple[QuadMesh, list[str]]:
    """The mesh of one body, mended where that has one meaning, and what was mended.

    Clockwise elements are turned, elements written twice are kept once, nodes of no element are dropped.

    Parameters
    ----------
    points : (n, 2) m
    quads : (e, 4) corners in order around each element, either sense
    numbers : (e,) names of the elements in messages; None: 0, 1, ...

    Raises
    ------
    NotOneBody : elements that are no convex quads, seams, hanging nodes, overlaps, loose parts
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    quads = np.ascontiguousarray(quads, dtype=np.int64)
    numbers = np.arange(len(quads)) if numbers is None else np.asarray(numbers)
    faults = shape_faults(points, quads, numbers)
    if faults:
        raise NotOneBody(faults)
    notes = []
    clockwise = QuadMesh(points, quads).areas() < 0
    if clockwise.any():
        notes.append(f"{clockwise.sum()} clockwise elements were turned")
        quads = np.where(clockwise[:, None], quads[:, ::-1], quads)
    again = _written_before(quads)
    if again.any():
        first = numbers[np.argmax(again)]
        notes.append(f"{again.sum()} elements are written twice and kept once (the first is number {first})")
        quads, numbers = quads[~again], numbers[~again]
    used, inverse = np.unique(quads, return_inverse=True)
    if len(used) < len(points):
        notes.append(f"{len(points) - len(used)} nodes of no element were dropped")
    mesh = QuadMesh(points[used], np.ascontiguousarray(inverse.reshape(quads.shape)))
    faults = joint_faults(mesh, numbers)
    if faults:
        raise NotOneBody(faults)
    return mesh, notes


def _written_before(quads: np.ndarray) -> np.ndarray:
    """Whether an element (e,) has the nodes of one with a smaller index."""
    nodes = np.sort(quads, axis=1)
    order = np.lexsort(nodes.T)  # stable: of equal elements the first stays first
    again = np.zeros(len(quads), dtype=bool)
    again[order[1:]] = (nodes[order[1:]] == nodes[order[:-1]]).all(axis=1)
    return again


def sound(mesh: QuadMesh) -> QuadMesh:
    """A mesh that was made here, if it is one body as it is; else Refused."""
    _, notes = one_body(mesh.points, mesh.quads)
    if notes:
        raise Refused("; ".join(notes))
    return mesh


def shape_faults(points: np.ndarray, quads: np.ndarray, numbers: np.ndarray) -> list[MeshFault]:
    """Elements that are no convex quads, whatever their sense; each is named once."""
    corner = points[quads]
    ahead = np.roll(corner, -1, axis=1) - corner
    back = np.roll(corner, 1, axis=1) - corner
    length = np.hypot(ahead[..., 0], ahead[..., 1])
    turn = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    d1, d2 = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    area = 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    sine = np.sign(area)[:, None] * turn / np.maximum(length * np.roll(length, 1, axis=1), np.finfo(float).tiny)
    in_order = np.sort(quads, axis=1)
    turns_left = (turn > 0).sum(axis=1)
    fault = np.select(
        [
            (in_order[:, 1:] == in_order[:, :-1]).any(axis=1),
            (turns_left == 2) & (np.abs(turn) > NO_AREA * length.max(axis=1, keepdims=True) ** 2).all(axis=1),
            np.abs(area) <= NO_AREA * length.max(axis=1) ** 2,
            (sine < 0).any(axis=1),
            sine.min(axis=1) <= FLAT_CORNER,
        ],
        [1, 2, 3, 4, 5],
        0,
    )
    words = {
        1: "elements name a node twice (triangles written as quads)",
        2: "elements cross themselves: their nodes are not in order around them",
        3: "elements have no area",
        4: "elements are not convex",
        5: f"elements have a corner of less than {FLAT_CORNER:g} rad or almost straight",
    }
    centre = corner.mean(axis=1)
    found = [(code, np.flatnonzero(fault == code)) for code in words]
    return [MeshFault(f"{len(k)} {words[code]}", numbers[k], centre[k]) for code, k in found if len(k)]


def joint_faults(mesh: QuadMesh, numbers: np.ndarray) -> list[MeshFault]:
    """What keeps convex, counter-clockwise elements from being one body: seams, hanging nodes, overlaps, parts."""
    edges = np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)], axis=2).reshape(-1, 2)
    owner = np.repeat(np.arange(len(mesh.quads)), 4)
    name = edges.min(axis=1) * len(mesh.points) + edges.max(axis=1)
    _, edge_of, count = np.unique(name, return_inverse=True, return_counts=True)
    edge_of = edge_of.reshape(-1)
    free = count[edge_of] == 1
    place, seam = _same_places(mesh, edges)
    faults = []
    if len(seam):
        of = np.flatnonzero(np.isin(mesh.quads, seam).any(axis=1))
        what = f"{len(seam)} nodes lie on another node (a seam: merge nodes, in Gmsh: Coherence)"
        faults.append(MeshFault(what, numbers[of], mesh.points[mesh.quads[of]].mean(axis=1)))
    node, edge = _hanging_nodes(mesh, edges[free], place)
    if len(node):
        what = f"{len(np.unique(node))} nodes hang on the edge of an element that does not know them"
        faults.append(MeshFault(what, numbers[owner[free][edge]], mesh.points[node]))
    over, where = _overlaps(place[mesh.quads])
    if len(over):
        faults.append(MeshFault(f"{len(over)} elements overlap others", numbers[over], where))
    faults += _loose_parts(mesh, edge_of, numbers)
    return faults


def _same_places(mesh: QuadMesh, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) with nodes of one place moved to one of them, and the nodes that lie on another."""
    length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T)
    shortest = np.full(len(mesh.points), np.inf)
    np.minimum.at(shortest, edges.ravel(), np.repeat(length, 2))
    distance, other = cKDTree(mesh.points).query(mesh.points, k=2)
    seam = np.flatnonzero(distance[:, 1] < SAME_PLACE * shortest)
    if not len(seam):
        return mesh.points, seam
    pairs = coo_matrix(
        (np.ones(2 * len(seam)), (np.repeat(seam, 2), other[seam].ravel())), shape=(len(shortest),) * 2
    )
    _, group = connected_components(pairs, directed=False)
    _, first = np.unique(group, return_index=True)
    return mesh.points[first[group]], seam


def _hanging_nodes(mesh: QuadMesh, free: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (k,) of the outline that lie inside a free edge (k,) of the outline, not at its ends."""
    import shapely

    nodes = np.unique(free)
    start, along = place[free[:, 0]], place[free[:, 1]] - place[free[:, 0]]
    length = np.hypot(along[:, 0], along[:, 1])
    tree = shapely.STRtree(shapely.points(place[nodes]))
    lines = shapely.linestrings(place[free])
    edge, near = tree.query(lines, predicate="dwithin", distance=SAME_PLACE * length)
    share = np.einsum("ij,ij->i", place[nodes[near]] - start[edge], along[edge]) / length[edge] ** 2
    inside = (share > 2 * SAME_PLACE) & (share < 1.0 - 2 * SAME_PLACE)
    return nodes[near[inside]], edge[inside]


def _overlaps(corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Elements that share area with another one, and a place in it; corner (e, 4, 2), m."""
    import shapely

    shapes = shapely.polygons(corner)
    if shapely.coverage_is_valid(shapes):
        return np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    suspects = np.flatnonzero(~shapely.is_empty(shapely.coverage_invalid_edges(shapes)))
    one, two = shapely.STRtree(shapes).query(shapes[suspects], predicate="intersects")
    one = suspects[one]
    one, two = one[one != two], two[one != two]
    shared = shapely.intersection(shapes[one], shapes[two])
    real = shapely.area(shared) > SAME_PLACE * np.minimum(shapely.area(shapes[one]), shapely.area(shapes[two]))
    over, first = np.unique(np.concatenate([one[real], two[real]]), return_index=True)
    centre = shapely.get_coordinates(shapely.centroid(shared[real]))
    return over, np.concatenate([centre, centre])[first]


def _loose_parts(mesh: QuadMesh, edge_of: np.ndarray, numbers: np.ndarray) -> list[MeshFault]:
    """Elements that no shared edge joins to the largest part."""

    def parts(links: np.ndarray) -> tuple[int, np.ndarray]:
        rows = np.repeat(np.arange(len(mesh.quads)), 4)
        size = len(mesh.quads) + int(links.max()) + 1
        graph = coo_matrix((np.ones(len(rows)), (rows, len(mesh.quads) + links)), shape=(size, size))
        _, of = connected_components(graph, directed=False)
        _, of = np.unique(of[: len(mesh.quads)], return_inverse=True)
        return int(of.max()) + 1, of.reshape(-1)

    count, part = parts(edge_of)
    if count == 1:
        return []
    size = np.bincount(part)
    loose = np.flatnonzero(part != size.argmax())
    joined_at_nodes = count - parts(mesh.quads.ravel())[0]
    hinge = f", {joined_at_nodes} of them joined at single nodes only" if joined_at_nodes else ""
    listed = ", ".join(str(n) for n in np.sort(size)[::-1][:5]) + (", ..." if count > 5 else "")
    what = f"{count} parts of {listed} elements that share no edge{hinge} (one body is expected)"
    return [MeshFault(what, numbers[loose], mesh.points[mesh.quads[loose]].mean(axis=1))]
