"""What grips a rectangle in a compression: walls on the rock, supports of parts of it, or platens as bodies."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.blocks.shape.platens import BOTTOM, LEFT, RIGHT, TOP
from graben.mechanics.blocks.shape.rectangle import Sides, rectangle_sides


class Ends(Protocol):
    """What holds the bottom, moves the top and presses the sides.

    bottom, top : (vertices,) flags of what is held below and moved above
    """

    bottom: np.ndarray
    top: np.ndarray

    def grip(self, model: BlockModel, lateral: float, vertical: float) -> None:
        """Hold the bottom; press the sides with `lateral` and the top with `vertical` [Pa, tension positive].

        The rising load becomes a pressure of 1 Pa on the sides, for courses.
        """

    def take_over(self, model: BlockModel, speed: float) -> None:
        """From now on the top moves at a speed [m/s, positive: up], whatever that takes."""


class Walls:
    """Rollers below and a smooth wall above, on the rock itself; or supports in place of the rollers.

    held : (vertices, 2) flags along x and y, instead of the whole bottom along y
    """

    def __init__(self, bodies: Bodies, held: np.ndarray | None = None) -> None:
        self._sides = s = rectangle_sides(bodies.outline)
        self.top = bodies.vertex_side[:, s.top]
        self._held = np.zeros((len(bodies.position), 2), dtype=bool)
        self._held[bodies.vertex_side[:, s.bottom], 1] = True
        if held is not None:
            _refuse_contradictions(bodies, s, held)
            self._held = held
        self.bottom = self._held[:, 1]

    def grip(self, model: BlockModel, lateral: float, vertical: float) -> None:
        b, s = model.bodies, self._sides
        for axis in (1, 0):
            if self._held[:, axis].any():
                model.hold(self._held[:, axis], axis)
        for side in (s.left, s.right):
            model.press(b.edge_side == side, lateral)
            model.press(b.edge_side == side, -1.0, rising=True)
        model.press(b.edge_side == s.top, vertical)

    def take_over(self, model: BlockModel, speed: float) -> None:
        model.take_off_steady(self.top, 1)
        model.hold(self.top, 1, speed)


def _refuse_contradictions(bodies: Bodies, sides: Sides, held: np.ndarray) -> None:
    on = bodies.vertex_side
    if (held[:, 1] & on[:, sides.top]).any():
        raise Refused("no support along y that reaches the top, which moves")
    lateral = on[:, sides.left] | on[:, sides.right]
    if (held[:, 0] & lateral & ~on[:, sides.bottom] & ~on[:, sides.top]).any():
        raise Refused("no support along x on the left or right side, where the confining pressure acts")
    if not (held[:, 1] & on[:, sides.bottom]).any():
        raise Refused("at least one support that holds a part of the bottom along y")


class Platens:
    """Platens as bodies, see `shape.platens`: blocks that touch the rock through contacts of their own.

    They do not turn. Those below and above stay in their place along x, those at the sides along y.
    elastic : the machine holds their outer faces only; else it holds them whole
    sides : platens at left and right pass the lateral pressure on; else it acts on the rock itself
    """

    def __init__(self, bodies: Bodies, *, elastic: bool = False) -> None:
        self._sides = rectangle_sides(bodies.outline)
        self._size = np.ptp(bodies.outline, axis=0)
        self.at_sides = bodies.platens == 4
        self._faces = [_outer_face(bodies, bodies.rock + k, k) for k in range(bodies.platens)]
        self._gripped = []
        for k in range(bodies.platens):
            here = bodies.vertex_block == bodies.rock + k
            if elastic:
                face = self._faces[k]
                here = np.zeros_like(here)
                here[bodies.edge_from[face]] = here[bodies.edge_to[face]] = True
            self._gripped.append(here)
        self.bottom, self.top = self._gripped[BOTTOM], self._gripped[TOP]

    def grip(self, model: BlockModel, lateral: float, vertical: float) -> None:
        b, s = model.bodies, self._sides
        model.hold(self.bottom, 0)
        model.hold(self.bottom, 1)
        model.hold(self.top, 0)
        self._press(model, TOP, vertical)
        for side, platen in ((s.left, LEFT), (s.right, RIGHT)):
            if self.at_sides:
                model.hold(self._gripped[platen], 1)
                self._press(model, platen, lateral)
                self._press(model, platen, -1.0, rising=True)
            else:
                model.press(b.edge_side == side, lateral)
                model.press(b.edge_side == side, -1.0, rising=True)

    def _press(self, model: BlockModel, platen: int, stress: float, rising: bool = False) -> None:
        """Press the outer face such that the rock gets `stress`, though the platen is longer."""
        b, face = model.bodies, self._faces[platen]
        axis = 1 if platen in (LEFT, RIGHT) else 0
        length = np.abs(b.position[b.edge_to[face], axis] - b.position[b.edge_from[face], axis]).sum()
        model.press(face, stress * self._size[axis] / length, rising)

    def take_over(self, model: BlockModel, speed: float) -> None:
        model.take_off_steady(self.top, 1)
        model.hold(self.top, 1, speed)


def _outer_face(bodies: Bodies, block: int, platen: int) -> np.ndarray:
    """Outline edges (indices) of a platen on the side away from the rock."""
    a, b = bodies.position[bodies.edge_from], bodies.position[bodies.edge_to]
    mine = bodies.vertex_block[bodies.edge_from] == block
    axis = 1 if platen in (BOTTOM, TOP) else 0
    place = 0.5 * (a + b)[:, axis]
    low, high = place[mine].min(), place[mine].max()
    far = low if platen in (BOTTOM, LEFT) else high
    return np.flatnonzero(mine & (np.abs(place - far) <= 1e-9 * max(high - low, 1e-300)))
