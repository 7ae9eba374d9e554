"""The rock of a model with platens: what is saved of it, as if the platens were forces on its outline."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.blocks.shape.rectangle import rectangle_sides


class RockPart:
    """vertex, zone : flags of what belongs to the rock; blocks : their number; number : (vertices,) the new ones"""

    def __init__(self, bodies: Bodies) -> None:
        self.blocks = bodies.rock
        self.vertex = bodies.vertex_block < self.blocks
        self.zone = bodies.zone_block < self.blocks
        self.number = np.cumsum(self.vertex) - 1

    def state_of_blocks(self, model: BlockModel) -> dict[str, np.ndarray]:
        """As `ModelState.state_of_blocks`, of the rock."""
        state = model.state_of_blocks()
        return {k: v[: self.blocks] if k.startswith("block_") else v[self.zone] for k, v in state.items()}

    def pairs(self, model: BlockModel) -> np.ndarray:
        """Flags of the candidates between blocks of the rock."""
        block, p = model.skin.block, model.pairs
        return np.asarray((block[p.first] < self.blocks) & (block[p.second] < self.blocks))

    def platen_forces(self, model: BlockModel) -> np.ndarray:
        """Forces (platens, vertices, 2) of each platen on the vertices of the rock [N/m]."""
        block, p = model.skin.block, model.pairs
        larger = np.maximum(block[p.first], block[p.second])
        forces = [model.contact_force(larger == self.blocks + k) for k in range(model.bodies.platens)]
        return np.stack(forces) * self.vertex[:, None]


def on_sides(force: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Forces (sides, 2) on the sides of a rectangle from the forces (platens, vertices, 2) of its platens [N/m]."""
    sides = rectangle_sides(outline)
    total = np.zeros((4, 2))
    total[[sides.bottom, sides.top, sides.left, sides.right][: len(force)]] = force.sum(axis=1)
    return total
