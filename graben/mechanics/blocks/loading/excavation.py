"""Blocks taken out of a model: they lose their zones, contacts, loads and weight, and stay behind as fixed ghosts.

Indices of blocks, zones and vertices stay as they are, so that states before and after fit together.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.nodes import scatter_nodes
from graben.mechanics.blocks.engine import relaxation as rx
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.plane.polygons import areas_and_centroids, inside


def blocks_in(model: BlockModel, polygon: np.ndarray) -> np.ndarray:
    """Flags (blocks,) of those not yet removed whose centroid lies in a polygon (m, 2) [m]."""
    b = model.bodies
    _, centre = areas_and_centroids(model.motion.x, b.block_start, b.block_corner)
    return inside(centre, polygon) & ~model.removed


def excavate(model: BlockModel, blocks: np.ndarray) -> np.ndarray:
    """Take out blocks (flags); returns the forces (vertices, 2) [N/m] with which they held the others just before.

    What they stored and moved with leaves the ledger as `excavated`.
    """
    b, m = model.bodies, model.motion
    there = blocks[b.vertex_block]
    forces, stored = _joint_forces(model), _stored(model)
    kinetic = model.kinetic_energy(blocks)
    model.removed |= blocks
    forget_removed(model)
    m.v[there] = 0.0
    m.tally[rx.KINETIC] -= kinetic
    for force in (model.skeleton.steady, model.skeleton.rising, m.zone_force, m.joint_force):
        force[there] = 0.0
    for axis in (0, 1):
        model.hold(there, axis)
    m.reaction[there] = 0.0
    model.rebuild()
    model.excavated += stored - _stored(model) + kinetic
    forces -= _joint_forces(model)
    forces[there] = 0.0
    m.joint_force[:] -= forces
    return forces


def forget_removed(model: BlockModel) -> None:
    """Zones and weight of removed blocks count for nothing."""
    model.skeleton.zones.area[model.removed[model.bodies.zone_block]] = 0.0
    model.weight[model.removed[model.bodies.vertex_block]] = 0.0


def _stored(model: BlockModel) -> float:
    e = model.energies()
    return e["strain"] + e["joint"]


def _joint_forces(model: BlockModel) -> np.ndarray:
    """Forces of all contacts on vertices, as they stand."""
    s, nodal = model.skeleton, np.zeros((len(model.skeleton.first), 2))
    model.contacts(nodal)
    force = np.zeros_like(model.motion.x)
    scatter_nodes(nodal, s.first, s.second, s.weight, force, 0, len(nodal))
    return force
