"""Errors, extrapolation and the front against closed forms."""

import numpy as np
import pytest

from graben.stages.tradeoff.errors import Errors, cheapest_within, errors_of, front_of, limit_of

SIZES = np.array([4.0, 2.0, 1.5, 0.5])
NONE = np.full(4, np.nan)


def sequence(order, seeds=1):
    """Values that tend to 10 with the order, and a shift a seed."""
    return 10.0 + 0.3 * SIZES[:, None] ** order + 0.1 * np.arange(seeds)


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0, 4.0])
def test_richardson_finds_limit_and_order_of_a_power(order):
    found = limit_of(sequence(order, 3), SIZES)
    assert found.order == pytest.approx(order, rel=1e-9)
    np.testing.assert_allclose(found.value, [10.0, 10.1, 10.2], rtol=1e-12)


@pytest.mark.parametrize(
    ("values", "sizes", "reason"),
    [
        ([[1.0], [2.0], [1.5]], [3.0, 2.0, 1.0], "do not settle"),
        ([[1.0], [2.0], [4.0]], [3.0, 2.0, 1.0], "no order"),
        ([[1.0], [2.0]], [2.0, 1.0], "three numbers"),
        ([[1.0], [2.0], [2.5]], None, "three numbers"),
        ([[1.0], [np.nan], [2.5]], [3.0, 2.0, 1.0], "no value"),
        ([[0.0], [1.0], [1.0 + 1e-6]], [3.0, 2.0, 1.0], "no order"),
        ([[0.0, 0.0], [1.0, 1.6], [1.5, 1.6]], [3.0, 2.0, 1.0], "scatter"),
    ],
)
def test_a_sequence_that_does_not_allow_it_is_refused(values, sizes, reason):
    found = limit_of(np.array(values), None if sizes is None else np.array(sizes))
    assert found.value is None and reason in found.reason


def test_what_a_seed_adds_falls_out():
    values = np.outer([1.1, 1.02], [5.0, 7.0, 9.0])
    found = errors_of(values, np.array([5.0, 7.0, 9.0]), np.nan, np.nan, NONE[:2], NONE[:2])
    for ends in found.error, found.low, found.high:
        np.testing.assert_allclose(ends, [0.1, 0.02], rtol=1e-12)


def test_the_interval_is_students():
    ratio = np.array([0.9, 1.0, 1.1, 1.2])
    found = errors_of(ratio[None] * 3.0, np.full(4, 3.0), np.nan, np.nan, NONE[:1], NONE[:1])
    half = 3.182446305 * ratio.std(ddof=1) / 2.0  # quantile of three degrees of freedom, from a table
    assert found.error[0] == pytest.approx(0.05)
    np.testing.assert_allclose([found.low[0], found.high[0]], [0.05 - half, 0.05 + half], rtol=1e-8)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_intervals_of_runs_and_of_the_reference_add_in_squares(sign):
    values = sign * np.array([[11.0], [10.2]])
    own = sign * np.array([[10.7, 10.2], [11.4, 10.2]])
    found = errors_of(values, np.array([10.0 * sign]), 9.6 * sign, 10.3 * sign, *np.sort(own, axis=0))
    np.testing.assert_allclose(found.error, [0.1, 0.02], rtol=1e-12)
    np.testing.assert_allclose(found.low, [0.1 - np.hypot(0.03, 0.03), 0.02 - 0.03], rtol=1e-9)
    np.testing.assert_allclose(found.high, [0.1 + np.hypot(0.04, 0.04), 0.02 + 0.04], rtol=1e-9)


def test_one_run_without_an_interval_has_none():
    found = errors_of(np.array([[2.0]]), np.array([1.0]), np.nan, np.nan, NONE[:1], NONE[:1])
    assert found.error[0] == 1.0 and np.isnan([found.low[0], found.high[0]]).all()


def test_front():
    cost = np.array([1.0, 2.0, 3.0, 4.0, 2.0])
    error = np.array([-0.5, 0.1, 0.2, np.nan, 0.1])
    np.testing.assert_array_equal(front_of(cost, error), [True, True, False, False, True])


def test_the_cheapest_point_counts_its_whole_interval():
    cost = np.array([1.0, 2.0, 3.0])
    error = np.array([0.03, -0.02, 0.01])
    errors = Errors(error, error - [0.0, 0.05, 0.01], error + np.array([0.03, 0.0, 0.01]))
    assert cheapest_within(0.05, cost, errors) == 2
    assert cheapest_within(0.06, cost, errors) == 0
    assert cheapest_within(0.001, cost, errors) is None
