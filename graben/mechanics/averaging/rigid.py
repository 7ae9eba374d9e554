"""Blocks without zones (rigid ones) in averages: their stress comes from the forces on them, their area and motion
from their outline."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.averaging.network import Network
from graben.mechanics.averaging.stress import per_state

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def force_moment(
    bare: Flags,
    middle: Floats,
    contact_state: Ints,
    contact_block: Ints,
    contact_position: Floats,
    contact_force: Floats,
    vertex_block: Ints,
    vertex_position: Floats,
    vertex_force: Floats,
) -> Floats:
    """Area x average stress of blocks from the forces on them: sum of force (x) (position - middle of the block).

    Of a contact between two of the blocks only force and distance of the middles count, not where on the joint it
    acts; where it does count is at contacts with blocks outside.

    Parameters
    ----------
    bare : (block,) the blocks to sum
    middle : (time, block, 2) m, a point of each block; forces in balance give the same for any
    contact_state, contact_block, contact_position, contact_force, vertex_block, vertex_position, vertex_force :
        as in `forces_on`

    Returns
    -------
    (time, 2, 2) N/m, not symmetrized
    """
    count = middle.shape[0]
    total = np.zeros((count, 2, 2))
    for side, sign in ((0, 1.0), (1, -1.0)):
        chosen = bare[contact_block[:, side]]
        state, block = contact_state[chosen], contact_block[chosen, side]
        arm = contact_position[chosen] - middle[state, block]
        total += per_state(state, sign * contact_force[chosen][:, :, None] * arm[:, None, :], count)
    here = np.flatnonzero(bare[vertex_block])
    arm = vertex_position[:, here] - middle[:, vertex_block[here]]
    return total + np.einsum("tvi,tvj->tij", vertex_force[:, here], arm)


def outline_areas(network: Network, position: Floats, bare: Flags) -> Floats:
    """(...,) m2, summed over blocks `bare`, at positions (..., vertex, 2)."""
    a, b = _ends(network, position, bare)
    return 0.5 * (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=-1)


def outline_gradients(network: Network, position: Floats, displacement: Floats, bare: Flags) -> Floats:
    """Sum over blocks of area x displacement gradient (..., 2, 2) m2, as `zone_gradient` gives it for zones.

    position (vertex, 2) m; displacement (..., vertex, 2) m, linear between the ends of each edge.
    """
    a, b = _ends(network, position, bare)
    normal = np.stack([b[:, 1] - a[:, 1], a[:, 0] - b[:, 0]], axis=1)
    u, v = _ends(network, displacement, bare)
    return np.einsum("...ei,ej->...ij", 0.5 * (u + v), normal)


def _ends(network: Network, values: Floats, bare: Flags) -> tuple[Floats, Floats]:
    edge = network.edge[bare[network.edge_block]]
    return values[..., edge[:, 0], :], values[..., edge[:, 1], :]
