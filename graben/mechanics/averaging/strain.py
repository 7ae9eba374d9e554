"""Average displacement gradient, strain and rotation from the outline, Y (2.12)-(2.13), and their parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.averaging.network import Network
from graben.mechanics.averaging.outline import Outline, outline_area

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def outline_gradient(nodes: Floats, displacement: Floats) -> Floats:
    """Average displacement gradient du_i/dx_j inside a closed curve, Y (2.13) before it is symmetrized.

    Each segment takes the mean of both components of the displacement of its two ends, which is exact for
    displacements that are linear along segments, and so for any affine field.

    Parameters
    ----------
    nodes : (node, 2) or (time, node, 2) m, counter-clockwise
    displacement : (..., node, 2) m

    Returns
    -------
    (..., 2, 2) with index [i, j] = du_i/dx_j
    """
    # Displacements relative to one node: a translation then adds no round-off.
    u = displacement - displacement[..., :1, :]
    swept = _swept(nodes, np.roll(nodes, -1, axis=-2), u, np.roll(u, -1, axis=-2))
    return swept / outline_area(nodes)[..., None, None]


def strain_of(gradient: Floats) -> Floats:
    """(..., 4) small strain xx, yy, zz (0: plane strain), xy of gradients (..., 2, 2)."""
    strain = np.zeros((*gradient.shape[:-2], 4))
    strain[..., 0], strain[..., 1] = gradient[..., 0, 0], gradient[..., 1, 1]
    strain[..., 3] = 0.5 * (gradient[..., 0, 1] + gradient[..., 1, 0])
    return strain


def rotation_of(gradient: Floats) -> Floats:
    """(...,) small rotation, rad, counter-clockwise positive, of gradients (..., 2, 2)."""
    return 0.5 * (gradient[..., 1, 0] - gradient[..., 0, 1])


def zone_gradient(
    position: Floats, displacement: Floats, zone_vertex: Ints, blocks_inside: NDArray[np.bool_]
) -> Floats:
    """Sum over zones of area x displacement gradient (..., 2, 2) m2: the part of the strain that lies in blocks.

    Parameters
    ----------
    position : (vertex, 2) m
    displacement : (..., vertex, 2) m
    zone_vertex : (zone, 3)
    blocks_inside : (zone,) true for the zones to sum
    """
    v = zone_vertex[blocks_inside]
    p = position[v]
    turn = (p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1]) - (p[:, 1, 1] - p[:, 0, 1]) * (
        p[:, 2, 0] - p[:, 0, 0]
    )
    v = np.where((turn > 0)[:, None], v, v[:, ::-1])
    p, u = position[v], displacement[..., v, :]
    # Side opposite to vertex k, as outward normal x length: the gradient of its shape function x -2 area.
    side = np.roll(p, 1, axis=1) - np.roll(p, -1, axis=1)
    normal = np.stack([side[..., 1], -side[..., 0]], axis=-1)
    return -0.5 * np.einsum("...zki,zkj->...ij", u, normal)


def joint_gradient(network: Network, outline: Outline, displacement: Floats) -> Floats:
    """Sum over the joints inside the outline of jump (x) normal x length (..., 2, 2) m2.

    A joint is a pair of pieces that face each other; what remains of closed pores adds the displacement of
    their walls. With `zone_gradient` this makes up the outline's gradient times its area, to round-off.

    Parameters
    ----------
    network, outline : as found
    displacement : (..., vertex, 2) m
    """
    on_curve = np.zeros(network.piece_edge.size, dtype=bool)
    on_curve[outline.pieces] = True
    within = np.flatnonzero(outline.blocks[network.piece_block] & ~on_curve)
    # The normal of a piece points out of its block; seen from the joint it is reversed.
    walls = -_swept(*network.ends(network.position, within), *network.ends(displacement, within))
    # Where the outline steps from block to block it closes the mouth of the joint between them.
    follower = np.roll(outline.pieces, -1)
    step = network.piece_next[outline.pieces] != follower
    x0, x1 = (
        network.ends(network.position, outline.pieces[step])[1],
        network.ends(network.position, follower[step])[0],
    )
    u0, u1 = network.ends(displacement, outline.pieces[step])[1], network.ends(displacement, follower[step])[0]
    return walls + _swept(x0, x1, u0, u1)


def _swept(x0: Floats, x1: Floats, u0: Floats, u1: Floats) -> Floats:
    """Sum of mean displacement (x) right-hand normal x length over segments from x0 to x1, m2."""
    along = x1 - x0
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    mean = 0.5 * (u0 + u1)
    return np.einsum("...ni,...nj->...ij", mean, np.broadcast_to(normal, mean.shape))
