"""The type of a law's table picks its functions, in the compiled loop as in Python."""

from typing import NamedTuple

import numba
import numpy as np
import pytest

from graben.mechanics.particles import dispatch
from graben.mechanics.particles.contacts import pair_forces
from graben.mechanics.particles.dispatch import LAWS, Functions, LinearTable
from graben.mechanics.particles.records import Bodies, Contacts, Loads


class SquareTable(NamedTuple):
    """A made-up law: force k overlap^2."""

    k: np.ndarray


def square_normal(law, a, b, overlap, opening):
    force = law.k[a, b] * overlap * overlap
    return force, force


SQUARE = Functions(square_normal, None, None, None, None)


def touching(overlap: float) -> tuple[Bodies, Contacts, Loads]:
    x = np.array([[0.0, 0.0, 0.0], [2.0 - overlap, 0.0, 0.0]])
    still, kind = np.zeros((2, 3)), np.array([0, 1])
    bodies = Bodies(x, still, still.copy(), np.ones(2), np.ones(2), kind, np.arange(2))
    contacts = Contacts(np.array([0, 1, 1]), np.array([1], np.uint32), np.zeros(1), None, x.copy(), 0.1)
    return bodies, contacts, Loads(np.full((2, 3), np.nan), None)


def test_the_loop_takes_the_law_of_its_table(monkeypatch):
    monkeypatch.setitem(LAWS, SquareTable, SQUARE)
    loop = numba.njit(pair_forces.py_func)  # no disk cache: the law stands outside mechanics
    k = np.array([[0.0, 3.0], [3.0, 0.0]])
    zero = np.zeros((2, 2))
    for table, expected in ((SquareTable(k), 3.0 * 0.25), (LinearTable(k, zero, zero, zero, zero), 3.0 * 0.5)):
        bodies, contacts, loads = touching(0.5)
        loop(bodies, contacts, contacts.slip, loads, table, None, 0.1)
        np.testing.assert_allclose(loads.force, [[-expected, 0.0, 0.0], [expected, 0.0, 0.0]])


def test_functions_in_python_are_those_of_the_loop():
    law = LinearTable(*(np.array([[value]]) for value in (10.0, 2.0, 5.0, 1.0, 0.5)))
    assert dispatch.normal(law, 0, 0, 0.1, -1.0) == (1.0, 3.0)
    assert dispatch.normal(law, 0, 0, 0.1, 9.0) == (1.0, 0.0)  # never pulls
    assert dispatch.shear(law, 0, 0, 0.1, 3.0) == (5.0, 1.0, 1.5)
    assert dispatch.stiffness(law, 0, 0, 0.1) == 10.0
    assert dispatch.normal_energy(law, 0, 0, 0.1) == pytest.approx(0.05)
    assert dispatch.shear_energy(law, 0, 0, 0.1, 4.0) == pytest.approx(0.4)


def test_a_table_of_no_law_is_refused():
    with pytest.raises(KeyError):
        dispatch.normal((1.0, 2.0), 0, 0, 0.1, 0.0)
