"""Which blocks an excavation takes out."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.plane.polygons import areas_and_centroids, inside


def blocks_in(model: BlockModel, polygon: np.ndarray) -> np.ndarray:
    """Flags (blocks,) of those not yet removed whose centroid lies in a polygon (m, 2) [m]."""
    b = model.bodies
    _, centre = areas_and_centroids(model.motion.x, b.block_start, b.block_corner)
    return inside(centre, polygon) & ~model.removed
