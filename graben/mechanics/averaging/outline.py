"""The outline of a REV: the closed curve along block edges round all blocks that the REV meets, Y 2.3.

The nine steps of Y 2.3 are kept apart (`Steps`), so that each set can be looked at. Their result, the ordered
corners, is found here from the network's pieces: the outline is the outer of the closed curves that the pieces
facing no chosen block form. This also holds where Y's corner sets leave a choice: free edges of the model,
corners that meet the middle of an edge, chamfers and the pores behind them, several grid points on one side.

The outline is a material curve: it is found once, at one state, as blends of vertices, and then moves with the
blocks it runs along. Where it steps from one block to the next it has a node on each, so that the opening of
the joint between them belongs to the strain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from graben.errors import Refused
from graben.mechanics.averaging.network import Network
from graben.mechanics.averaging.rev import Rev, in_polygon

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Steps:
    """The sets of the nine steps of Y 2.3, each by index (blocks, contacts and vertices of the network).

    Contacts are rows of ``network.contact``; corners are vertices, of which each block owns its own: one corner
    of the rock is two or three vertices, one per block. The REV's inside blocks are kept beside step 2.
    """

    boundary_blocks: Ints  # 1: blocks that the REV's boundary runs through
    outside_blocks: Ints  # 2: blocks wholly outside
    inside_blocks: Ints
    boundary_contacts: Ints  # 3: contacts between 1 and 2
    contact_corners: Ints  # 4: corners on 3, of either block
    block_contacts: Ints  # 5: all contacts of blocks in 1
    outline_blocks: Ints  # 6: blocks of 1 on contacts in both 3 and 5
    block_corners: Ints  # 7: corners of blocks in 6
    corners: Ints  # 8: corners in both 4 and 7
    ordered: Ints  # 9: vertices of the closed outline, counter-clockwise (where a node lies between two: the nearer)


@dataclass(frozen=True)
class Outline:
    """A closed material curve, counter-clockwise.

    node_vertex : (node, 2) two vertices of one block
    node_weight : (node,) weight of the second vertex; the node lies at (1 - w) first + w second
    pieces : (piece,) pieces of the network along the outline, in order
    blocks : (block,) true for the blocks inside the outline
    steps : how it was found
    """

    node_vertex: Ints
    node_weight: Floats
    pieces: Ints
    blocks: Flags
    steps: Steps

    def follow(self, field: Floats) -> Floats:
        """Values at the nodes (..., node, 2) of a field (..., vertex, 2): positions or displacements."""
        w = self.node_weight[:, None]
        return (1.0 - w) * field[..., self.node_vertex[:, 0], :] + w * field[..., self.node_vertex[:, 1], :]


def find_outline(network: Network, rev: Rev, position: Floats | None = None) -> Outline:
    """The outline of a REV.

    Parameters
    ----------
    network : edges and joints of the blocks, at the first state
    rev : the region
    position : (vertex, 2) m, the state at which blocks are said to meet the region; the network's own unless
        given. Neighbours are those of the network: an outline chosen at a deformed state is the same kind of
        material curve, round the blocks that meet the REV then

    Raises
    ------
    Refused : no block meets the REV
    """
    place = network.position if position is None else position
    crossed = rev.crossed(network, place)
    points = network.interior if position is None else _moved_interior(network, place)
    inside = ~crossed & rev.contains(points)
    chosen = crossed | inside
    if not chosen.any():
        raise Refused(f"no block meets the REV of radius {rev.radius:g} m at {rev.centre}")
    blocks, loop = _enclose(network, chosen)
    vertex, weight = _nodes(network, loop)
    steps = _steps(network, crossed, inside, np.where(weight < 0.5, vertex[:, 0], vertex[:, 1]))
    return Outline(vertex, weight, loop, blocks, steps)


def domain_outline(network: Network, position: Floats | None = None) -> Floats:
    """(n, 2) m outer curve of the model, counter-clockwise, at positions (vertex, 2) or those of the network."""
    _, loop = _enclose(network, np.ones(network.block_count, dtype=bool))
    start, end = network.ends(network.position if position is None else position, loop)
    return np.stack([start, end], axis=1).reshape(-1, 2)


def _moved_interior(network: Network, position: Floats) -> Floats:
    """Inner points carried along with the mean displacement of each block's outline."""
    moved = (position - network.position)[network.edge[:, 0]]
    count = np.maximum(np.bincount(network.edge_block, minlength=network.block_count), 1)
    shift = [np.bincount(network.edge_block, moved[:, k], minlength=network.block_count) / count for k in (0, 1)]
    return network.interior + np.stack(shift, axis=1)


def _enclose(network: Network, chosen: Flags) -> tuple[Flags, Ints]:
    """The blocks inside the outer curve round the chosen ones, and that curve's pieces in order.

    Holes are filled and parts apart from the main one are left out, so the answer is one closed curve.
    """
    while True:
        loop = _outer_loop(network, chosen)
        curve = np.stack(network.ends(network.position, loop), axis=1).reshape(-1, 2)
        enclosed = _attached(network, chosen, loop) | in_polygon(network.interior, curve)
        if np.array_equal(enclosed, chosen):
            return chosen, loop
        chosen = enclosed


