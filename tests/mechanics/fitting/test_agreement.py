"""Verdicts on starts and laws: three-valued, and the same whatever rounding does to their inputs."""

import numpy as np
import pytest

from graben.mechanics.fitting.agreement import agreement, rank

ERROR = np.array([0.01, 0.02, np.nan])
BEST = np.array([0.4, 0.6, 1.0])


@pytest.mark.parametrize(
    ("values", "move", "verdict"),
    [
        ([1.0, 1.0 + 1e-6, 9.0], [0.001, -0.002, 0.0], "agree"),
        ([1.3, 1.0, 9.0], [0.0, 0.0, 0.0], "disagree"),  # another objective
        ([1.0, 1.0001, 9.0], [0.0, 0.2, 0.0], "disagree"),  # the same, by other parameters
        ([1.0, 1.06, 9.0], [0.0, 0.0, 0.0], "doubtful"),
        ([1.0, 1.0, 9.0], [0.03, 0.0, 0.0], "doubtful"),
        ([1.0, 1.0, 9.0], [0.0, 0.0, -0.1], "agree"),
        ([1.0, 1.0, 9.0], [0.0, 0.0, -0.6], "disagree"),  # one at a bound, one not
    ],
)
def test_the_two_best_starts_decide_and_rounding_does_not(values, move, verdict):
    rng = np.random.default_rng(0)
    for blur in (0.0, 1e-9, 1e-9, 1e-9):
        ends = np.array([BEST, BEST + move, [0.1, 0.1, 0.1]]) * (1 + blur * rng.normal(size=(3, 3)))
        found = agreement(ends, np.array(values) * (1 + blur * rng.normal(size=3)), ERROR, points=80)
        assert found.verdict == verdict
        shuffled = agreement(ends[::-1], np.array(values)[::-1], ERROR, points=80)
        assert shuffled.verdict == verdict


def test_one_start_is_compared_with_nothing():
    assert agreement(BEST[None], np.array([1.0]), ERROR, points=9).verdict == "single"


def test_fits_to_exact_data_are_not_told_apart_by_rounding():
    """Sums of squares of 1e-28 and 1e-19 are both nothing beside a floor of 1e-9 in each of 100 residuals."""
    found = agreement(np.array([BEST, BEST + 1e-9]), np.array([1e-28, 1e-19]), 1e-12 * ERROR, points=100, floor=1e-9)
    assert found.verdict == "agree"
    exact = agreement(np.array([BEST, BEST]), np.zeros(2), ERROR, points=100)
    assert exact.verdict == "agree" and exact.ratio == 1.0


def test_laws_are_ranked_by_error_and_near_ones_named():
    errors, parameters = np.array([2.0, 1.02, 1.0, np.nan]), np.array([3, 4, 9, 2])
    rng = np.random.default_rng(1)
    for _ in range(5):
        order, close = rank(errors * (1 + 1e-9 * rng.normal(size=4)), parameters)
        assert order == [2, 1, 0, 3] and close == [2, 1]
    for way in (1e-12, -1e-12):  # equal to three digits: the law with fewer parameters
        assert rank(np.array([1.0, 1.0 + way]), np.array([8, 5]))[0] == [1, 0]
    assert rank(np.array([np.nan, np.nan]), np.array([1, 2])) == ([0, 1], [0, 1])
