"""Platens as bodies: blocks beside a rectangle of blocks, below and above it, and at its sides where wanted.

They come after the blocks of the rock, so the rock keeps its numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graben.mechanics.blocks.shape.tessellation import Tessellation

# Order of the platens after the last block of the rock.
BOTTOM, TOP, LEFT, RIGHT = range(4)


@dataclass(frozen=True)
class PlatenShape:
    """thickness : of each platen, overhang : reach beyond the rock at both ends [m]

    sides : also at left and right; divided : corner points along the faces, at distances of the thickness, so that
    the platen can bend
    """

    thickness: float
    overhang: float
    sides: bool = False
    divided: bool = False


def with_platens(rock: Tessellation, shape: PlatenShape) -> Tessellation:
    """The blocks of an upright rectangle, and platens that touch it."""
    low, high = rock.outline.min(axis=0), rock.outline.max(axis=0)
    (x0, y0), (x1, y1), t, o = low, high, shape.thickness, shape.overhang
    boxes = [(x0 - o, y0 - t, x1 + o, y0), (x0 - o, y1, x1 + o, y1 + t)]
    if shape.sides:
        boxes += [(x0 - t, y0 - o, x0, y1 + o), (x1, y0 - o, x1 + t, y1 + o)]
    rings = [_ring(box, t if shape.divided else np.inf) for box in boxes]
    ends = np.cumsum([len(rock.points), *(len(ring) for ring in rings)])
    return replace(
        rock,
        points=np.vstack([rock.points, *rings]),
        start=np.concatenate([rock.start, len(rock.corner) + ends[1:] - ends[0]]),
        corner=np.concatenate([rock.corner, np.arange(ends[0], ends[-1])]),
        edge_set=None if rock.edge_set is None else np.append(rock.edge_set, np.zeros(ends[-1] - ends[0], int)),
        platens=len(rings),
    )


def _ring(box: tuple[float, float, float, float], longest: float) -> np.ndarray:
    """Corner points (n, 2) of a box, counter-clockwise; sides longer than 1.5 `longest` [m] get points between."""
    x0, y0, x1, y1 = box
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    sides = np.roll(corners, -1, axis=0) - corners
    parts = np.maximum(1, np.rint(np.linalg.norm(sides, axis=1) / longest)).astype(int)
    return np.vstack([a + np.arange(n)[:, None] / n * d for a, d, n in zip(corners, sides, parts)])
