"""Voronoi blocks: they fill the outline, fit together, and look like the reference generator's."""

import numpy as np
import pytest

from graben.mechanics.blocks.shape.tessellation import voronoi_blocks
from graben.mechanics.plane import polygons

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
SLOPE = np.array([(0, 0), (80, 0), (80, 50), (40, 50), (30, 20), (0, 20)], dtype=float)


@pytest.mark.parametrize(("outline", "edge"), [(SQUARE, 0.5), (SLOPE, 2.0), (SLOPE[::-1], 3.0)])
def test_blocks_fill_the_outline_and_share_edges(outline, edge):
    t = voronoi_blocks(outline, edge, seed=3)
    area, _ = polygons.areas_and_centroids(t.points, t.start, t.corner)
    assert area.min() > 0.0
    # Collapsing may move a point of an inner edge, never the outline.
    assert area.sum() == pytest.approx(abs(polygons.signed_area(outline)), rel=1e-12)
    following = np.arange(1, len(t.corner) + 1)
    following[t.start[1:] - 1] = t.start[:-1]
    a, b = t.corner, t.corner[following]
    forward = set(zip(a.tolist(), b.tolist()))
    assert len(forward) == len(a), "an edge runs twice in the same direction: blocks overlap"
    alone = np.array([(q, p) not in forward for p, q in zip(a.tolist(), b.tolist())])
    middle = 0.5 * (t.points[a] + t.points[b])[alone]
    assert polygons.distance_to_sides(middle, t.outline).min(axis=1).max() < 1e-9
    length = np.linalg.norm(t.points[a] - t.points[b], axis=1)[alone].sum()
    assert length == pytest.approx(np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum())


def test_without_collapse_each_point_belongs_to_its_nearest_seed():
    t = voronoi_blocks(SQUARE, 1.0, seed=1, lloyd_passes=0, shortest_edge=0.0)
    rng = np.random.Generator(np.random.PCG64(1))
    seeds = 10.0 * rng.random((t.size, 2))
    for p in 10.0 * np.random.default_rng(5).random((200, 2)):
        owner = [polygons.inside(p[None], t.points[t.corner[t.start[b] : t.start[b + 1]]])[0] for b in range(t.size)]
        assert np.argmin(np.hypot(*(seeds - p).T)) == int(np.argmax(owner))


def test_statistics_match_the_reference_generator():
    # UDEC: 3, 4, 5, 6 corners in shares 12, 51, 35, 3 %, 419 blocks, median inner area 0.245 m2.
    all_of = [voronoi_blocks(SQUARE, 0.5, seed).statistics() for seed in range(4)]
    mean = {k: np.mean([s[k] for s in all_of]) for k in all_of[0]}
    assert mean["blocks"] == pytest.approx(419, abs=3)
    assert mean["corners_mean"] == pytest.approx(4.35, abs=0.1)
    assert mean["share_4_corners"] == pytest.approx(0.51, abs=0.05)
    assert mean["share_5_corners"] == pytest.approx(0.35, abs=0.06)
    assert mean["inner_area_q50_m2"] == pytest.approx(0.245, abs=0.02)
    assert min(s["edge_min_m"] for s in all_of) > 0.15


def test_same_seed_same_blocks():
    a, b, c = (voronoi_blocks(SQUARE, 1.0, seed) for seed in (7, 7, 8))
    assert np.array_equal(a.points, b.points)
    assert np.array_equal(a.corner, b.corner)
    assert a.points.shape != c.points.shape or not np.array_equal(a.points, c.points)


def test_bad_outlines_are_refused():
    bow_tie = np.array([(0, 0), (1, 1), (1, 0), (0, 1)], dtype=float)
    with pytest.raises(ValueError, match="cross"):
        voronoi_blocks(bow_tie, 0.1, 0)
    with pytest.raises(ValueError, match="too small"):
        voronoi_blocks(SQUARE * 0.01, 0.5, 0)
    with pytest.raises(ValueError, match="shape"):
        voronoi_blocks(np.zeros((3, 3)), 0.5, 0)
