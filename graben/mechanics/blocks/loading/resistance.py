"""What inertia and damping take up while a model moves, from means over the steps between two looks at it."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel


class Resistance:
    """Velocities are means between looks, so vibration drops out of the acceleration.

    force : (vertices, 2) that inertia and damping take up [N/m]; velocity : (vertices, 2) mean since the look before
    [m/s]; seconds : between the last two looks
    counted : (vertices,) flags of those whose share counts in `work`: weight drives what falls, and no load bears it
    """

    def __init__(self, model: BlockModel) -> None:
        self.force = np.zeros_like(model.motion.x)
        self.velocity = np.zeros_like(model.motion.x)
        self.seconds = 0.0
        self.counted = np.ones(len(model.motion.x), dtype=bool)
        self.begin(model)

    def begin(self, model: BlockModel) -> None:
        """What comes next counts from the present state."""
        self._x, self._time = model.motion.x.copy(), model.time

    def look(self, model: BlockModel) -> None:
        """Bring forces and velocities up to date; the model has moved on since the last look."""
        seconds = model.time - self._time
        mean = (model.motion.x - self._x) / seconds
        acceleration = (mean - self.velocity) / (0.5 * (seconds + (self.seconds or seconds)))
        self.force = model.resistance(acceleration, mean)
        self.velocity, self.seconds = mean, seconds
        self.begin(model)

    @property
    def work(self) -> float:
        """Energy that went into inertia and damping between the last two looks [J/m]."""
        return float((self.force * self.velocity)[self.counted].sum()) * self.seconds

    def state(self) -> dict[str, np.ndarray]:
        """What a saved state must hold."""
        return {
            "velocity": self.velocity,
            "velocity_seconds": np.array(self.seconds),
            "velocity_counted": self.counted.copy(),
        }

    def bring_back(self, model: BlockModel, state: dict[str, np.ndarray]) -> None:
        """Take up a state of a model that stands where it stood."""
        self.velocity, self.seconds = state["velocity"], float(state["velocity_seconds"])
        self.counted = state["velocity_counted"].copy()
        self.begin(model)
