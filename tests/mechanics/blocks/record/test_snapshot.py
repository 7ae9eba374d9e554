"""What comes back from a file is checked before compiled loops take it on trust."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

SQUARE = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])


def model():
    bodies = build_bodies(voronoi_blocks(SQUARE, 1.0, seed=1))
    joint = Joint(4e10, 1e10, 0.6, 0.0, 0.0, 0.0, 0.0)
    built = BlockModel(bodies, young=65e9, poisson=0.2, density=2700.0, joint=joint, rounding=0.05, dt=1e-4)
    built.hold(bodies.position[:, 1] < 1e-9, 1)
    return built


@pytest.fixture(scope="module")
def saved():
    stepped = model()
    history = History(stepped)
    history.save()
    stepped.advance(20)
    history.save()
    return snapshot.take(stepped), history.stored(2)


def test_a_sound_state_comes_back(saved):
    again = model()
    snapshot.bring_back(again, saved[0])
    history = History(again)
    history.bring_back(saved[1])
    assert history.time == saved[1]["time"].tolist()
    again.advance(1)


def last_plus(name, amount):
    def change(state):
        state[name].flat[-1] += amount

    return change


def cut(*names):
    def change(state):
        for name in names:
            state[name] = state[name][:-1]

    return change


def put(name, value):
    def change(state):
        state[name].flat[0] = value

    return change


def swapped(state):
    state["pairs.key"][:2] = state["pairs.key"][1::-1]


@pytest.mark.parametrize(
    "change",
    [
        put("pairs.first", -1),
        put("pairs.second", 10**9),
        put("pairs.joint", 7),
        put("pairs.flag", 9),
        put("pairs.live", -3),
        put("pairs.slip", np.nan),
        put("motion.x", np.nan),
        lambda state: state.update({"motion.post": np.full((1, 2), 10**9)}),
        put("motion.start", 5),
        put("motion.kind", 77),
        put("skeleton.first", 10**8),
        put("skeleton.still", 10**8),
        put("skeleton.zones.triangles", 10**8),
        last_plus("motion.far_start", 1),
        last_plus("motion.turn", 10**6),
        cut("pairs.first"),
        cut("pairs.key", "pairs.first", "pairs.second"),
        cut("motion.x"),
        cut("motion.wake"),
        cut("motion.ledger"),
        cut("skeleton.zones.gradient"),
        cut("held"),
        lambda state: state.pop("motion.v"),
        lambda state: state.update({"motion.v": state["motion.v"].astype(np.float32)}),
        lambda state: state.update(steps_done=np.array([1, 2])),
        swapped,
    ],
)
def test_a_damaged_state_is_refused(saved, change):
    state = {name: array.copy() for name, array in saved[0].items()}
    change(state)
    with pytest.raises(Refused, match="another model"):
        snapshot.bring_back(model(), state)


@pytest.mark.parametrize(
    "change",
    [
        cut("time"),
        cut("displacement.rows"),
        cut("contact.rows"),
        cut("reference"),
        put("displacement.sizes", -1),
        put("contact_pair.rows", 10**6),
        put("velocity.rows", np.inf),
        put("time", 9.0),
        lambda state: state.pop("energy.rows"),
        lambda state: state.update({"velocity.rows": state["velocity.rows"][:, :-1]}),
        lambda state: state.update(time=np.zeros(0)),
        lambda state: state.update(time=np.array(0.0)),
        lambda state: state.update({"contact_pair.rows": np.array(0)}),
    ],
)
def test_damaged_states_of_the_past_are_refused(saved, change):
    state = {name: array.copy() for name, array in saved[1].items()}
    change(state)
    with pytest.raises(Refused, match="history"):
        History(model()).bring_back(state)
