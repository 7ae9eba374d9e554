"""The network of block edges and joints at one state: which piece of which edge faces which other block.

Every block owns its vertices, so two blocks that share a joint have two rows of vertices there, which coincide
only nearly once the model has been consolidated. The network finds, for each edge, the pieces of it that face
an edge of another block ("twins"), and the pieces that face nothing (the outside of the model, or a pore at a
chamfered corner). A piece ends at a vertex of its own edge, or, where another block's corner meets the edge
between its ends, at a fixed fraction of it. Everything else about outlines is then bookkeeping on pieces, with
no tolerance left in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from graben.errors import Refused

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Edges face each other when their directions are antiparallel within 30 degrees.
_FACING = -np.cos(np.deg2rad(30.0))


@dataclass(frozen=True)
class Network:
    """Pieces of block edges and their neighbours.

    position : (vertex, 2) m, where the network was built
    block_count : number of blocks
    edge : (edge, 2) vertex indices, counter-clockwise round each block
    edge_block : (edge,) block of each edge, ascending
    piece_edge, piece_start, piece_end : (piece,) parent edge and the fractions of it where the piece starts, ends
    piece_next : (piece,) the next piece counter-clockwise round the same block
    piece_twin : (piece,) the piece of another block that it faces, or -1
    interior : (block, 2) m, a point inside each block
    corner_block, corner_vertex : block corners, where they differ from the ends of edges (grid points on sides)
    """

    position: Floats
    block_count: int
    edge: Ints
    edge_block: Ints
    piece_edge: Ints
    piece_start: Floats
    piece_end: Floats
    piece_next: Ints
    piece_twin: Ints
    interior: Floats
    corner_block: Ints
    corner_vertex: Ints

    @cached_property
    def piece_block(self) -> Ints:
        """(piece,) block of each piece."""
        return self.edge_block[self.piece_edge]

    @cached_property
    def edge_offset(self) -> Ints:
        """(block + 1,) first edge of each block."""
        return np.searchsorted(self.edge_block, np.arange(self.block_count + 1))

    @cached_property
    def contact(self) -> Ints:
        """(contact, 2) pairs of pieces that face each other, each pair once."""
        first = np.flatnonzero(self.piece_twin > np.arange(self.piece_twin.size))
        return np.stack([first, self.piece_twin[first]], axis=1)

    @cached_property
    def contact_block(self) -> Ints:
        """(contact, 2) the blocks of each contact."""
        return self.piece_block[self.contact]

    def ends(self, points: Floats, pieces: Ints) -> tuple[Floats, Floats]:
        """Values at the start and at the end of pieces, of a field given at the vertices.

        Parameters
        ----------
        points : (..., vertex, 2) positions or displacements
        pieces : (n,) piece indices

        Returns
        -------
        start, end : each (..., n, 2)
        """
        v = self.edge[self.piece_edge[pieces]]
        a, b = points[..., v[:, 0], :], points[..., v[:, 1], :]
        # a + w (b - a) would not return b exactly at w = 1.
        s, e = self.piece_start[pieces][:, None], self.piece_end[pieces][:, None]
        return (1.0 - s) * a + s * b, (1.0 - e) * a + e * b


def build_network(
    position: Floats,
    block_count: int,
    zone_vertex: Ints,
    zone_block: Ints,
    corner_count: Ints,
    corner: Ints,
    tolerance: float | None = None,
) -> Network:
    """Find the edges of all blocks, the pieces of them, and which pieces face each other.

    Parameters
    ----------
    position : (vertex, 2) m
    block_count : number of blocks
    zone_vertex, zone_block : (zone, 3), (zone,) triangles and their block; a block's outline is that of its zones
    corner_count, corner : (block,), (sum,) ragged corners, counter-clockwise; used alone for blocks without zones
    tolerance : m, largest gap across a joint and smallest length of a contact; 5 % of the median block diameter
        unless given. It never exceeds a quarter of the edges concerned

    Raises
    ------
    Refused : an outline that is not one closed curve
    """
    edge, edge_block = _block_edges(position, block_count, zone_vertex, zone_block, corner_count, corner)
    following = _next_edges(edge, edge_block, position.shape[0])
    vector = position[edge[:, 1]] - position[edge[:, 0]]
    length = np.hypot(vector[:, 0], vector[:, 1])
    if tolerance is None:
        cross = position[edge[:, 0], 0] * position[edge[:, 1], 1] - position[edge[:, 0], 1] * position[edge[:, 1], 0]
        areas = 0.5 * np.bincount(edge_block, cross, minlength=block_count)
        tolerance = 0.05 * float(np.sqrt(np.median(areas)))
    first, second, overlap = _facing(position, edge, edge_block, vector, length, tolerance)
    pieces = _cut(length, first, second, overlap, np.minimum(tolerance, 0.25 * length), following)
    return Network(
        position=position,
        block_count=block_count,
        edge=edge,
        edge_block=edge_block,
        piece_edge=pieces[0],
        piece_start=pieces[1],
        piece_end=pieces[2],
        piece_next=pieces[3],
        piece_twin=pieces[4],
        interior=_interior_points(position, block_count, zone_vertex, zone_block, edge, edge_block),
        corner_block=np.repeat(np.arange(corner_count.size), corner_count),
        corner_vertex=corner,
    )


def _block_edges(
    position: Floats, block_count: int, zone_vertex: Ints, zone_block: Ints, corner_count: Ints, corner: Ints
) -> tuple[Ints, Ints]:
    """Edges counter-clockwise, sorted by block: the sides of zones that no other zone of the block shares."""
    p = position[zone_vertex]
    turn = (p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1]) - (p[:, 1, 1] - p[:, 0, 1]) * (
        p[:, 2, 0] - p[:, 0, 0]
    )
    ccw = np.where((turn > 0)[:, None], zone_vertex, zone_vertex[:, ::-1])
    side = np.concatenate([ccw[:, [0, 1]], ccw[:, [1, 2]], ccw[:, [2, 0]]])
    owner = np.concatenate([zone_block, zone_block, zone_block])
    size = position.shape[0]
    # Within a block inner sides come twice, once in each direction, because its zones share vertices.
    code, reverse = side[:, 0] * size + side[:, 1], side[:, 1] * size + side[:, 0]
    outer = ~np.isin(code, reverse)
    edge, block = side[outer], owner[outer]
    bare = np.setdiff1d(np.arange(block_count), zone_block)
    if bare.size:
        offset = np.concatenate([[0], np.cumsum(corner_count)])
        owner = np.repeat(np.arange(corner_count.size), corner_count)
        here = np.arange(corner.size)
        last = here + 1 == offset[owner + 1]
        ring = np.stack(
            [corner, corner[np.where(last, offset[owner], np.minimum(here + 1, corner.size - 1))]], axis=1
        )
        chosen = np.isin(owner, bare)
        edge, block = np.concatenate([edge, ring[chosen]]), np.concatenate([block, owner[chosen]])
    order = np.lexsort((edge[:, 0], block))
    return edge[order], block[order]


def _next_edges(edge: Ints, edge_block: Ints, vertex_count: int) -> Ints:
    """(edge,) the edge that starts where this one ends, in the same block."""
    start = np.full(vertex_count, -1, dtype=np.int64)
    start[edge[:, 0]] = np.arange(edge.shape[0])
    following = start[edge[:, 1]]
    wrong = (following < 0) | (edge_block[following] != edge_block)
    wrong |= np.bincount(edge[:, 0], minlength=vertex_count)[edge[:, 0]] != 1
    if wrong.any():
        blocks = np.unique(edge_block[wrong])
        raise Refused(f"the outline of block {int(blocks[0])} is not one closed curve ({blocks.size} such blocks)")
    return following


def _facing(
    position: Floats, edge: Ints, edge_block: Ints, vector: Floats, length: Floats, tolerance: float
) -> tuple[Ints, Ints, Floats]:
    """Pairs of edges that face each other: edges (n,), (n,), and the interval of overlap on each, (n, 2, 2) m."""
    reach = float(np.median(length))
    count = np.maximum(1, np.ceil(length / reach).astype(np.int64))
    parent = np.repeat(np.arange(edge.shape[0]), count)
    rank = np.arange(parent.size) - np.repeat(np.cumsum(count) - count, count)
    middle = position[edge[parent, 0]] + vector[parent] * ((rank + 0.5) / count[parent])[:, None]
    pairs = cKDTree(middle).query_pairs(reach + tolerance, output_type="ndarray")
    i, j = parent[pairs[:, 0]], parent[pairs[:, 1]]
    i, j = np.minimum(i, j), np.maximum(i, j)
    keep = edge_block[i] != edge_block[j]
    code = np.unique(i[keep] * np.int64(edge.shape[0]) + j[keep])
    i, j = code // edge.shape[0], code % edge.shape[0]
    t = vector / length[:, None]
    keep = (t[i] * t[j]).sum(axis=1) < _FACING
    i, j = i[keep], j[keep]
    near = np.minimum(tolerance, 0.25 * np.minimum(length[i], length[j]))
    on_i, gap_i = _overlap(position, edge, t, length, i, j)
    on_j, gap_j = _overlap(position, edge, t, length, j, i)
    shortest = np.minimum(on_i[:, 1] - on_i[:, 0], on_j[:, 1] - on_j[:, 0])
    keep = (shortest > near) & (np.minimum(gap_i, gap_j) < near)
    return i[keep], j[keep], np.stack([on_i, on_j], axis=1)[keep]


def _overlap(position: Floats, edge: Ints, t: Floats, length: Floats, i: Ints, j: Ints) -> tuple[Floats, Floats]:
    """Interval of edge i covered by edge j (n, 2) m, and the distance of j from i at its middle (n,) m."""
    origin = position[edge[i, 0]]
    # j runs against i, so its end comes first along i.
    a, b = position[edge[j, 1]] - origin, position[edge[j, 0]] - origin
    sa, sb = (a * t[i]).sum(axis=1), (b * t[i]).sum(axis=1)
    na = t[i, 0] * a[:, 1] - t[i, 1] * a[:, 0]
    nb = t[i, 0] * b[:, 1] - t[i, 1] * b[:, 0]
    low, high = np.maximum(sa, 0.0), np.minimum(sb, length[i])
    middle = np.clip((0.5 * (low + high) - sa) / np.maximum(sb - sa, 1e-300), 0.0, 1.0)
    return np.stack([low, high], axis=1), np.abs(na + middle * (nb - na))


def _cut(
    length: Floats, first: Ints, second: Ints, overlap: Floats, snap: Floats, following: Ints
) -> tuple[Ints, Floats, Floats, Ints, Ints]:
    """Cut edges into pieces at the ends of their contacts; returns edge, start, end, next, twin of the pieces."""
    while True:
        contact = np.arange(first.size)
        edge = np.concatenate([first, second])
        key = np.concatenate([contact, contact])
        low = np.concatenate([overlap[:, 0, 0], overlap[:, 1, 0]])
        high = np.concatenate([overlap[:, 0, 1], overlap[:, 1, 1]])
        order = np.lexsort((high, low, edge))
        edge, key, low, high = edge[order], key[order], low[order], high[order]
        new = np.ones(edge.size, dtype=bool)
        new[1:] = edge[1:] != edge[:-1]
        before = np.where(new, 0.0, np.concatenate([[0.0], high[:-1]]))
        # Where blocks overlap each other a contact may lie behind another one: it is dropped, on both sides.
        hidden = high <= before + snap[edge] * 1e-3
        if not hidden.any():
            break
        keep = ~np.isin(contact, key[hidden])
        first, second, overlap = first[keep], second[keep], overlap[keep]
    # Contacts that nearly touch, or nearly reach the end of the edge, are joined up.
    low = np.where(low - before < snap[edge], before, low)
    last = np.ones(edge.size, dtype=bool)
    last[:-1] = new[1:]
    high = np.where(last & (length[edge] - high < snap[edge]), length[edge], high)
    faced = np.zeros(length.size, dtype=bool)
    faced[edge] = True
    gap = low > before
    tail = last & (high < length[edge])
    bare = np.flatnonzero(~faced)
    piece_edge = np.concatenate([edge, edge[gap], edge[tail], bare])
    start = np.concatenate([low, before[gap], high[tail], np.zeros(bare.size)])
    end = np.concatenate([high, low[gap], length[edge[tail]], length[bare]])
    key = np.concatenate([key, np.full(piece_edge.size - edge.size, -1)])
    order = np.lexsort((start, piece_edge))
    piece_edge, start, end, key = piece_edge[order], start[order], end[order], key[order]
    twin = np.full(piece_edge.size, -1, dtype=np.int64)
    joined = np.flatnonzero(key >= 0)
    pair = joined[np.argsort(key[joined], kind="stable")].reshape(-1, 2)
    twin[pair[:, 0]], twin[pair[:, 1]] = pair[:, 1], pair[:, 0]
    first_piece = np.searchsorted(piece_edge, np.arange(length.size))
    is_last = np.ones(piece_edge.size, dtype=bool)
    is_last[:-1] = piece_edge[1:] != piece_edge[:-1]
    following_piece = np.where(is_last, first_piece[following[piece_edge]], np.arange(piece_edge.size) + 1)
    whole = length[piece_edge]
    return (
        piece_edge,
        np.where(start == 0.0, 0.0, start / whole),
        np.where(end == whole, 1.0, end / whole),
        following_piece,
        twin,
    )


def _interior_points(
    position: Floats, block_count: int, zone_vertex: Ints, zone_block: Ints, edge: Ints, edge_block: Ints
) -> Floats:
    """(block, 2) a point inside each block: the middle of its largest zone, else the mean of its corners."""
    count = np.maximum(np.bincount(edge_block, minlength=block_count), 1)
    start = position[edge[:, 0]]
    points = np.stack([np.bincount(edge_block, start[:, k], minlength=block_count) / count for k in (0, 1)], axis=1)
    if zone_block.size:
        p = position[zone_vertex]
        turn = np.abs(
            (p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1])
            - (p[:, 1, 1] - p[:, 0, 1]) * (p[:, 2, 0] - p[:, 0, 0])
        )
        order = np.lexsort((turn, zone_block))
        largest = order[np.append(zone_block[order][1:] != zone_block[order][:-1], True)]
        points[zone_block[largest]] = p[largest].mean(axis=1)
    return points
