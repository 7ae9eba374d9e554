"""Blocks that fall: under weight, one that no other bears any more, or that left its place, has failed."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel

# A block has fallen when it dropped by this share of its size since nothing bore it, or moved by its size in all
# while the body should come to rest.
_DROP = 0.1


class Falling:
    """Watches the blocks of a model that has weight.

    step : (blocks,) step at which each block that has fallen lost its last contact, -1 for the others
    """

    def __init__(self, model: BlockModel) -> None:
        weight = model.weight.sum(axis=0)
        size = float(np.hypot(*weight))
        count = len(model.bodies.block_area)
        self._down = weight / size if size > 0.0 else np.zeros(2)
        self._size = np.sqrt(model.bodies.block_area)
        self._begin = self._centres(model)
        self.step = np.full(count, -1, dtype=np.int64)
        self._lost_at = np.full(count, -1, dtype=np.int64)
        self._height = np.zeros(count)

    @property
    def blocks(self) -> np.ndarray:
        """Numbers of the blocks that have fallen."""
        return np.flatnonzero(self.step >= 0)

    def look(self, model: BlockModel, *, resting: bool = False) -> bool:
        """Whether another block has fallen by now. resting : the body should come to rest, so that none goes far."""
        if not self._down.any():
            return False
        centre = self._centres(model)
        height = -(centre @ self._down)
        loose = model.loose_blocks() & ~model.removed
        lost = loose & (self._lost_at < 0)
        self._lost_at[lost], self._height[lost] = model.steps_done, height[lost]
        self._lost_at[~loose] = -1
        gone = loose & (self._height - height > _DROP * self._size)
        if resting:
            gone |= (np.hypot(*(centre - self._begin).T) > self._size) & ~model.removed
        new = gone & (self.step < 0)
        self.step[new] = np.where(self._lost_at[new] >= 0, self._lost_at[new], model.steps_done)
        return bool(new.any())

    def _centres(self, model: BlockModel) -> np.ndarray:
        block, count = model.bodies.vertex_block, len(model.bodies.block_area)
        total = np.column_stack([np.bincount(block, x, count) for x in model.motion.x.T])
        return total / np.bincount(block, minlength=count)[:, None]

    def state(self) -> dict[str, np.ndarray]:
        """What a saved state must hold."""
        return {
            "fallen_step": self.step.copy(),
            "fallen_lost_at": self._lost_at.copy(),
            "fallen_height": self._height.copy(),
        }

    def bring_back(self, state: dict[str, np.ndarray]) -> None:
        """Take up a state."""
        self.step, self._lost_at = state["fallen_step"].copy(), state["fallen_lost_at"].copy()
        self._height = state["fallen_height"].copy()
