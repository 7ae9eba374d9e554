"""One definition of failure for a rising load, a bracket and a loss of strength: a key block that drops and rests.

A block of 1 m is glued between two pillars above a gap. It goes when load and weight pass what the glue bears,
2 c (h - 2 r) with the rounding r of its corners. Below it lies a floor, on which it rests again.
"""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.courses import Clock, Course
from graben.mechanics.blocks.loading.holds import Holds
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces
from graben.mechanics.blocks.loading.programme import Programme
from graben.mechanics.blocks.loading.rise import Control
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons

G, RHO, GLUE, ROUNDING, END, STEPS = 9.81, 2500.0, 20e3, 0.01, 10.0, 12_500
WEIGHT = RHO * G
BORNE = 2.0 * GLUE * (1.0 - 2.0 * ROUNDING)
MAYBE = pytest.mark.parametrize("may_fall", [False, True])


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def model_of(shapes, outline, walls, glue=GLUE):
    """Blocks with glued joints; nothing moves along x at the walls, nor at all on the lowest side."""
    bodies = build_bodies(from_polygons(shapes, outline))
    joint = Joint(1e10, 5e9, 0.0, glue, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies,
        young=20e9,
        poisson=0.2,
        density=RHO,
        joint=joint,
        rounding=ROUNDING,
        dt=END / STEPS,
        gravity=(0.0, -G),
    )
    (x0, y0), (x1, _) = outline[:2]
    base = on_segment(bodies, np.array([x0, y0]), np.array([x1, y0]))
    for axis in (0, 1):
        model.hold(base, axis)
    for x in walls:
        model.hold(bodies.position[:, 0] == x, 0)
    return model


def key(gap):
    shapes = [rectangle(0, 0, 1, 1 + gap), rectangle(1, gap, 2, 1 + gap), rectangle(2, 0, 3, 1 + gap)]
    return model_of([*shapes, rectangle(0, -0.5, 3, 0)], rectangle(0, -0.5, 3, 1 + gap), (0.0, 3.0))


def tried(model, course=None, **options):
    """The test to its end; course : of the pressure on the key block, None: weight alone."""
    loads = Loads(len(model.bodies.position))
    top = float(model.bodies.outline[:, 1].max())
    if course is not None:
        loads.add(pressure_forces(model.bodies, (1, top), (2, top)), course)
    kind = Holds if "width" in options else Programme
    if kind is Holds:
        options |= {"steps": STEPS}
    options = {"end": END, "save_every": END, "tolerance": 1e-3} | options
    test = kind(model, loads, Control(), **options)
    for _ in (*test.begin(), *test.run()):
        pass
    return test


@MAYBE
@pytest.mark.parametrize("gap", [0.05, 0.3])
@pytest.mark.parametrize("options", [{}, {"width": 0.05}], ids=["rise", "bracket"])
def test_a_loaded_block_that_drops_has_failed_though_it_rests_further_down(gap, may_fall, options):
    exact = BORNE - WEIGHT
    course = Course([(0.0, 0.0)], 4.0 * exact / END)
    test = tried(key(gap), course, may_fall=may_fall, **options)
    found = test.failure()
    assert test.failed and test.at_rest is not True
    assert course.at(found.load) == pytest.approx(exact, rel=0.05)
    assert 0.99 * course.at(found.low) < exact < 1.01 * course.at(found.high)


@MAYBE
@pytest.mark.parametrize(("gap", "pressure"), [(0.05, 2e3), (0.3, 2e3), (0.05, 0.0)])
def test_a_loss_of_strength_sees_the_same_failure(gap, pressure, may_fall):
    course = Course([(0.0, pressure)]) if pressure else None
    test = tried(key(gap), course, may_fall=may_fall, weaken=True, width=0.03)
    found = test.failure()
    if pressure == 0.0 and may_fall:
        # The block bears no load, and may fall: what is left stands.
        assert not test.failed and test.at_rest
        return
    assert test.failed and found.load == pytest.approx(BORNE / (WEIGHT + pressure), rel=0.05)


@pytest.mark.parametrize("options", [{}, {"width": 0.05}, {"width": 0.05, "weaken": True}], ids=str)
def test_nothing_that_stands_is_a_failure_though_blocks_may_fall(options):
    """A block that hangs from a beam by glue too weak for it, or weak after a loss: all that could fall has."""
    weak = {True: GLUE, False: 0.5 * WEIGHT}["weaken" in options]
    shapes = [rectangle(0, 1, 2, 1.5), rectangle(0.5, 0, 1.5, 1)]
    outline = np.array([(0.5, 0), (1.5, 0), (1.5, 1), (2, 1), (2, 1.5), (0, 1.5), (0, 1), (0.5, 1)], dtype=float)
    model = model_of(shapes, outline, (), glue=weak)
    bodies = model.bodies
    free = on_segment(bodies, np.array([0.5, 0.0]), np.array([1.5, 0.0]))
    beam = on_segment(bodies, np.array([0.0, 1.5]), np.array([2.0, 1.5]))
    for axis in (0, 1):
        model.release(free, axis)
        model.hold(beam, axis)
    test = tried(model, None, may_fall=True, **options)
    assert test.failed and test.falling.blocks.tolist() == [1]
    assert test.at_rest is not True


def test_a_block_without_load_that_may_fall_does_no_harm():
    """The middle block falls; pillars and floor are not loaded, and stand."""
    test = tried(key(0.3), Course([(0.0, 0.0)]), may_fall=True, weaken=True, width=0.05)
    assert not test.failed and test.at_rest and test.falling.blocks.tolist() == [1]


@pytest.mark.parametrize("options", [{}, {"width": 0.05}], ids=["rise", "bracket"])
def test_a_load_that_jumps_past_the_failure_is_known_in_between(options):
    exact = BORNE - WEIGHT
    jump = Course([(0.0, 0.0), (5.0, 0.0), (5.0, 4.0 * exact), (10.0, 4.0 * exact)])
    clock = Clock([jump], END, 0.1 * END)
    course = clock.stretched(jump)
    test = tried(key(0.05), course, **{**options, "end": clock.end})
    found = test.failure()
    assert test.failed and course.at(found.load) == pytest.approx(exact, rel=0.05)
    assert course.at(found.high) - course.at(found.low) < 0.2 * exact


def test_a_load_that_nothing_bears_closes_the_bracket_at_nothing():
    """A block on a frictionless, unglued joint: any push moves it."""
    bodies = build_bodies(from_polygons([rectangle(0, -1, 1, 0), rectangle(0, 0, 1, 1)], rectangle(0, -1, 1, 1)))
    joint = Joint(1e10, 5e9, 0.0, 0.0, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies,
        young=20e9,
        poisson=0.2,
        density=RHO,
        joint=joint,
        rounding=ROUNDING,
        dt=END / STEPS,
        gravity=(0.0, -G),
    )
    base = on_segment(bodies, np.array([0.0, -1.0]), np.array([1.0, -1.0]))
    for axis in (0, 1):
        model.hold(base, axis)
    loads = Loads(len(bodies.position))
    loads.add(pressure_forces(bodies, (0, 0), (0, 1)), Course([(0.0, 0.0)], 1e4))
    test = Holds(
        model, loads, Control(), end=END, save_every=END, tolerance=1e-3, steps=STEPS, width=0.05
    )  # fmt: skip
    for _ in (*test.begin(), *test.run()):
        pass
    found = test.failure()
    assert test.failed and found.low == 0.0 and found.high <= 1e-4 * END
