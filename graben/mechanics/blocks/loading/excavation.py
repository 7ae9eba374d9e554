"""Excavations: when, and which blocks they take out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.plane.polygons import areas_and_centroids, inside


@dataclass(frozen=True)
class Dig:
    """Blocks whose middle lies in a polygon (m, 2) [m] are taken out at a load time [s]; the forces with which they
    held the others fade over `relax_over` [s], 0: at once."""

    polygon: np.ndarray
    time: float
    relax_over: float = 0.0


def blocks_in(model: BlockModel, polygon: np.ndarray) -> np.ndarray:
    """Flags (blocks,) of those not yet removed whose centroid lies in a polygon (m, 2) [m]."""
    b = model.bodies
    _, centre = areas_and_centroids(model.motion.x, b.block_start, b.block_corner)
    return inside(centre, polygon) & ~model.removed
