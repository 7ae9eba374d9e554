"""Dead loads on an outline that follow courses over the time of loading."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course


class Loads:
    """Patterns of vertex forces, each times its course over time; on top of the weight.

    The compiled loop knows one load that rises evenly: between two points of any course all of them together are.
    """

    def __init__(self, vertices: int) -> None:
        self.patterns: list[tuple[np.ndarray, Course]] = []
        self.direction = np.zeros((vertices, 2))

    def add(self, force: np.ndarray, course: Course, *, leading: bool = True) -> None:
        """A load: force (vertices, 2) [N/m] per unit of its course.

        `direction`, along which settlement counts, is the sum of leading loads at their fastest rates.
        """
        self.patterns.append((force, course))
        if leading:
            self.direction += course.fastest_rate * force

    def take_off(self, vertices: np.ndarray) -> None:
        """No load acts on these vertices (flags) any more."""
        for force, _ in self.patterns:
            force[vertices] = 0.0
        self.direction[vertices] = 0.0

    def begin(self, model: BlockModel, time: float) -> None:
        """Set the model's loads for the stretch from `time` to the next point."""
        steady, rising = model.weight.copy(), np.zeros_like(model.weight)
        for force, course in self.patterns:
            steady += course.at(time) * force
            rising += course.slope(time) * force
        model.set_loads(steady, rising)

    def next_point(self, time: float) -> float:
        """Time of the next point of any course; infinite after the last."""
        return min((course.next_point(time) for _, course in self.patterns), default=float("inf"))
