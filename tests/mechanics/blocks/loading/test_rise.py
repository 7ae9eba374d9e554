"""Loads that rise to failure and fall with it: closed forms of bodies that topple, slide and fall."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.excavation import Dig
from graben.mechanics.blocks.loading.falling import Falling
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces
from graben.mechanics.blocks.loading.programme import Control, Programme
from graben.mechanics.blocks.loading.resistance import Resistance
from graben.mechanics.blocks.loading.rest import imbalance
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons

G, RHO = 9.81, 2500.0


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def standing(shapes, outline, *, friction, end, steps, rounding=0.01, gravity=(0.0, -G), rigid=False):
    bodies = build_bodies(from_polygons(shapes, outline))
    joint = Joint(1e10, 5e9, np.tan(np.radians(friction)), 0.0, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies, young=20e9, poisson=0.2, density=RHO, joint=joint, rounding=rounding, dt=end / steps,
        gravity=gravity, rigid=rigid,
    )  # fmt: skip
    low = outline[:, 1].min()
    base = on_segment(bodies, np.array([outline[:, 0].min(), low]), np.array([outline[:, 0].max(), low]))
    for axis in (0, 1):
        model.hold(base, axis)
    return model


def tried(model, segment, course, end, control=None):
    loads = Loads(len(model.bodies.position))
    loads.add(pressure_forces(model.bodies, *segment), course)
    test = Programme(model, loads, control or Control(), end=end, save_every=end, tolerance=1e-3)
    for _ in test.begin():
        pass
    for _ in test.run():
        pass
    return test


def failed(model, segment, course, end, control=None):
    test = tried(model, segment, course, end, control)
    assert test.rise.failed
    return test.failure(), test.look_table()


@pytest.mark.parametrize(("width", "frame"), [(1.0, 10.0), (0.8, 10.0), (1.0, 5.0)])
def test_a_block_that_is_pushed_topples_about_its_corner(width, frame):
    high, rounding, end = 2.0, 0.01, 50.0
    shapes = [rectangle(0, -0.5, width, 0), rectangle(0, 0, width, high)]
    model = standing(shapes, rectangle(0, -0.5, width, high), friction=40.0, end=end, steps=12_500)
    exact = RHO * G * width * (width - 2 * rounding) / high
    course = Course([(0.0, 0.0)], 2.0 * exact / end)
    failure, looks = failed(model, ((0, 0), (0, high)), course, end, Control(frame=frame))
    assert course.at(failure.load) == pytest.approx(exact, rel=0.01)
    assert course.at(failure.low) < 1.005 * exact and exact < 1.005 * course.at(failure.high)
    assert looks[:, 0].max() < 1.02 * failure.load
    # The load fell with the block, and the block did not run away.
    assert looks[-1, 3] < 2.2 * looks[failure.look, 3]


@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_that_is_pushed_slides_at_its_friction(rigid):
    end = 40.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=end, steps=10_000, rigid=rigid)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    course = Course([(0.0, 0.0)], 2.0 * exact / end)
    failure, _ = failed(model, ((0, 0), (0, 1)), course, end)
    assert course.at(failure.load) == pytest.approx(exact, rel=0.01)


def test_a_dead_load_ends_where_the_body_runs_away():
    end = 40.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=end, steps=10_000)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    course = Course([(0.0, 0.0)], 2.0 * exact / end)
    failure, looks = failed(model, ((0, 0), (0, 1)), course, end, Control(frame=0.0))
    assert course.at(failure.load) == pytest.approx(exact, rel=0.02)
    assert course.at(failure.low) < 1.005 * exact and exact < 1.005 * course.at(failure.high)
    assert (np.diff(looks[:, 0]) > 0.0).all()


def test_a_support_pressure_that_is_lowered_lets_the_block_go():
    # A block on a slippery slope of 45 deg, held back by a pressure on its lower side.
    end = 40.0
    base = np.array([(0, 0), (3, 0), (3, 3)], dtype=float)
    block = np.array([(1, 1), (2, 2), (1.5, 2.5), (0.5, 1.5)], dtype=float)
    outline = np.array([(0, 0), (3, 0), (3, 3), (2, 2), (1.5, 2.5), (0.5, 1.5), (1, 1)], dtype=float)
    model = standing([base, block], outline, friction=20.0, end=end, steps=12_500, rounding=0.005)
    slope, length = np.radians(45.0), 0.5 * np.sqrt(2.0)
    weight = RHO * G * np.sqrt(2.0) * length
    exact = weight * (np.sin(slope) - np.cos(slope) * np.tan(np.radians(20.0))) / length
    course = Course([(0.0, 1.5 * exact), (end, 0.0)])
    failure, _ = failed(model, ((0.5, 1.5), (1, 1)), course, end)
    assert course.at(failure.load) == pytest.approx(exact, rel=0.01)


@pytest.mark.parametrize("steps", [2500, 10_000])
def test_a_block_that_slides_off_under_a_small_load_is_not_hidden_by_a_large_one(steps):
    """The large load bears on a block that stands for ever; power of both loads together hardly shows the other."""
    end = 40.0
    shapes = [rectangle(0, -0.5, 6, 0), rectangle(0, 0, 1, 1), rectangle(2, 0, 6, 1)]
    model = standing(shapes, rectangle(0, -0.5, 6, 1), friction=20.0, end=end, steps=steps)
    exact = RHO * G * np.tan(np.radians(20.0))
    loads = Loads(len(model.bodies.position))
    loads.add(pressure_forces(model.bodies, (0, 0), (0, 1)), Course([(0.0, 0.0)], 2.0 * exact / end))
    loads.add(pressure_forces(model.bodies, (2, 1), (6, 1)), Course([(0.0, 0.0)], 100.0 * exact / end))
    test = Programme(model, loads, Control(), end=end, save_every=end, tolerance=1e-3)
    for _ in (*test.begin(), *test.run()):
        pass
    failure = test.failure()
    assert test.failed
    assert failure.low < 0.5 * end < failure.high
    if test.rise.fell:
        # Seen by the block's own balance.
        assert failure.load == pytest.approx(0.5 * end, rel=0.01)


def test_what_is_borne_until_a_block_falls_counts_until_it_lost_its_balance():
    end = 40.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=end, steps=10_000)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    test = tried(model, ((0, 0), (0, 1)), Course([(0.0, 0.0)], 2.0 * exact / end), end)
    whole, table = test.failure(), test.look_table()
    half = np.searchsorted(table[:, 0], 0.5 * whole.load)
    test.falling.fallen[1] = int(table[half, 5])
    test.rise.fell = True
    until = test.failure()
    assert until.look <= half and until.load == pytest.approx(0.5 * whole.load, rel=0.01)
    assert until.high < 0.52 * whole.load
    test.may_fall = True
    assert test.failure().load == pytest.approx(whole.load, rel=0.01)


@pytest.mark.parametrize(("share", "falls"), [(0.97, False), (1.2, True)])
def test_a_whole_load_is_held_until_the_body_rests_or_fails(share, falls):
    """A load that jumps above the strength at its end leaves no time for the body to fail while it rises."""
    end = 40.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=end, steps=5000)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    course = Course([(0.0, 0.0), (0.99 * end, 0.9 * exact), (end, share * exact)])
    test = tried(model, ((0, 0), (0, 1)), course, end)
    assert test.failed == falls and test.at_rest == (not falls)
    if falls:
        failure = test.failure()
        assert course.at(failure.low) < exact < course.at(failure.high)
    else:
        assert test.failure() is None and test.rise.load_time == pytest.approx(end)
        assert imbalance(model) < 1e-3


def test_no_load_rises_before_the_body_is_at_rest():
    end = 40.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=end, steps=5000)
    loads = Loads(len(model.bodies.position))
    loads.add(pressure_forces(model.bodies, (0, 1), (2, 1)), Course([(0.0, 1e3)], 1e5))
    test = Programme(model, loads, Control(), end=end, save_every=end, tolerance=1e-3)
    for _ in test.begin():
        pass
    assert model.load_factor == 0.0
    weight = RHO * G * 3.0
    assert model.boundary_force()[model.held.any(axis=1), 1].sum() == pytest.approx(weight + 2e3, rel=1e-3)


def test_a_block_that_creeps_under_a_steady_load_has_fallen():
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=40.0, steps=10_000)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    test = tried(model, ((0, 0), (0, 1)), Course([(0.0, 1.1 * exact)]), 40.0)
    assert test.failed and test.falling.blocks.tolist() == [1] and test.failure() is None
    assert model.steps_done < 50_000


def test_a_body_that_bears_all_has_not_failed_and_one_that_never_tells_says_how_far_it_came():
    end = 10.0
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    outline = rectangle(0, -0.5, 2, 1)
    exact = RHO * G * 2.0 * np.tan(np.radians(20.0))
    model = standing(shapes, outline, friction=20.0, end=end, steps=4000)
    test = tried(model, ((0, 0), (0, 1)), Course([(0.0, 0.0)], 0.5 * exact / end), end)
    assert not test.rise.failed and test.failure() is None and test.reached == pytest.approx(1.0, rel=1e-6)
    model = standing(shapes, outline, friction=20.0, end=end, steps=4000)
    hasty = Control(beyond=1e6, patience=1.5)
    test = tried(model, ((0, 0), (0, 1)), Course([(0.0, 0.0)], 2.0 * exact / end), end, hasty)
    assert not test.rise.failed and 0.4 < test.reached < 0.6


@pytest.mark.parametrize("hold", [True, False])
def test_a_block_whose_stop_is_dug_out_slides_though_a_load_would_come_to_press_it_down(hold):
    """A plane of 35 deg, friction of 20 deg: at the dig the pressure on the block is 1.1 or 0.9 of what holds it."""
    end, slope = 40.0, np.radians(35.0)
    shapes = [rectangle(0, -0.5, 4, 0), rectangle(1, 0, 2, 1), rectangle(2, 0, 4, 1)]
    gravity = (-G * np.sin(slope), -G * np.cos(slope))
    model = standing(shapes, rectangle(0, -0.5, 4, 1), friction=20.0, end=end, steps=5000, gravity=gravity)
    for axis in (0, 1):
        model.hold(on_segment(model.bodies, np.array([1.0, 0.0]), np.array([1.0, 1.0])), axis)
    # The pressure that holds the block at rest, without the stop.
    holds = RHO * G * (np.sin(slope) / np.tan(np.radians(20.0)) - np.cos(slope))
    loads = Loads(len(model.bodies.position))
    at_dig = 1.1 * holds if hold else 0.9 * holds
    course = Course([(0.0, 0.0), (0.5 * end, at_dig), (end, 2.0 * holds)])
    loads.add(pressure_forces(model.bodies, (2, 1), (4, 1)), course)
    dig = Dig(np.array([(1, 0), (2, 0), (2, 1), (1, 1)], dtype=float), 0.5 * end)
    test = Programme(model, loads, Control(), end=end, save_every=end, tolerance=1e-3, digs=[dig])
    for _ in (*test.begin(), *test.run()):
        pass
    assert test.failed is not hold and test.at_rest is (True if hold else None)
    if not hold:
        assert test.falling.blocks.tolist() == [2]
        assert test.failure().load == pytest.approx(0.5 * end, rel=0.001)


def falls(model, steps, chunk=100, falling=None):
    """Whether blocks fall within so many steps; and who watched."""
    resistance, falling = Resistance(model), falling or Falling(model)
    for _ in range(0, steps, chunk):
        model.advance(chunk)
        resistance.look(model)
        if falling.look(model, resistance.force):
            return True, falling
    return False, falling


def test_blocks_that_lose_their_support_have_fallen():
    shapes = [rectangle(0, 0, 1, 1), rectangle(1.5, 3, 2.5, 4)]
    model = standing(shapes, rectangle(0, 0, 2.5, 4), friction=30.0, end=10.0, steps=1000)
    fell, falling = falls(model, 50_000)
    assert fell and falling.blocks.tolist() == [1] and falling.first().out <= 100
    assert falling.first().balanced == -1
    dropped = model.motion.x[model.bodies.vertex_block == 1, 1].min()
    assert dropped == pytest.approx(2.9, abs=0.05)
    again = Falling(model)
    again.bring_back(falling.state())
    assert again.blocks.tolist() == [1] and not falls(model, 100, falling=again)[0]
    weightless = standing(shapes, rectangle(0, 0, 2.5, 4), friction=30.0, end=10.0, steps=1000, gravity=(0.0, 0.0))
    assert not falls(weightless, 500)[0]


def test_balance_is_kept_only_by_looks_in_a_row():
    """A swing passes through balance at each turn: it is none."""
    shapes = [rectangle(0, -0.5, 2, 0), rectangle(0, 0, 2, 1)]
    model = standing(shapes, rectangle(0, -0.5, 2, 1), friction=20.0, end=40.0, steps=10_000)
    falling, push = Falling(model), np.zeros_like(model.motion.x)
    top = model.bodies.vertex_block == 1
    model.advance(10)
    seen = []
    for k in range(40):
        # In balance at every third look.
        push[top, 0] = 0.0 if k % 3 == 0 else 1e3
        falling.look(model, push)
        seen.append(falling.state()["fallen_balanced"][1])
    assert max(seen) == -1
    for _ in range(20):
        falling.look(model, np.zeros_like(push))
    assert falling.state()["fallen_balanced"][1] == model.steps_done
