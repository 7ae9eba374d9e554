"""Maps as coverages: sound ones stay as they are wherever they lie, small faults are snapped, others are placed."""

import numpy as np
import pytest

from graben.mechanics.blocks.shape.coverage import Given, sound
from graben.mechanics.blocks.shape.mending import mend

# Three by two blocks of unequal size.
X, Y = [0.0, 1.5, 3.2, 5.0], [0.0, 2.0, 3.5]
BLOCKS = [
    np.array([(X[i], Y[j]), (X[i + 1], Y[j]), (X[i + 1], Y[j + 1]), (X[i], Y[j + 1])])
    for j in range(2)
    for i in range(3)
]
BOX = np.array([(0.0, 0.0), (5.0, 0.0), (5.0, 3.5), (0.0, 3.5)])


def check(rings, domain=None, openings=(), origin=(0.0, 0.0)):
    rings = [np.array(r, float) for r in rings]
    sets = [np.arange(len(r)) for r in rings]
    names = [f"block {k}" for k in range(len(rings))]
    return sound(Given(rings, sets, names, np.array(origin), domain, openings))


def changed(k, corners, rings=BLOCKS):
    return [np.array(corners, float) if n == k else r for n, r in enumerate(rings)]


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(c, s), (-s, c)])


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("turn", [turned(0.0), turned(np.pi / 2), turned(0.3), np.diag([-1.0, 1.0])])
def test_a_sound_map_stays_as_it_is_at_any_scale_turned_and_mirrored(scale, turn):
    rings = [scale * r @ turn for r in BLOCKS]
    for domain in (None, scale * BOX @ turn):
        found = check(rings, domain)
        assert found.faults == []
        assert found.corners == 0
        assert all(np.array_equal(a, b) for a, b in zip(found.rings, rings, strict=True))


@pytest.mark.parametrize("offset", [1e6, 1e7])
def test_digits_that_coordinates_lose_far_from_zero_make_no_faults(offset):
    rings = [(r @ turned(0.3) + offset) - offset for r in BLOCKS]
    assert check(rings, origin=(offset, offset)).faults == []


def test_collinear_hanging_and_repeated_corners_are_no_faults():
    ring = [(0, 0), (0.4, 0), (1.5, 0), (1.5, 0), (1.5, 0.7), (1.5, 1.1), (1.5, 2), (0, 2), (0, 2), (0, 0)]
    found = check(changed(0, ring), BOX)
    assert found.faults == []
    assert len(found.rings[0]) == 7
    # The sets of joints go with the edges that are left.
    assert found.sets[0].tolist() == [0, 1, 3, 4, 5, 6, 8]
    blocks = mend(found.rings, shortest=0.0, thinnest=0.0)
    assert sorted(np.diff(blocks.start)) == [4] * 6


@pytest.mark.parametrize("origin", [(0.0, 0.0), (412_345.67, 5_312_345.67)])
def test_edges_miss_corners_by_more_where_coordinates_are_rounded(origin):
    # A slope of 1 in 7 with corners of two narrower blocks on it, all to the centimetre.
    whole = [(0, 0), (7, 1), (7, 3), (0, 3)]
    halves = [[(0, 0), (0, -2), (3, -2), (3, 0.43)], [(3, 0.43), (3, -2), (7, -2), (7, 1)]]
    found = check([whole, *halves], origin=origin)
    assert found.faults == [] and found.corners == 1
    assert found.largest_move == pytest.approx(abs(0.43 - 3 / 7) / np.hypot(1, 1 / 7), rel=1e-3)
    halves = [[(0, 0), (0, -2), (3, -2), (3, 0.40)], [(3, 0.40), (3, -2), (7, -2), (7, 1)]]
    assert "overlap" in check([whole, *halves], origin=origin).faults[0].found or "gap" in str(
        check([whole, *halves])
    )
    # Round numbers are no reason to close what is as wide as their last decimal.
    assert check([[(0, 0), (5, 0), (5, 8), (0, 8)], [(5.01, 0), (10, 0), (10, 8), (5.01, 8)]]).faults


def test_an_edge_that_was_bent_to_a_corner_is_counted():
    left, right = [(0, 0), (5, 0), (5, 8), (0, 8)], [(5, 0), (10, 0), (10, 8), (5, 8), (5.00301, 4)]
    found = check([left, right])
    assert found.faults == [] and found.corners == 1 and found.largest_move == pytest.approx(0.00301)


