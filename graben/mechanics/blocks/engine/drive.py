"""What drives a model: dead loads, steady and rising, and how far prescribed velocities have come."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.records import BRAKE, LOAD, LOAD_STEP, SPEED, SPEED_STEP
from graben.mechanics.blocks.engine.state import ModelState


class DrivenModel(ModelState):
    """A model whose loads can be set; `BlockModel` steps it."""

    def set_load(self, factor: float, per_step: float = 0.0) -> None:
        """The rising load counts `factor` times now, and by `per_step` more after each step."""
        self.motion.drive[LOAD], self.motion.drive[LOAD_STEP] = factor, per_step

    def raise_load(self, per_step: float, brake: float = 0.0) -> None:
        """The rising load grows from where it is by `per_step` a step, and falls by `brake` times its way; 0: it
        stays."""
        self.motion.drive[LOAD_STEP], self.motion.drive[BRAKE] = per_step, brake

    def set_speed(self, factor: float, per_step: float = 0.0) -> None:
        """Prescribed velocities count `factor` times in the next step, and by `per_step` more after each, up to 1."""
        self.motion.drive[SPEED], self.motion.drive[SPEED_STEP] = factor, per_step

    def press(self, edges: np.ndarray, normal_stress: float, rising: bool = False) -> None:
        """Add a normal stress [Pa, tension positive] on outline edges (indices or mask), as steady or rising load.

        The force keeps the direction and the length that the edges have now.
        """
        b, x = self.bodies, self.motion.x
        a, c = b.edge_from[edges], b.edge_to[edges]
        d = x[c] - x[a]
        half = 0.5 * normal_stress * np.column_stack([d[:, 1], -d[:, 0]])
        target = self.skeleton.rising if rising else self.skeleton.steady
        np.add.at(target, a, half)
        np.add.at(target, c, half)

    def set_loads(self, steady: np.ndarray, rising: np.ndarray) -> None:
        """Dead loads (vertices, 2) [N/m] instead of those before: steady ones with the weight, and rising ones that
        stay at a factor of 0."""
        self.skeleton.steady[:], self.skeleton.rising[:] = steady, rising
        self.set_load(0.0)

    def take_off_steady(self, vertices: np.ndarray, axis: int) -> None:
        """No steady load but the weight acts on vertices (indices or mask) along an axis."""
        self.skeleton.steady[vertices, axis] = self.weight[vertices, axis]
