"""What every test of a model promises the stage: a run that goes on from any saved moment ends bitwise the same."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.biaxial import Biaxial, Courses
from graben.mechanics.blocks.loading.courses import Course
from graben.mechanics.blocks.loading.ends import Platens
from graben.mechanics.blocks.loading.excavation import Dig
from graben.mechanics.blocks.loading.holds import Holds
from graben.mechanics.blocks.loading.loads import Loads, on_segment, pressure_forces
from graben.mechanics.blocks.loading.pace import ForceCheck
from graben.mechanics.blocks.loading.programme import Control, Programme
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.platens import PlatenShape, with_platens
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

SQUARE = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
GRANITE = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, 0.0, np.inf)
HOLE = np.array([(0.6, 0.6), (1.4, 0.6), (1.4, 1.2), (0.6, 1.2)])


def blocks(gravity=0.0):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.5, seed=2))
    return BlockModel(
        bodies, young=65e9, poisson=0.2, density=2700.0, joint=GRANITE, rounding=0.05, dt=1e-2, gravity=(0, gravity)
    )


def steady():
    return Biaxial(blocks(), pressure=-5e5, vertical=-2.5e5, speed=-3e-4, steps=600, states=4, stop_loose=True)


def paced():
    courses = Courses(Course([(0, 0.0), (60, -3e-4)]), Course([(0, 5e5), (200, 5e5), (500, 8e5)]))
    check = ForceCheck(0.02, 0.3, 2.0)
    return Biaxial(
        blocks(), pressure=-5e5, vertical=-2.5e5, speed=-3e-4, steps=600, states=4, courses=courses, check=check
    )


def between_platens():
    """Blocks between rough platens, also at the sides, of which the top one moves."""
    shape = PlatenShape(0.5, 0.5, sides=True)
    bodies = build_bodies(with_platens(voronoi_blocks(SQUARE, 0.5, seed=2), shape))
    of_platens = bodies.vertex_block[bodies.edge_from] >= bodies.rock
    faces = [Joint(1e10, 1e9, 0.3, 0.0, 0.0, 0.0, np.inf, face=k) for k in (1, 2)]
    model = BlockModel(
        bodies, young=65e9, poisson=0.2, density=2700.0, joint=GRANITE, rounding=0.05, dt=1e-2, more_joints=faces,
        edge_set=of_platens.astype(int), set_between=np.array([[0, 2, 0], [1, 0, 0], [0, 0, 0]]),
    )  # fmt: skip
    return Biaxial(model, pressure=-5e5, vertical=-2.5e5, speed=-3e-4, steps=600, states=4, ends=Platens(bodies))


def pressed(rate):
    """Blocks on a base, and a pressure on their top that rises by so much a second."""
    model = blocks(gravity=-9.81)
    base = on_segment(model.bodies, SQUARE[0], SQUARE[1])
    for axis in (0, 1):
        model.hold(base, axis)
    loads = Loads(len(base))
    loads.add(pressure_forces(model.bodies, SQUARE[2], SQUARE[3]), Course([(0.0, 1e5)], rate))
    return model, loads, Control()


def dug():
    digs = [Dig(HOLE, 2.5, relax_over=3.0)]
    return Programme(*pressed(1e5), end=8.0, save_every=2.0, tolerance=1e-2, digs=digs)


def bracketed():
    return Holds(*pressed(1e6), end=8.0, save_every=2.0, tolerance=1e-2, steps=800, width=0.2)


def kept(test):
    return {**snapshot.take(test.model), **{f"test.{k}": np.array(v) for k, v in test.state().items()}}


def end_of(test):
    """Moments from here to the end, with what a stage would keep where they say so."""
    return [(moment, kept(test) if moment.save else None) for moment in test.run()]


@pytest.mark.parametrize("make", [steady, paced, between_platens, dug, bracketed])
def test_a_test_goes_on_bitwise_from_every_saved_moment(make):
    straight = make()
    for moment in straight.begin():
        assert not moment.save
    moments = end_of(straight)
    saved = [k for k, (moment, _) in enumerate(moments) if moment.save]
    assert len(saved) >= 4
    assert moments[0][0].save
    for k in saved:
        again, state = make(), moments[k][1]
        snapshot.bring_back(again.model, {n: v for n, v in state.items() if not n.startswith("test.")})
        again.bring_back({n[5:]: v for n, v in state.items() if n.startswith("test.")})
        rest = end_of(again)
        assert [moment for moment, _ in rest] == [moment for moment, _ in moments[k + 1 :]]
        own, other = kept(again), moments[-1][1]
        for name, value in other.items():
            assert np.array_equal(value, own[name]), (k, name)


@pytest.mark.parametrize(
    ("make", "name", "value"),
    [(steady, "saved", np.array(9)), (dug, "dug", np.array(2)), (dug, "carried", np.zeros((3, 2)))],
)
def test_a_state_that_cannot_be_is_refused(make, name, value):
    test = make()
    for _ in test.begin():
        pass
    next(test.run())
    with pytest.raises(Refused, match=f"test.{name}"):
        make().bring_back(test.state() | {name: value})
