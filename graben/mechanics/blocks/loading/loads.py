"""Dead loads on an outline: pressures on its segments, which follow courses over the time of loading.

They keep the direction and the length of the outline's first shape.
"""

from __future__ import annotations

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.shape.bodies import Bodies


class Loads:
    """Patterns of vertex forces, each times its course over time; on top of the weight.

    The compiled loop knows one load that rises evenly: between two points of any course all of them together are.
    """

    def __init__(self, vertices: int) -> None:
        self.patterns: list[tuple[np.ndarray, Course]] = []
        self.direction = np.zeros((vertices, 2))
        self.pressed = np.zeros(vertices, dtype=bool)

    def add(self, force: np.ndarray, course: Course, *, leading: bool = True) -> None:
        """A load: force (vertices, 2) [N/m] per unit of its course.

        `direction`, along which settlement counts, is the sum of leading loads at their fastest rates; `pressed` are
        the vertices (flags) on which a leading load ever acts.
        """
        self.patterns.append((force, course))
        if leading:
            self.direction += course.fastest_rate * force
            self.pressed |= force.any(axis=1) & course.acts

    def take_off(self, vertices: np.ndarray) -> None:
        """No load acts on these vertices (flags) any more."""
        for force, _ in self.patterns:
            force[vertices] = 0.0
        self.direction[vertices] = 0.0
        self.pressed[vertices] = False

    def begin(self, model: BlockModel, time: float) -> None:
        """Set the model's loads for the stretch from `time` to the next point."""
        steady, rising = model.weight.copy(), np.zeros_like(model.weight)
        for force, course in self.patterns:
            steady += course.at(time) * force
            rising += course.slope(time) * force
        model.set_loads(steady, rising)

    def stay(self, model: BlockModel, time: float) -> None:
        """Set the model's loads to those of a time; they stay."""
        model.set_loads(model.weight + self._at(time), np.zeros_like(model.weight))

    def between(self, model: BlockModel, start: float, end: float, steps: int) -> None:
        """Let the model's loads go from those of one time to those of another in so many steps."""
        first = self._at(start)
        model.set_loads(model.weight + first, self._at(end) - first)
        model.set_load(0.0, 1.0 / steps)

    def _at(self, time: float) -> np.ndarray:
        """Sum of the loads (vertices, 2) at a time."""
        return sum((course.at(time) * force for force, course in self.patterns), np.zeros_like(self.direction))

    def apart(self, start: float, end: float) -> float:
        """How far the loads of two times are apart, over the mean of both; infinite where that is nothing."""
        first, last = self._at(start), self._at(end)
        apart, mean = (float(np.linalg.norm(v)) for v in (last - first, 0.5 * (first + last)))
        return apart / mean if mean > 0.0 else (np.inf if apart > 0.0 else 0.0)

    def next_point(self, time: float) -> float:
        """Time of the next point of any course; infinite after the last."""
        return min((course.next_point(time) for _, course in self.patterns), default=float("inf"))

    def next_turn(self, time: float) -> float:
        """Time of the next point at which any course jumps or turns; infinite after the last."""
        return min((course.next_turn(time) for _, course in self.patterns), default=float("inf"))


def on_segment(bodies: Bodies, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vertices (flags) on the outline that lie on a segment (start, end: (2,) m)."""
    d = np.asarray(end, float) - np.asarray(start, float)
    r = bodies.position - start
    size = float(np.ptp(bodies.outline, axis=0).max())
    along = np.clip((r @ d) / float(d @ d), 0.0, 1.0)
    near = np.linalg.norm(r - along[:, None] * d, axis=1) < 1e-6 * size
    return near & bodies.vertex_side.any(axis=1)


def pressure_forces(bodies: Bodies, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Vertex forces (vertices, 2) [N/m] of a pressure of 1 Pa on the part of the outline along a segment.

    Edges that the segment covers in part take their part, with its moment. Refused when it covers none.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    d = end - start
    length = float(np.linalg.norm(d))
    tangent = d / length
    size = float(np.ptp(bodies.outline, axis=0).max())
    on = bodies.edge_side >= 0
    a, b = bodies.edge_from[on], bodies.edge_to[on]
    p, q = bodies.position[a] - start, bodies.position[b] - start
    off = np.maximum(*(np.abs(r[:, 0] * tangent[1] - r[:, 1] * tangent[0]) for r in (p, q)))
    sp, sq = p @ tangent, q @ tangent
    beside = (off < 1e-6 * size) & (np.minimum(sp, sq) < length) & (np.maximum(sp, sq) > 0.0)
    a, b, sp, sq = a[beside], b[beside], sp[beside], sq[beside]
    if len(a) == 0:
        raise Refused("a segment on the outline; no part of the outline lies on it")
    # Covered part of each edge, as fractions of it from its first vertex.
    f0, f1 = np.clip((0.0 - sp) / (sq - sp), 0.0, 1.0), np.clip((length - sp) / (sq - sp), 0.0, 1.0)
    f0, f1 = np.minimum(f0, f1), np.maximum(f0, f1)
    to_b = 0.5 * (f1**2 - f0**2)
    to_a = (f1 - f0) - to_b
    edge = bodies.position[b] - bodies.position[a]
    inward = np.column_stack([-edge[:, 1], edge[:, 0]])
    force = np.zeros_like(bodies.position)
    np.add.at(force, a, to_a[:, None] * inward)
    np.add.at(force, b, to_b[:, None] * inward)
    return force


def settlement_of(direction: np.ndarray, moved: np.ndarray) -> float:
    """Displacement along the loads [m]; where no load changes, the mean distance that vertices went."""
    whole = float(np.hypot(*direction.T).sum())
    return float((direction * moved).sum() / whole) if whole > 0.0 else float(np.hypot(*moved.T).mean())
