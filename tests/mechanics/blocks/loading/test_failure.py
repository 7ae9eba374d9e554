"""The load that is borne at rest: a body of known resistance, pushed at finite speed."""

import numpy as np
import pytest

from graben.mechanics.blocks.loading.failure import failure_of, loss_of_balance, static_load, tenfold_speed


def pushed(resistance, *, mass, drag, speed, steps=4000):
    """Loads, way and what inertia and drag take, of a body of one degree of freedom whose way is prescribed."""
    t = np.linspace(0.0, 1.0, steps)
    way = speed * (t + 0.5 * t**2)
    v, a = speed * (1.0 + t), speed * np.ones_like(t)
    other = mass * a + drag * v
    resisted = np.concatenate([[0.0], np.cumsum(0.5 * (other[1:] + other[:-1]) * np.diff(way))])
    return resistance(way) + other, way, resisted


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_inertia_and_drag_are_taken_off(speed):
    def softening(way):
        return np.where(way < 0.3, way / 0.3, 1.0 - 0.4 * (way - 0.3))

    load, way, resisted = pushed(softening, mass=0.05, drag=0.05, speed=speed)
    found = failure_of(load, way, resisted)
    assert load.max() > 1.0 + 0.1 * speed
    assert found.load == pytest.approx(1.0, rel=0.005)
    assert found.low < 1.0 < found.high
    assert way[found.look] == pytest.approx(0.3, rel=0.05)


def test_without_inertia_the_interval_is_the_load():
    way = np.linspace(0.0, 1.0, 500)
    load = np.minimum(3.0 * way, 1.0)
    found = failure_of(load, way, np.zeros(500))
    assert found.load == found.low == found.high == 1.0 and found.inertia == 0.0


def test_what_friction_hides_lies_in_the_interval():
    # A block on a plane of slope a: what exceeds its strength by x drives it with x (1 - tan(phi) / tan(a)).
    t = np.linspace(0.0, 1.0, 4000)
    load, hidden = 1.3 * t, 0.6
    way = np.where(load < 1.0, 1e-3 * load, 1e-3 + (np.maximum(load - 1.0, 0.0)) ** 3)
    drive = np.maximum(load - 1.0, 0.0) * (1.0 - hidden)
    resisted = np.concatenate([[0.0], np.cumsum(0.5 * (drive[1:] + drive[:-1]) * np.diff(way))])
    found = failure_of(load, way, resisted)
    assert found.load > 1.05 and found.low < 1.0 < found.high


def test_the_load_at_which_balance_is_lost_is_where_the_share_out_of_it_was_nothing():
    load = np.linspace(0.0, 2.0, 2001)
    step = 10.0 * np.arange(2001)
    share = 0.1 * np.maximum(load - 1.0, 0.0)
    balanced, lost = int(step[share < 0.002][-1]), int(step[share > 0.01][0])
    found = loss_of_balance(load, step, balanced, lost, lost, 0.2)
    assert found.load == pytest.approx(1.0, abs=0.002)
    assert found.low < 1.0 < found.high == pytest.approx(1.1, abs=0.002)
    # A block that never was in balance tells an interval only.
    found = loss_of_balance(load[500:], step[500:], -1, lost, lost, 0.2)
    assert (found.low, found.high) == (0.5, pytest.approx(1.1, abs=0.002)) and found.load == found.high
    # One that falls at the first look fell at its load.
    found = loss_of_balance(load[500:], step[500:], -1, int(step[500]), int(step[500]), 0.2)
    assert found.low == found.high == 0.5


def test_a_speed_ten_times_the_first_is_told_with_its_load():
    step = np.arange(0.0, 20_000.0, 20.0)
    load = step / step[-1]
    way = np.cumsum(np.where(load < 0.7, 1.0, 15.0))
    assert tenfold_speed(load, way, step) == pytest.approx(0.7, abs=0.02)
    assert tenfold_speed(load, np.cumsum(np.ones_like(load)), step) is None
    assert tenfold_speed(load[:0], way[:0], step[:0]) is None


def test_swings_that_give_back_what_they_took_leave_no_trace():
    t = np.linspace(0.0, 1.0, 5000)
    way = t + 0.002 * np.sin(200.0 * t)
    load = np.minimum(3.0 * t, 1.0)
    resisted = 0.0004 * np.sin(200.0 * t) ** 2
    assert failure_of(load, way, resisted).load == pytest.approx(1.0, rel=0.01)
    assert (static_load(load, way, resisted) <= load).all()
