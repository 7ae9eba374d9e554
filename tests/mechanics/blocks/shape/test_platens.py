"""Platens beside a rectangle of blocks: where they lie, and that the rock keeps its numbers."""

import numpy as np
import pytest

from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.platens import PlatenShape, with_platens
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

OUTLINE = np.array([(1.0, 2.0), (4.0, 2.0), (4.0, 4.0), (1.0, 4.0)])


@pytest.mark.parametrize("divided", [False, True])
def test_platens_touch_the_rock_and_come_last(divided):
    rock = voronoi_blocks(OUTLINE, 0.5, seed=3)
    both = with_platens(rock, PlatenShape(0.5, 1.0, sides=True, divided=divided))
    bodies, alone = build_bodies(both), build_bodies(rock)
    assert both.size == rock.size + 4
    assert bodies.rock == rock.size
    boxes = [(0.0, 1.5, 5.0, 2.0), (0.0, 4.0, 5.0, 4.5), (0.5, 1.0, 1.0, 5.0), (4.0, 1.0, 4.5, 5.0)]
    for k, box in enumerate(boxes):
        mine = bodies.position[bodies.vertex_block == bodies.rock + k]
        assert (*mine.min(axis=0), *mine.max(axis=0)) == pytest.approx(box)
        assert len(mine) == (4 if not divided else 22 if k < 2 else 18)
    assert bodies.block_area[bodies.rock :] == pytest.approx([2.5, 2.5, 2.0, 2.0])
    # What lies on the sides of the rock belongs to the rock.
    of_rock = bodies.vertex_block < bodies.rock
    assert not bodies.vertex_side[~of_rock].any()
    assert bodies.vertex_side.sum() == alone.vertex_side.sum()
    assert (bodies.edge_side >= 0).sum() == (alone.edge_side >= 0).sum()
    assert bodies.block_area[: bodies.rock] == pytest.approx(alone.block_area)


def test_fine_zones_of_the_rock_leave_platens_as_they_are():
    both = with_platens(voronoi_blocks(OUTLINE, 0.5, seed=3), PlatenShape(0.5, 1.0))
    bodies = build_bodies(both, 0.1)
    assert (bodies.vertex_block >= bodies.rock).sum() == 8
