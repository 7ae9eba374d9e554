"""Holes beside slivers and joints: what they take out is what was asked for, told, or refused with place and size."""

import json
import logging

import numpy as np
import pytest

from graben.errors import BadInput
from graben.mechanics.blocks.shape.joint_sets import JointSet, cut_by_sets
from graben.mechanics.blocks.shape.mending import mend
from graben.mechanics.plane.polygons import areas_and_centroids, inside
from graben.schemas.scene import load_scene
from graben.stages.blocks.geometry import lay_out

OUTLINE = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], dtype=float)


def box(x0, y0, x1, y1):
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]


def in_metres(polygon):
    return "[" + ", ".join(f'["{x!r} m", "{y!r} m"]' for x, y in polygon) + "]"


def area_of(tessellation):
    return float(areas_and_centroids(tessellation.points, tessellation.start, tessellation.corner)[0].sum())


@pytest.mark.parametrize("seed", range(12))
def test_no_sliver_crosses_the_edge_of_a_hole(seed):
    """Blocks of sets with much scatter, holes of any size anywhere, every second one about a corner of a block."""
    rng = np.random.default_rng(seed)
    sets = [JointSet(np.radians(60), 1.0, 1.0, 0.1, 0.3), JointSet(np.radians(-30), 1.0, 0.6, 0.1, 0.5)]
    shapes = [shape for shape, _ in cut_by_sets(OUTLINE, sets, seed)]
    middle = shapes[rng.integers(len(shapes))][0] if seed % 2 else rng.uniform(2, 8, 2)
    turn = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    hole = middle + rng.uniform(0.5, 1.5) * np.column_stack([np.cos(turn), np.sin(turn)])
    start = np.cumsum([0, *map(len, shapes)])
    area, centre = areas_and_centroids(np.vstack(shapes), start, np.arange(start[-1]))
    asked = float(area[~inside(centre, hole)].sum())
    # Slivers are merged, and nothing is moved: what is left is exactly what was asked for.
    blocks = mend(shapes, shortest=0.0, thinnest=0.1, holes=[hole])
    assert area_of(blocks) == pytest.approx(asked, rel=1e-9)
    moved = mend(shapes, shortest=0.1, thinnest=0.1, holes=[hole])
    assert abs(area_of(moved) - asked) <= moved.mending.opening + 1e-9
    assert moved.mending.opening < 0.1


def scene(folder, rings, holes, *, tessellation='method = "file"\nfile = "map.geojson"', domain="", edge=1.0):
    features = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for ring in rings
    ]
    (folder / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    path = folder / "scene.toml"
    path.write_text(f"""
kind = "blocks"
[domain]
{domain}
holes = [{", ".join(map(in_metres, holes))}]
[tessellation]
{tessellation}
edge = "{edge} m"
rounding = "0.02 m"
[programme]
supports = [{{start = ["0 m", "0 m"], end = ["3 m", "0 m"]}}]
loads = []
""")
    return load_scene(path, "blocks")


def ring_of_blocks(size):
    """Eight blocks around a void of that size in the middle of a square of 3 m."""
    a, b = 1.5 - 0.5 * size, 1.5 + 0.5 * size
    cuts = ((0, a), (a, b), (b, 3))
    return [box(x0, y0, x1, y1) for x0, x1 in cuts for y0, y1 in cuts if (x0, y0) != (a, a)]


def test_a_void_that_mending_would_close_is_refused_with_place_and_size(tmp_path):
    """A void of 8 cm, where edges below 10 cm are collapsed: its four corners would become one."""
    void = [(1.4, 1.4), (1.6, 1.4), (1.6, 1.6), (1.4, 1.6)]
    with pytest.raises(BadInput) as refused:
        lay_out(scene(tmp_path, ring_of_blocks(0.08), [void]))
    text = str(refused.value)
    assert "0.0064 m2" in text and "(1.5, 1.5)" in text and "shortest_edge" in text
    wide = lay_out(scene(tmp_path, ring_of_blocks(0.4), [[(1.2, 1.2), (1.8, 1.2), (1.8, 1.8), (1.2, 1.8)]]))
    assert area_of(wide.blocks) == pytest.approx(9.0 - 0.16)
    assert wide.mended["largest_opening_change_m2"] == 0.0


def test_a_sliver_beside_a_hole_joins_a_block_that_stays(tmp_path):
    """A strip of 5 cm between a hole and a block; its longest common edge is that with the hole."""
    rings = [box(0, 0, 1, 2), box(1, 0, 1.05, 2), box(1.05, 0, 2, 1), box(1.05, 1, 2, 2)]
    hole = [(0, 0), (1.01, 0), (1.01, 2), (0, 2)]
    ground = lay_out(scene(tmp_path, rings, [hole]))
    # Edges of 5 cm are collapsed, which moves the edge of the hole; how much is told.
    missed = abs(area_of(ground.blocks) - 2.0)
    assert ground.blocks.size == 2 and missed <= 0.03 and missed <= ground.mended["largest_opening_change_m2"] + 1e-9
    assert ground.mended["left_out_blocks"] == 1 and ground.mended["left_out_area_m2"] == pytest.approx(2.0)
    assert ground.mended["holes_area_m2"] == pytest.approx(2.02)


def test_a_sliver_that_no_neighbour_takes_is_told(tmp_path, caplog):
    """Between two holes: it stays."""
    rings = [box(0, 0, 1, 2), box(1, 0, 1.05, 2), box(1.05, 0, 2, 2), box(2, 0, 3, 2)]
    holes = [[(0, 0), (1.01, 0), (1.01, 2), (0, 2)], [(1.04, 0), (2, 0), (2, 2), (1.04, 2)]]
    with caplog.at_level(logging.WARNING):
        ground = lay_out(scene(tmp_path, rings, holes))
    assert ground.blocks.size == 2 and ground.mended["left_slivers"] == 1
    assert "1 slivers stay" in caplog.text


JOINTS = 'method = "joint-sets"\nsets = [{dip = "0 deg", spacing = "1 m"}, {dip = "90 deg", spacing = "1 m"}]'
BOX = 'width = "3 m"\nheight = "3 m"'


@pytest.mark.parametrize("tessellation", ["", JOINTS, 'method = "file"\nfile = "map.geojson"'], ids=str)
def test_a_hole_that_takes_out_nothing_is_refused_with_the_block_beside_it(tmp_path, tessellation):
    """Smaller than a block, and beside its middle."""
    rings = [box(x, y, x + 1.5, y + 1.5) for x in (0.0, 1.5) for y in (0.0, 1.5)]
    with pytest.raises(BadInput) as refused:
        lay_out(
            scene(
                tmp_path, rings, [[(-0.01, -0.01), (0.02, -0.01), (0.0, 0.02)]], tessellation=tessellation, domain=BOX
            )
        )
    (fault,) = refused.value.faults
    assert fault.key == "domain.holes[0]" and "middle of a block" in fault.expected and "m2" in fault.expected


def test_a_hole_that_takes_out_much_more_than_its_area_is_told(tmp_path, caplog):
    rings = [box(x, y, x + 1.5, y + 1.5) for x in (0.0, 1.5) for y in (0.0, 1.5)]
    with caplog.at_level(logging.WARNING):
        ground = lay_out(scene(tmp_path, rings, [[(0.5, 0.5), (1, 0.5), (1, 1), (0.5, 1)]]))
    assert "has 0.25 m2, and 1 blocks of 2.25 m2" in caplog.text
    assert ground.mended["left_out_area_m2"] == pytest.approx(2.25)
