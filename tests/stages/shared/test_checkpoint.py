"""The room of checkpoints: when states are taken and written, what they belong to, what an exception leaves."""

import sys
from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput, NumericsFailed, Refused
from graben.mechanics.stored import like, listed, named, part_of, within
from graben.schemas.provenance import Record
from graben.stages.shared import checkpoint
from graben.stages.shared.checkpoint import Checkpoint
from graben.stages.shared.default_scene import default_scene


@pytest.fixture
def clock(monkeypatch):
    """A clock that only tests turn."""
    now = [1000.0]
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: now[0])
    return now


def make(folder, record=None, laws=()):
    return Checkpoint.of(folder / "out.nc", default_scene("scratch", []), record or Record(), laws)


def test_states_are_taken_at_a_bounded_cost_and_written_now_and_then(tmp_path, clock, monkeypatch):
    own, taken = make(tmp_path), []

    def take():
        taken.append(clock[0])
        clock[0] += 0.1
        return {"x": np.array(len(taken))}

    for _ in range(200):
        own.keep(take)
        clock[0] += 1.0
        assert own.path.is_file() == (clock[0] - 1000.0 > checkpoint.EVERY_S + 1.0)
    # Each copy takes 0.1 s, so that one in five seconds is a fiftieth of the time.
    assert 0.8 * 200 / 5.0 < len(taken) < 1.1 * 220 / 5.0
    written = own.path.stat().st_mtime_ns
    own.keep(take)
    own.write()
    assert own.path.stat().st_mtime_ns >= written
    assert int(make(tmp_path).read()["x"]) == len(taken)


@pytest.mark.parametrize(
    ("error", "left"),
    [(KeyboardInterrupt, True), (NumericsFailed, True), (ZeroDivisionError, True), (BadInput, False)],
)
def test_what_stops_a_run_leaves_its_last_state(error, left, tmp_path):
    own = make(tmp_path)
    with pytest.raises(error), own.guarding():
        own.keep(lambda: {"x": np.array(1)})
        raise error("no more") if error is not BadInput else BadInput([])
    assert own.path.is_file() == left


def test_nothing_is_left_of_a_run_that_succeeds_or_never_began(tmp_path):
    own = make(tmp_path)
    with pytest.raises(KeyboardInterrupt), own.guarding():
        raise KeyboardInterrupt
    assert not own.path.exists()
    with pytest.raises(KeyboardInterrupt), own.guarding():
        own.keep(lambda: {"x": np.array(1)})
        raise KeyboardInterrupt
    again = make(tmp_path)
    with pytest.raises(BadInput), again.guarding():
        raise BadInput([])
    assert again.path.exists()
    with again.guarding():
        pass
    assert not again.path.exists()


def test_the_cost_record_counts_what_was_spent_before(tmp_path):
    first, second = Record(), Record()
    first.count(100.0, 50.0)
    own = make(tmp_path, first)
    own.keep(lambda: {"x": np.array(1)}, at_once=True)
    assert make(tmp_path, second).read() == {"x": np.array(1)}
    cost = second.closed_cost()
    assert 100.0 <= cost["wall_s"] < 200.0 and 50.0 <= cost["cpu_s"] < 150.0


def test_the_build_is_that_of_every_source(monkeypatch):
    assert checkpoint.build() == checkpoint.build()
    before = checkpoint.build.__wrapped__()
    real = checkpoint.sha256_of
    monkeypatch.setattr(checkpoint, "sha256_of", lambda p: "edited" if Path(p).name == "march.py" else real(p))
    assert checkpoint.build.__wrapped__() != before


def test_the_source_of_a_law_of_ones_own_counts(tmp_path, monkeypatch):
    source = tmp_path / "own_rock.py"
    source.write_text("law = 1\n")
    module = type(sys)("own_rock")
    module.__file__ = str(source)
    monkeypatch.setitem(sys.modules, "own_rock", module)
    make(tmp_path, laws=["own_rock:law"]).keep(lambda: {"x": np.array(1)}, at_once=True)
    make(tmp_path, laws=["own_rock:law"]).read()
    source.write_text("law = 2\n")
    with pytest.raises(BadInput, match="another inputs"):
        make(tmp_path, laws=["own_rock:law"]).read()


def test_names_go_in_and_out():
    arrays = named("a", {"x": [1.0], "b.y": [2]}) | named("ab", {"x": [3.0]})
    assert set(part_of(arrays, "a")) == {"x", "b.y"} and set(part_of(arrays, "a.b")) == {"y"}


@pytest.mark.parametrize(
    "refused",
    [
        lambda: listed(None, "x"),
        lambda: listed(np.array([1.0, np.inf]), "x"),
        lambda: listed(np.array([1.0]), "x", 2),
        lambda: listed(np.array("text"), "x"),
        lambda: like(np.zeros(2), np.zeros(3), "x"),
        lambda: like(np.zeros(2), np.zeros(2, int), "x"),
        lambda: like(np.zeros((0, 2)), np.zeros((4, 3)), "x", rows=True),
        lambda: like(np.zeros(2), np.array([0.0, np.nan]), "x"),
        lambda: within(np.array([0, 4]), "x", 0, 3),
        lambda: within(np.array([0.0]), "x", 0, 3),
    ],
)
def test_arrays_that_do_not_fit_are_refused(refused):
    with pytest.raises(Refused, match="x"):
        refused()
