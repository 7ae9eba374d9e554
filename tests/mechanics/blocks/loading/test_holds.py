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


def body(shapes, outline, friction, dt, cohesion=0.0, residual=-1.0, **options):
    bodies = build_bodies(from_polygons(shapes, outline))
    joint = Joint(1e10, 5e9, np.tan(np.radians(friction)), cohesion, 0.0, 0.0, np.inf, residual_friction=residual)
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


def test_a_peak_of_a_course_is_held():
    """A peak above the strength between two tries, 10 % of the rise apart, is not stepped over."""
    model = body([rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)], rectangle(0, -0.5, 2, 1), 20.0, 4e-3)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    course = Course([(0.0, 0.0), (4.2, 0.5 * exact), (4.5, 1.5 * exact), (4.8, 0.5 * exact), (10.0, 0.5 * exact)])
    loads = Loads(len(model.bodies.position))
    loads.add(pressure_forces(model.bodies, (0, 0), (0, 1)), course)
    test = Holds(model, loads, Control(), end=10.0, save_every=1.0, tolerance=1e-3, steps=2500, width=0.02)
    for _ in (*test.begin(), *test.run()):
        pass
    found = test.failure()
    assert test.failed and course.at(found.low) <= exact <= course.at(found.high)
    assert 4.2 < found.low < found.high <= 4.5


@pytest.mark.parametrize("slope", [1.0, 3.0])
def test_what_slides_down_a_flat_plane_is_no_rest(slope):
    """What drives the block is small beside the forces on it; a bracket holds the closed form all the same.

    What counts as rest, 1e-5 of all forces on it, is 2e-5 / tan(slope) of what drives it: 0.11 % at 1 deg.
    """
    friction = 3.0 * slope
    exact = np.tan(np.radians(friction)) / np.tan(np.radians(slope))
    test, _ = weakened(on_incline(slope, friction), width=0.02)
    found = test.failure()
    missed = 2e-5 / np.tan(np.radians(slope))
    assert found.low * (1.0 - missed) < exact < found.high


def test_joints_keep_their_first_strength_until_the_first_state():
    """No force has broken a joint of a body that is put under its weight, though it has no cohesion.

    Later the end up the slope breaks first, which bears less; the body falls when what is left there and the whole
    strength of the other end do not hold it. Both ends are those of the flat between the rounded corners.
    """
    slope, peak, residual, rounding = np.radians(15.0), np.radians(20.0), np.radians(10.0), 0.005
    upper = 0.5 - 0.5 * np.tan(slope) / (1.0 - 2.0 * rounding)
    exact = ((1.0 - upper) * np.tan(peak) + upper * np.tan(residual)) / np.tan(slope)
    test, _ = weakened(on_incline(15.0, 20.0, residual=np.tan(residual)), width=0.02)
    assert exact > 1.0 and test.failure().load == pytest.approx(exact, rel=0.015)
