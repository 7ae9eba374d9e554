"""What closes the balance of forces at a saved state: weight and inertia, and the overlap of blocks at their joints.

Stress by zones and stress by forces are one number only with both: over the blocks inside an outline, sum of zone
area x stress = sum of force (x) position of the contacts across it, of walls and of body forces, + overlap moments.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.contact.nodes import scatter_nodes
from graben.mechanics.blocks.engine.model import BlockModel


class Balance(NamedTuple):
    """body_force : (vertices, 2) weight less mass x acceleration less damping [N/m]; with zones, joints and walls it
    adds up to nothing.
    overlap_moment : (blocks, 4) xx, yy, zz (0), xy [N]: blocks bear on each other with their edges, contacts lie
    midway; force (x) distance between the two.
    """

    body_force: np.ndarray
    overlap_moment: np.ndarray


def balance(
    model: BlockModel, zone_stress: np.ndarray, boundary_force: np.ndarray, among: np.ndarray | None = None
) -> Balance:
    """Balance of the present state. zone_stress : (zones, 4) [Pa]; boundary_force : (vertices, 2) [N/m].

    among : flags of the pairs that are joints, None: all; what the others do is among the boundary forces
    """
    b, s, x = model.bodies, model.skeleton, model.motion.x
    nodal = np.zeros((len(s.first), 2))
    out, ints, _ = model.contacts(nodal, among)
    joint = np.zeros_like(x)
    scatter_nodes(nodal, s.first, s.second, s.weight, joint, 0, len(nodal))
    body = zone_pull(x, b.zone_vertex, zone_stress) - joint - boundary_force
    # First moments of the same joint forces, as vertices and as contacts have them; about a point of each block.
    n = len(b.block_area)
    total = np.column_stack([np.bincount(b.vertex_block, c, minlength=n) for c in x.T])
    middle = total / np.bincount(b.vertex_block, minlength=n)[:, None]
    moment = np.zeros((n, 2, 2))
    arm = x - middle[b.vertex_block]
    np.add.at(moment, b.vertex_block, joint[:, :, None] * arm[:, None, :])
    along = out[:, 11:13, None] * out[:, None, 9:11]
    pair = ints[:, 0]
    for edge, sign in ((model.pairs.first[pair], 1.0), (model.pairs.second[pair], -1.0)):
        block = model.skin.block[edge]
        arm = out[:, 0:2] - middle[block]
        np.add.at(moment, block, -sign * (out[:, 2:4, None] * arm[:, None, :] + along))
    symmetric = [moment[:, 0, 0], moment[:, 1, 1], np.zeros(n), 0.5 * (moment[:, 0, 1] + moment[:, 1, 0])]
    return Balance(body, np.column_stack(symmetric))


def zone_pull(x: np.ndarray, zone_vertex: np.ndarray, zone_stress: np.ndarray) -> np.ndarray:
    """Forces (vertices, 2) that zones of Cauchy stress (zones, 4) need from outside to be in balance [N/m]."""
    p = x[zone_vertex]
    # Area x gradient of the shape function: half the side opposite the corner, turned towards the corner.
    side = np.roll(p, 1, axis=1) - np.roll(p, -1, axis=1)
    inward = 0.5 * np.stack([-side[..., 1], side[..., 0]], axis=-1)
    tensor = np.empty((len(zone_stress), 2, 2))
    tensor[:, 0, 0], tensor[:, 1, 1] = zone_stress[:, 0], zone_stress[:, 1]
    tensor[:, 0, 1] = tensor[:, 1, 0] = zone_stress[:, 3]
    pull = np.zeros_like(x)
    np.add.at(pull, zone_vertex, np.einsum("zij,zkj->zki", tensor, inward))
    return pull
