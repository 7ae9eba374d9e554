"""Blocks from joint sets and from given polygons: they fill the domain, and slivers go by the stated rule."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.joint_sets import JointSet, cut_by_sets, split
from graben.mechanics.blocks.shape.mending import mend
from graben.mechanics.blocks.shape.tessellation import edges_of
from graben.mechanics.plane import polygons

SLOPE = np.array([(0, 0), (8, 0), (8, 5), (4, 5), (3, 2), (0, 2)], dtype=float)
COMB = np.array(
    [(0, 0), (5, 0), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], float
)


def area(shapes):
    return sum(polygons.signed_area(s) for s in shapes)


def pieces_of(ring, point, direction):
    return [p for p, _ in split((ring, np.zeros(len(ring), dtype=int)), np.array(point), np.array(direction))]


def cut(outline, sets, seed):
    """Shapes and the sets of their edges."""
    return [list(part) for part in zip(*cut_by_sets(outline, sets, seed))]


def test_a_line_parts_a_comb_in_all_its_teeth():
    pieces = pieces_of(COMB, [0.0, 2.0], [1.0, 0.0])
    assert len(pieces) == 4
    assert area(pieces) == pytest.approx(polygons.signed_area(COMB), rel=1e-12)
    assert sorted(round(polygons.signed_area(p), 9) for p in pieces)[:3] == [1.0, 1.0, 1.0]
    # Through a corner, along a side, beside it.
    assert len(pieces_of(COMB, [0.0, 0.0], [1.0, 0.0])) == 1
    assert area(pieces_of(COMB, [0.0, 1.0], [1.0, 0.0])) == pytest.approx(area([COMB]))
    assert area(pieces_of(COMB, [0.0, 0.0], [0.6, 0.8])) == pytest.approx(area([COMB]))


def test_no_corner_crosses_a_line_that_cuts_nothing_and_thousands_of_joints_are_cut_soon():
    sets = [JointSet(0.3, 0.02), JointSet(1.9, 0.5, 0.5, 0.2, 0.3)]
    shapes, _ = cut(SLOPE, sets, seed=2)
    assert len(shapes) > 1000 and area(shapes) == pytest.approx(polygons.signed_area(SLOPE))
    across = np.array([-np.sin(0.3), np.cos(0.3)])
    assert max(np.ptp(s @ across) for s in shapes) < 0.0201  # none was passed over


def test_a_rock_of_which_mending_would_take_most_is_refused():
    shapes, _ = cut(SLOPE, [JointSet(0.3, 0.05), JointSet(1.9, 0.05)], seed=1)
    with pytest.raises(Refused, match="in blocks narrower than"):
        mend(shapes, shortest=0.1, thinnest=0.1)


def test_two_sets_across_each_other_give_bricks():
    square = np.array([(0, 0), (4, 0), (4, 4), (0, 4)], dtype=float)
    shapes, _ = cut(square, [JointSet(0.0, 1.0), JointSet(np.pi / 2, 0.5)], seed=1)
    assert area(shapes) == pytest.approx(16.0)
    sizes = np.array([np.ptp(s, axis=0) for s in shapes])
    inner = np.all(np.isclose(sizes, [0.5, 1.0]), axis=1)
    assert inner.sum() == 3 * 7
    blocks = mend(shapes, shortest=0.0, thinnest=0.0, smallest=0.0)
    assert blocks.size == len(shapes)
    assert np.allclose(sorted(map(tuple, blocks.outline)), sorted(map(tuple, square)))


@pytest.mark.parametrize("seed", range(6))
def test_scattered_sets_are_mended_into_sound_blocks(seed):
    sets = [
        JointSet(np.radians(20), 0.6, 0.8, np.radians(6), 0.4),
        JointSet(np.radians(-65), 0.7, 0.6, np.radians(10), 0.4),
    ]
    shapes, marks = cut(SLOPE, sets, seed)
    assert area(shapes) == pytest.approx(polygons.signed_area(SLOPE), rel=1e-9)
    blocks = mend(shapes, marks, shortest=0.15, thinnest=0.08)
    found, _ = polygons.areas_and_centroids(blocks.points, blocks.start, blocks.corner)
    # Corners that a collapse moved were inside or moved along the outline.
    assert found.sum() == pytest.approx(polygons.signed_area(SLOPE), rel=1e-6)
    assert found.min() > 0.015 * np.median([polygons.signed_area(s) for s in shapes])
    assert blocks.size > 20
    # Short edges go, at the outline too, but where a block would get a corner turned inwards or a needle.
    short = [np.hypot(*(blocks.points[a] - blocks.points[b])) for ring in blocks.rings for a, b in edges_of(ring)]
    assert np.sum(np.array(short) < 0.15) <= 3
    assert min(short) > 0.05
    # Every edge inside knows its set, and those long enough to have a direction run along its joints.
    bodies = build_bodies(blocks, 0.5)
    edge = bodies.position[bodies.edge_to] - bodies.position[bodies.edge_from]
    assert np.all((bodies.edge_set == 0) == (bodies.edge_side >= 0))
    for number, joints in enumerate(sets, start=1):
        long = (bodies.edge_set == number) & (np.hypot(*edge.T) > 0.3)
        off = np.angle(np.exp(2j * (np.arctan2(*edge[long].T[::-1]) - joints.dip))) / 2
        assert long.sum() > 20
        assert np.abs(off).max() < np.radians(45)
        assert np.abs(off).mean() < 2.0 * joints.dip_scatter
    assert bodies.block_area.sum() == pytest.approx(polygons.signed_area(SLOPE), rel=1e-6)
    # The outline is the domain's, straight sides in one piece.
    assert np.allclose(sorted(map(tuple, np.round(blocks.outline, 6))), sorted(map(tuple, SLOPE)))
    again = mend(*cut(SLOPE, sets, seed), shortest=0.15, thinnest=0.08)
    assert np.array_equal(again.points, blocks.points)


def test_persistence_cuts_its_share_of_blocks():
    square = np.array([(0, 0), (20, 0), (20, 20), (0, 20)], dtype=float)
    whole = len(cut_by_sets(square, [JointSet(0.0, 1.0), JointSet(np.pi / 2, 1.0)], 3))
    some = len(cut_by_sets(square, [JointSet(0.0, 1.0), JointSet(np.pi / 2, 1.0, 0.5)], 3))
    rows = 20
    assert (some - rows) / (whole - rows) == pytest.approx(0.5, abs=0.08)


def test_slivers_join_the_neighbour_with_the_longest_common_edge():
    wall = [
        np.array([(0, 0), (2, 0), (2, 1), (0, 1)], float),
        np.array([(0, 1), (2, 1), (2, 1.01), (0, 1.01)], float),
        np.array([(0, 1.01), (1, 1.01), (1, 2), (0, 2)], float),
        np.array([(1, 1.01), (2, 1.01), (2, 2), (1, 2)], float),
    ]
    blocks = mend(wall, shortest=0.0, thinnest=0.05)
    assert blocks.size == 3
    found, _ = polygons.areas_and_centroids(blocks.points, blocks.start, blocks.corner)
    assert sorted(found) == pytest.approx([0.99, 0.99, 2.02])
    # No corner in the middle of the long side: neighbours need not share corners.
    assert sorted(np.diff(blocks.start)) == [4, 4, 4]


def test_overlaps_and_crossings_are_refused():
    one = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    with pytest.raises(ValueError, match="overlap"):
        mend([one, one], shortest=0.0, thinnest=0.0)
    with pytest.raises(ValueError, match="simple"):
        mend([one[[0, 2, 1, 3]]], shortest=0.0, thinnest=0.0)
