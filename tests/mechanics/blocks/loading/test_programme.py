"""Supports, pressures on parts of an outline, and holes: forces as statics wants them."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.loads import on_segment, pressure_forces
from graben.mechanics.blocks.loading.rest import imbalance, settle
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks, without

SLOPE = np.array([(0, 0), (8, 0), (8, 5), (4, 5), (3, 2), (0, 2)], dtype=float)
GRANITE = Joint(10e9, 1e9, float(np.tan(np.radians(32.0))), 1e5, 0.0, float(np.tan(np.radians(5.0))), np.inf)


def slope_model(dt=5e-3):
    bodies = build_bodies(voronoi_blocks(SLOPE, 0.7, seed=4))
    model = BlockModel(
        bodies, young=65e9, poisson=0.2, density=2700.0, joint=GRANITE, rounding=0.07, dt=dt, gravity=(0.0, -9.81)
    )
    for start, end, axis in (((0, 0), (0, 2), 0), ((8, 0), (8, 5), 0), ((0, 0), (8, 0), 1)):
        model.hold(on_segment(bodies, np.array(start, float), np.array(end, float)), axis)
    return model


@pytest.mark.parametrize(
    ("start", "end"), [((5.1, 5.0), (6.33, 5.0)), ((6.33, 5.0), (5.1, 5.0)), ((3.2, 2.6), (3.7, 4.1))]
)
def test_a_pressure_gives_its_force_and_moment_wherever_it_ends(start, end):
    bodies = build_bodies(voronoi_blocks(SLOPE, 0.7, seed=4))
    force = pressure_forces(bodies, start, end)
    a, b = np.array(start), np.array(end)
    # Counter-clockwise this outline runs to the left or down here; a pressure pushes to the left of that.
    d = min(b - a, a - b, key=lambda v: v[0])
    resultant = np.array([-d[1], d[0]])
    assert force.sum(axis=0) == pytest.approx(resultant, abs=1e-12)
    x = bodies.position
    moment = (x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum()
    middle = 0.5 * (a + b)
    assert moment == pytest.approx(middle[0] * resultant[1] - middle[1] * resultant[0], rel=1e-12)


def test_segments_off_the_outline_are_refused():
    bodies = build_bodies(voronoi_blocks(SLOPE, 0.7, seed=4))
    with pytest.raises(ValueError, match="no part"):
        pressure_forces(bodies, (5.0, 4.0), (6.0, 4.0))
    assert not on_segment(bodies, np.array([5.0, 4.0]), np.array([6.0, 4.0])).any()


def test_at_rest_the_base_carries_the_weight():
    model = slope_model()
    *_, ratio = settle(model, 1e-4, imbalance, limit=100_000, where="rest", advice="support it")
    assert ratio == imbalance(model) < 1e-4
    weight = 9.81 * 2700.0 * model.bodies.block_area.sum()
    assert model.boundary_force()[:, 1].sum() == pytest.approx(weight, rel=1e-3)
    # Rollers at the sides: what they push from one side, they push from the other.
    assert abs(model.boundary_force()[:, 0].sum()) < 1e-3 * weight


def test_a_hole_takes_out_the_blocks_in_it():
    blocks = voronoi_blocks(SLOPE, 0.4, seed=4)
    hole = np.array([(5.0, 1.0), (6.5, 1.0), (6.5, 2.5), (5.0, 2.5)])
    left = without(blocks, [hole])
    area = [build_bodies(t).block_area.sum() for t in (blocks, left)]
    assert area[0] - area[1] == pytest.approx(2.25, rel=0.25)
    with pytest.raises(ValueError, match="no block"):
        without(blocks, [SLOPE])


def test_a_model_brought_back_goes_on_bitwise():
    model = slope_model()
    model.advance(700)
    state = snapshot.take(model)
    model.advance(900)
    again = slope_model()
    snapshot.bring_back(again, state)
    again.advance(900)
    for name, value in snapshot.take(model).items():
        assert np.array_equal(value, snapshot.take(again)[name]), name


def test_a_state_of_another_model_is_refused():
    state = snapshot.take(slope_model())
    bodies = build_bodies(voronoi_blocks(SLOPE, 0.6, seed=4))
    other = BlockModel(bodies, young=65e9, poisson=0.2, density=2700.0, joint=GRANITE, rounding=0.05, dt=1e-3)
    with pytest.raises(ValueError, match="another model"):
        snapshot.bring_back(other, state)