def _attached(network: Network, chosen: Flags, loop: Ints) -> Flags:
    """Chosen blocks that joints connect to the outer curve without leaving the chosen ones."""
    pair = network.contact_block
    pair = pair[chosen[pair].all(axis=1)]
    graph = coo_matrix((np.ones(pair.shape[0]), (pair[:, 0], pair[:, 1])), shape=(chosen.size, chosen.size))
    _, label = connected_components(graph, directed=False)
    return chosen & np.isin(label, label[network.piece_block[loop]])


def _outer_loop(network: Network, chosen: Flags) -> Ints:
    """Pieces, in order, of the closed curve with the largest area round the chosen blocks."""
    owner, twin = chosen[network.piece_block], network.piece_twin
    covered = owner & (twin >= 0) & chosen[network.piece_block[twin]]
    exposed = np.flatnonzero(owner & ~covered)
    # Turn about the end of a piece, from block to block, until a piece is met that faces no chosen block.
    after = network.piece_next[exposed]
    turning = covered[after]
    while turning.any():
        after[turning] = network.piece_next[twin[after[turning]]]
        turning[turning] = covered[after[turning]]
    local = np.full(owner.size, -1, dtype=np.int64)
    local[exposed] = np.arange(exposed.size)
    follow = local[after]
    graph = coo_matrix((np.ones(exposed.size), (np.arange(exposed.size), follow)), shape=(exposed.size,) * 2)
    count, label = connected_components(graph, directed=False)
    start, end = network.ends(network.position, exposed)
    centre = start.mean(axis=0)
    a, b, c = start - centre, end - centre, start[follow] - centre
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] + b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    outer = int(np.argmax(np.bincount(label, area, minlength=count)))
    first = int(np.flatnonzero(label == outer)[0])
    chain, links = [first], follow.tolist()
    while links[chain[-1]] != first:
        chain.append(links[chain[-1]])
    return exposed[np.asarray(chain, dtype=np.int64)]


def _nodes(network: Network, loop: Ints) -> tuple[Ints, Floats]:
    """Nodes along a closed chain of pieces: each piece's start, and its end where the next piece starts elsewhere."""
    follower = np.roll(loop, -1)
    jump = network.piece_next[loop] != follower
    vertex = network.edge[network.piece_edge[loop]]
    both = np.stack([vertex, vertex], axis=1).reshape(-1, 2)
    weight = np.stack([network.piece_start[loop], network.piece_end[loop]], axis=1).ravel()
    keep = np.stack([np.ones(loop.size, dtype=bool), jump], axis=1).ravel()
    return both[keep], weight[keep]


def _steps(network: Network, crossed: Flags, inside: Flags, ordered: Ints) -> Steps:
    """The sets of Y 2.3 as sets, from the network's contacts and corners."""
    outside = ~crossed & ~inside
    block = network.contact_block
    between = (crossed[block[:, 0]] & outside[block[:, 1]]) | (outside[block[:, 0]] & crossed[block[:, 1]])
    of_crossed = crossed[block].any(axis=1)
    on_both = np.zeros(network.block_count, dtype=bool)
    on_both[block[between & of_crossed].ravel()] = True
    on_outline = on_both & crossed
    corner = np.zeros(network.position.shape[0], dtype=bool)
    corner[network.corner_vertex] = True
    touched = np.zeros_like(corner)
    for side in (0, 1):
        piece = network.contact[between, side]
        vertex = network.edge[network.piece_edge[piece]]
        touched[vertex[network.piece_start[piece] == 0.0, 0]] = True
        touched[vertex[network.piece_end[piece] == 1.0, 1]] = True
    touched &= corner
    owned = np.zeros_like(corner)
    owned[network.corner_vertex[on_outline[network.corner_block]]] = True
    return Steps(
        boundary_blocks=np.flatnonzero(crossed),
        outside_blocks=np.flatnonzero(outside),
        inside_blocks=np.flatnonzero(inside),
        boundary_contacts=np.flatnonzero(between),
        contact_corners=np.flatnonzero(touched),
        block_contacts=np.flatnonzero(of_crossed),
        outline_blocks=np.flatnonzero(on_outline),
        block_corners=np.flatnonzero(owned),
        corners=np.flatnonzero(touched & owned),
        ordered=ordered,
    )


def outline_area(nodes: Floats) -> Floats:
    """Area (...) m2 inside closed curves (..., node, 2), counter-clockwise positive, Y (2.5)."""
    x, y = nodes[..., 0], nodes[..., 1]
    return 0.5 * (x * (np.roll(y, -1, axis=-1) - np.roll(y, 1, axis=-1))).sum(axis=-1)
