"""Brackets of loads and of strength: closed forms lie between rest and failure."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.holds import Holds
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces
from graben.mechanics.blocks.loading.rise import Control
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons
from graben.mechanics.blocks.zones.plastic import Strength

G, RHO = 9.81, 2500.0


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def body(shapes, outline, friction, dt, cohesion=0.0, **options):
    bodies = build_bodies(from_polygons(shapes, outline))
    joint = Joint(1e10, 5e9, np.tan(np.radians(friction)), cohesion, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies, young=20e9, poisson=0.2, density=RHO, joint=joint, rounding=0.005, dt=dt, gravity=(0.0, -G), **options
    )
    low = outline[:, 1].min()
    base = on_segment(bodies, np.array([outline[:, 0].min(), low]), np.array([outline[:, 0].max(), low]))
    for axis in (0, 1):
        model.hold(base, axis)
    return model


def on_incline(slope, friction, cohesion=0.0, **options):
    """A block of 1 m by 1 m on a plane of that slope [deg]."""
    t = np.tan(np.radians(slope))
    up = np.array([-np.sin(np.radians(slope)), np.cos(np.radians(slope))])
    base = np.array([(0, 0), (4, 0), (4, 4 * t)], dtype=float)
    a = np.array([1.5, 1.5 * t])
    b = a + np.array([np.cos(np.radians(slope)), np.sin(np.radians(slope))])
    block = np.array([a, b, b + up, a + up])
    outline = np.array([(0, 0), (4, 0), (4, 4 * t), b, b + up, a + up, a], dtype=float)
    return body([base, block], outline, friction, 4e-3, cohesion, **options)


def weakened(model, width=0.03):
    test = Holds(
        model, Loads(len(model.bodies.position)), Control(), end=10.0, save_every=1.0, tolerance=1e-3,
        steps=2500, width=width, weaken=True,
    )  # fmt: skip
    moments = [*test.begin(), *test.run()]
    return test, moments


@pytest.mark.parametrize(
    ("friction", "cohesion", "rigid"), [(30.0, 0.0, False), (10.0, 0.0, False), (15.0, 4e3, False), (30.0, 0.0, True)]
)
def test_the_factor_of_safety_of_a_block_on_a_plane(friction, cohesion, rigid):
    slope = np.radians(20.0)
    weight = RHO * G
    exact = (weight * np.cos(slope) * np.tan(np.radians(friction)) + cohesion) / (weight * np.sin(slope))
    test, moments = weakened(on_incline(20.0, friction, cohesion, rigid=rigid))
    found = test.failure()
    assert test.failed and test.narrow
    assert found.low < exact < found.high and found.load == pytest.approx(exact, rel=0.02)
    assert [moment.fraction for moment in moments] == sorted(moment.fraction for moment in moments)


def test_a_body_that_no_loss_of_strength_brings_down_has_no_factor():
    model = body([rectangle(0, -1, 2, 0), rectangle(0, 0, 2, 1)], rectangle(0, -1, 2, 1), 30.0, 4e-3)
    test, _ = weakened(model)
    assert not test.failed and test.failure() is None and test.at_rest


@pytest.mark.parametrize("most", [0.9, 1.9])
def test_a_load_is_bracketed(most):
    model = body([rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)], rectangle(0, -0.5, 2, 1), 20.0, 4e-3)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    loads, course = Loads(len(model.bodies.position)), Course([(0.0, 0.0)], most * exact / 10.0)
    loads.add(pressure_forces(model.bodies, (0, 0), (0, 1)), course)
    test = Holds(model, loads, Control(), end=10.0, save_every=1.0, tolerance=1e-3, steps=2500, width=0.02)
    for _ in (*test.begin(), *test.run()):
        pass
    if most < 1.0:
        assert not test.failed and test.reached == 1.0 and test.failure() is None
        return
    found = test.failure()
    assert course.at(found.low) < exact < course.at(found.high) < 1.03 * course.at(found.low)
    # The last state is that of the failure from the lower end.
    assert model.block_imbalance().max() > 0.0 and test.load_times[-1] == pytest.approx(found.high)


def test_strength_falls_by_a_factor_and_comes_back():
    strength = Strength(np.radians(30.0), 1e6, 2e5, np.radians(20.0))
    half = strength.weaker(2.0)
    assert np.tan(half.friction) == pytest.approx(np.tan(np.radians(30.0)) / 2.0)
    assert (half.cohesion, half.tension) == (5e5, 1e5) and half.dilation == half.friction
    joint = Joint(1e10, 1e9, 0.6, 1e5, 1e4, 0.5, np.inf, residual_friction=0.4)
    weak = joint.weaker(2.0)
    assert weak[2:6] == (0.3, 5e4, 5e3, 0.3) and weak.residual_friction == 0.2 and weak.residual_cohesion < 0.0
    model = on_incline(20.0, 30.0, strength=strength)
    before = model.joint_table.copy(), model.skeleton.zones.bounds.copy()
    model.weaken(2.0)
    assert model.joint_table[0, 2] == pytest.approx(0.5 * before[0][0, 2])
    assert model.skeleton.zones.bounds[0] == pytest.approx(np.sin(half.friction))
    model.weaken(1.0)
    assert np.array_equal(model.joint_table, before[0]) and np.array_equal(model.skeleton.zones.bounds, before[1])
