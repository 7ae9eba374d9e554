"""The load that is borne at rest: a body of known resistance, pushed at finite speed."""

import numpy as np
import pytest

from graben.mechanics.blocks.loading.failure import failure_of, static_load


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


def test_without_inertia_the_interval_is_as_narrow_as_tests_repeat():
    way = np.linspace(0.0, 1.0, 500)
    load = np.minimum(3.0 * way, 1.0)
    found = failure_of(load, way, np.zeros(500))
    assert found.load == 1.0 and found.high - found.low == pytest.approx(0.01)


def test_swings_that_give_back_what_they_took_leave_no_trace():
    t = np.linspace(0.0, 1.0, 5000)
    way = t + 0.002 * np.sin(200.0 * t)
    load = np.minimum(3.0 * t, 1.0)
    resisted = 0.0004 * np.sin(200.0 * t) ** 2
    assert failure_of(load, way, resisted).load == pytest.approx(1.0, rel=0.01)
    assert (static_load(load, way, resisted) <= load).all()
