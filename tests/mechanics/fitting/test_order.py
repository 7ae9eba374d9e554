"""The value of a point depends on that point alone to the last bit, not on how many come with it, nor on who asks."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest

from graben.mechanics.fitting.curves import CurveFit
from graben.mechanics.fitting.objective import Objective, Priors
from graben.mechanics.optimise.appso import appso
from graben.mechanics.optimise.multistart import sum_of_squares
from graben.mechanics.optimise.space import Box
from tests.mechanics.fitting.test_curves import FIXED, FREE, VALUES, synthetic

BOX = Box.of(FREE, 0.5 * VALUES, 2.0 * VALUES, [True] * len(FREE))
PRIOR = Priors(np.array([1, 0]), np.array([0.4, 0.5]), np.array([0.1, 0.3]))


def objective(curves, priors, workers=1):
    confinements = (0.5e6, 2e6, 4e6)[:curves]
    fit = CurveFit("drucker-prager", FIXED, FREE, synthetic(noise=0.02, confinements=confinements), workers=workers)
    return Objective(fit, BOX, PRIOR if priors else Priors.none())


@pytest.mark.parametrize("priors", [False, True])
@pytest.mark.parametrize("curves", [1, 2, 3])
def test_sums_of_a_point_are_the_same_in_any_company(curves, priors):
    """One curve and no priors leave an array whose rows are not contiguous, which numpy adds up in another order."""
    f = partial(sum_of_squares, objective(curves, priors))
    points = np.random.default_rng(1).random((23, len(FREE)))
    together = f(points)
    for size in (1, 2, 3, 7):
        apart = np.concatenate([f(points[i : i + size]) for i in range(0, 23, size)])
        np.testing.assert_array_equal(apart, together)
    np.testing.assert_array_equal(f(points[::-1])[::-1], together)


def test_functions_that_answer_by_columns_are_added_up_alike():
    table = np.random.default_rng(2).normal(size=(61, 9))

    def by_columns(points):
        return np.asfortranarray(np.repeat(points, 61, axis=1)[:, :61] * table[:, :1].T)

    points = np.random.default_rng(3).random((9, 4))
    together = sum_of_squares(by_columns, points)
    np.testing.assert_array_equal([sum_of_squares(by_columns, p[None])[0] for p in points], together)


def test_asynchronous_swarm_ends_with_the_same_bits_on_one_two_and_three_workers():
    f = partial(sum_of_squares, objective(1, False))
    settings = {"particles": 7, "generations": 6, "seed": 5}
    alone = appso(f, len(FREE), **settings)

    def same(other):
        for name in ("best", "positions", "values", "history"):
            np.testing.assert_array_equal(getattr(other, name), getattr(alone, name))

    for workers in (1, 2, 3):
        for chunk in (1, 2, 4):
            with ThreadPoolExecutor(workers) as pool:
                same(appso(f, len(FREE), executor=pool, chunk=chunk, **settings))
        same(appso(partial(sum_of_squares, objective(1, False, workers)), len(FREE), **settings))
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        same(appso(f, len(FREE), executor=pool, chunk=2, **settings))