@pytest.mark.parametrize("gap", [1e-4, 1e-3])
def test_corners_that_just_miss_are_snapped_and_counted(gap):
    # Too narrow at one side: a gap to the right neighbour; and not quite closed.
    narrow = check(changed(0, [(0, 0), (1.5 - gap, 0), (1.5 - gap, 2), (0, 2)]), BOX)
    assert narrow.faults == []
    assert narrow.corners == 2
    assert narrow.largest_move == pytest.approx(gap)
    mended, exact = (mend(rings, shortest=0.0, thinnest=0.0) for rings in (narrow.rings, BLOCKS))
    assert np.array_equal(mended.corner, exact.corner)
    assert np.allclose(mended.points, exact.points, atol=1.01 * gap)
    open_ring = check(changed(0, [(0, 0), (1.5, 0), (1.5, 2), (0, 2), (gap, 0)]), BOX)
    assert open_ring.faults == []
    assert open_ring.corners == 1
    # A corner of two that hangs beside the edge of a third, off it.
    rings = [
        [(0, 0), (2, 0), (2, 1), (0, 1)],
        [(0, 1), (1, 1 + gap), (1, 2), (0, 2)],
        [(1, 1 + gap), (2, 1), (2, 2), (1, 2)],
    ]
    hanging = check(rings, np.array([(0, 0), (2, 0), (2, 2), (0, 2)], float))
    assert hanging.faults == []


@pytest.mark.parametrize("offset", [0.0, 6.7e6])
@pytest.mark.parametrize(
    ("rings", "words"),
    [
        (changed(0, [(0, 0), (1.5, 2), (1.5, 0), (0, 2)]), ["block 0", "simple", "(0.75, 1)"]),
        (changed(0, [(0, 0), (1.5, 0), (1.5, 2), (1, 2), (1, 2.6), (1, 2), (0, 2)]), ["block 0", "(1, 2"]),
        (changed(0, [(0, 0), (1.6, 0), (1.6, 2), (0, 2)]), ["block 0 and block 1 overlap", "(1.55, 1)"]),
        (changed(0, [(0, 0), (1.4, 0), (1.4, 2), (0, 2)]), ["gap", "(1.45, 1)", "block 0 and block 1"]),
        ([*BLOCKS, BLOCKS[2][::-1]], ["block 2 and block 6 are the same polygon"]),
        ([*BLOCKS[:4], *BLOCKS[5:]], ["gap", "block 1"]),
        (changed(2, [(3.2, 0), (6.0, 0), (6.0, 2), (3.2, 2)]), ["block 2 reaches beyond", "(5.5, 1)"]),
        (changed(2, [(3.2, 0), (3.2, 0), (5.0, 2), (3.2, 0)]), ["block 2", "three corners"]),
        (changed(5, [(9, 9), (10, 9), (10, 10), (9, 10)]), ["block 5", "touch no other"]),
    ],
)
def test_other_faults_are_named_and_placed(rings, words, offset):
    """Places are those of the user's coordinates."""
    text = "; ".join(f"{f.found}: {f.expected}" for f in check(rings, BOX, origin=(offset, 0.0)).faults)
    for word in words:
        if offset and word.startswith("("):
            word = f"({float(word.split(',')[0][1:]) + offset:.10g},"
        assert word in text


def test_without_a_domain_slits_and_inner_voids_are_gaps_and_a_wide_notch_is_the_outline():
    slit = changed(1, [(1.55, 0), (3.2, 0), (3.2, 2), (1.55, 2)])
    assert "gap of 0.1 m2 at (1.525, 1)" in check(slit).faults[0].found
    assert check(BLOCKS[:1] + BLOCKS[2:]).faults == []
    ring = [
        np.array([(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)])
        for x in range(3)
        for y in range(3)
        if (x, y) != (1, 1)
    ]
    assert "(1.5, 1.5)" in check(ring).faults[0].found
    around = np.array([(0.9, 0.9), (2.1, 0.9), (2.1, 2.1), (0.9, 2.1)])
    assert check(ring, openings=[around]).faults == []


def test_mending_says_what_it_moved():
    # A joint from beside one corner to beside the opposite one.
    d = 0.2
    halves = [np.array([(0, 0), (d, 0), (4 - d, 4), (0, 4)]), np.array([(d, 0), (4, 0), (4, 4), (4 - d, 4)])]
    kept = mend(halves, shortest=0.0, thinnest=0.0).mending
    assert (kept.corners, kept.joints, kept.largest_turn) == (0, 0, 0.0)
    moved = mend(halves, shortest=0.5, thinnest=0.0).mending
    assert (moved.corners, moved.joints) == (2, 1)
    assert moved.largest_move == pytest.approx(d)
    assert moved.largest_turn == pytest.approx(np.arctan2(4, 4 - 2 * d) - np.pi / 4)
    strip = [*halves, np.array([(0, 4), (4, 4), (4, 4.01), (0, 4.01)])]
    merged = mend(strip, shortest=0.0, thinnest=0.05).mending
    assert (merged.blocks, merged.area) == (1, pytest.approx(0.04))
