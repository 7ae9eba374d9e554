"""Blocks cut out of a polygon by sets of joints: parallel lines with spacing, scatter and persistence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.mechanics.plane import polygons


@dataclass(frozen=True)
class JointSet:
    """One set of joints.

    dip : angle of the lines from the x axis, counter-clockwise [rad]; spacing : mean distance [m]
    dip_scatter : standard deviation of each line's angle [rad]; spacing_scatter : of each distance, over the spacing
    persistence : probability that a block which a line crosses is cut by it. A joint that ends inside a block would
    carry nothing between blocks, so it goes through or is left out.
    """

    dip: float
    spacing: float
    persistence: float = 1.0
    dip_scatter: float = 0.0
    spacing_scatter: float = 0.0


# A polygon (m, 2) and, of the edge from each of its corners to the next, the set of joints that cut it (0: none).
Marked = tuple[np.ndarray, np.ndarray]


def cut_by_sets(outline: np.ndarray, sets: list[JointSet], seed: int) -> list[Marked]:
    """Blocks, counter-clockwise, that the joints of all sets, one set after the other, leave of the outline.

    The first set has the number 1; sides of the outline have 0.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    outline = np.asarray(outline, dtype=float)
    ring = outline if polygons.signed_area(outline) > 0.0 else outline[::-1].copy()
    blocks: list[Marked] = [(ring, np.zeros(len(ring), dtype=np.int64))]
    corners, size = ring, np.array([len(ring)])
    for number, joints in enumerate(sets, start=1):
        for point, direction in _lines(outline, joints, rng):
            left: list[Marked] = []
            rings, sizes, done = [], [], 0
            first = np.append(0, np.cumsum(size))
            for k in _near(corners, size, point, direction):
                pieces = split(blocks[k], point, direction, number)
                # One draw for each block that is crossed, whatever the persistence.
                if len(pieces) > 1 and rng.random() < joints.persistence:
                    left += blocks[done:k] + pieces
                    rings += [corners[first[done] : first[k]], *(r for r, _ in pieces)]
                    sizes += [size[done:k], [len(r) for r, _ in pieces]]
                    done = k + 1
            if done:
                blocks = left + blocks[done:]
                corners = np.vstack([*rings, corners[first[done] :]])
                size = np.concatenate([*sizes, size[done:]]).astype(np.int64)
    return blocks


def _near(corners: np.ndarray, size: np.ndarray, point: np.ndarray, direction: np.ndarray) -> list[int]:
    """Numbers of the blocks that a line may cross; corners (n, 2) of all blocks in turn, size: how many each has."""
    r = corners - point
    side = direction[0] * r[:, 1] - direction[1] * r[:, 0]
    first = np.cumsum(size) - size
    hair = 1e-8 * float(np.abs(side).max())
    crossed = (np.minimum.reduceat(side, first) < hair) & (np.maximum.reduceat(side, first) > -hair)
    return np.flatnonzero(crossed).tolist()


def _lines(outline: np.ndarray, joints: JointSet, rng: np.random.Generator):
    """A point and a unit direction of every line of a set that may cross the outline."""
    centre = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    reach = 0.5 * float(np.hypot(*np.ptp(outline, axis=0)))
    normal = np.array([-np.sin(joints.dip), np.cos(joints.dip)])
    at = -reach + joints.spacing * rng.random()
    while at < reach:
        angle = joints.dip + joints.dip_scatter * rng.standard_normal()
        yield centre + at * normal, np.array([np.cos(angle), np.sin(angle)])
        # A tenth of the spacing at least: lines that nearly coincide make slivers only.
        at += joints.spacing * max(0.1, 1.0 + joints.spacing_scatter * rng.standard_normal())


def split(block: Marked, point: np.ndarray, direction: np.ndarray, number: int = 0) -> list[Marked]:
    """The pieces of a simple polygon on both sides of a line, cut edges marked `number`; [block] where it misses."""
    ring, marks = block
    r = ring - point
    side = direction[0] * r[:, 1] - direction[1] * r[:, 0]
    # A corner on the line counts as above it, by a hair.
    size = float(np.ptp(ring, axis=0).max())
    side = np.where(np.abs(side) < 1e-9 * size, 1e-9 * size, side)
    pieces = _split(ring, marks, side, point, direction, number)
    return [p for p in pieces if abs(polygons.signed_area(p[0])) > 1e-12 * size**2]


def _split(ring, marks, side, point, direction, number) -> list[Marked]:
    following = np.roll(side, -1)
    crossed = np.flatnonzero((side > 0.0) != (following > 0.0))
    if len(crossed) == 0:
        return [(ring, marks)]
    f = side[crossed] / (side[crossed] - following[crossed])
    at = ring[crossed] + f[:, None] * (np.roll(ring, -1, axis=0)[crossed] - ring[crossed])
    # The line enters at its first crossing and leaves at the second: a chord, which parts the polygon in two.
    order = np.argsort((at - point) @ direction, kind="stable")[:2]
    first, second = sorted(order.tolist())
    i, j = int(crossed[first]), int(crossed[second])
    p, q = at[first], at[second]
    pieces = []
    around = np.arange(len(ring))
    for k, inner, ends in (
        (i, around[i + 1 : j + 1], (p, q)),
        (j, np.concatenate([around[j + 1 :], around[: i + 1]]), (q, p)),
    ):
        whole = np.vstack([ends[0], ring[inner], ends[1]])
        # The ends lie on the line: each goes with its neighbour, so this chord is not found again.
        sides = side[np.concatenate([inner[:1], inner, inner[-1:]])]
        edges = np.concatenate([marks[[k]], marks[inner], [number]])
        pieces += _split(whole, edges, sides, point, direction, number)
    return pieces
