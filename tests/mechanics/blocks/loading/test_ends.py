"""What grips a compression: which supports contradict it, and what platens hold and press."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.ends import Platens, Walls
from graben.mechanics.blocks.loading.loads import on_segment
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.platens import PlatenShape, with_platens
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

SQUARE = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
JOINT = Joint(1e10, 1e9, 0.6, 1e5, 0.0, 0.0, np.inf)


def model_of(bodies):
    return BlockModel(bodies, young=65e9, poisson=0.2, density=2700.0, joint=JOINT, rounding=0.05, dt=1e-2)


def held(bodies, *supports):
    """Flags of supports (start, end, axes)."""
    flags = np.zeros((len(bodies.position), 2), dtype=bool)
    for start, end, axes in supports:
        at = on_segment(bodies, np.array(start), np.array(end))
        for axis in axes:
            flags[at, axis] = True
    return flags


BOTTOM = ((0, 0), (2, 0), (1,))


@pytest.mark.parametrize(
    ("supports", "words"),
    [
        ([BOTTOM, ((0, 0), (0, 2), (0,))], "left or right side"),
        ([BOTTOM, ((2, 1), (2, 2), (1,))], "reaches the top"),
        ([BOTTOM, ((0, 2), (2, 2), (0, 1))], "reaches the top"),
        ([((0, 0), (2, 0), (0,))], "the bottom along y"),
        ([((0, 0.5), (0, 1.5), (1,))], "the bottom along y"),
    ],
)
def test_supports_that_contradict_the_compression_are_refused(supports, words):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.5, seed=2))
    with pytest.raises(Refused, match=words):
        Walls(bodies, held(bodies, *supports))


def test_supports_hold_what_they_say_and_nothing_else():
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.5, seed=2))
    supports = [((0, 0), (1, 0), (1,)), ((0, 2), (2, 2), (0,)), ((2, 0), (2, 1), (1,))]
    flags = held(bodies, *supports)
    model = model_of(bodies)
    ends = Walls(bodies, flags)
    ends.grip(model, -1e6, -5e5)
    assert np.array_equal(model.held, flags)
    ends.take_over(model, -1e-3)
    assert np.array_equal(model.held[:, 1], flags[:, 1] | bodies.vertex_side[:, 2])
    assert np.array_equal(model.held[:, 0], flags[:, 0])


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("sides", [False, True])
def test_platens_are_held_and_press_as_much_as_the_rock_gets(elastic, sides):
    shape = PlatenShape(0.4, 0.6, sides=sides, divided=elastic)
    bodies = build_bodies(with_platens(voronoi_blocks(SQUARE, 0.5, seed=2), shape))
    model, ends = model_of(bodies), Platens(bodies, elastic=elastic)
    ends.grip(model, -1e6, -5e5)
    of_rock = bodies.vertex_block < bodies.rock
    assert not model.held[of_rock].any()
    outer = np.isclose(np.abs(bodies.position[:, 1] - 1.0), 1.4)
    above_or_below = ~of_rock & (bodies.vertex_block < bodies.rock + 2)
    assert np.array_equal(ends.bottom | ends.top, above_or_below & outer if elastic else above_or_below)
    # Forces of 1 MPa x 2 m from either side and of 0.5 MPa x 2 m from above, platens or not.
    block = bodies.vertex_block
    push = np.column_stack([np.bincount(block, f, len(bodies.block_area)) for f in model.skeleton.steady.T])
    assert push[bodies.rock + 1] == pytest.approx([0.0, -1e6])
    pushed = push[bodies.rock + 2 :, 0] if sides else push[: bodies.rock, 0]
    assert (pushed[pushed > 0].sum(), pushed[pushed < 0].sum()) == pytest.approx((2e6, -2e6))
    ends.take_over(model, -1e-3)
    assert not model.skeleton.steady[ends.top, 1].any()
    assert (model.skeleton.wall[ends.top, 1] == -1e-3).all()


def test_platens_never_touch_each_other():
    shape = PlatenShape(0.4, 0.6, sides=True)
    model = model_of(build_bodies(with_platens(voronoi_blocks(SQUARE, 0.5, seed=2), shape)))
    block = model.skin.block
    first, second = block[model.pairs.first], block[model.pairs.second]
    rock = model.bodies.rock
    assert not ((first >= rock) & (second >= rock)).any()
    assert all(((first == rock + k) | (second == rock + k)).any() for k in range(4))
