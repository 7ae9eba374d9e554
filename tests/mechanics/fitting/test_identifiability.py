"""Covariance against linear regression's closed form, coverage of intervals, and what the data cannot see."""

import numpy as np
import pytest

from graben.mechanics.fitting.autocorrelation import lasting_meat
from graben.mechanics.fitting.identifiability import UNSEEN, identify


def line(m=200, noise=0.05, seed=0):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, m)
    a = np.stack([np.ones(m), t], axis=1)
    truth = np.array([0.4, 0.5])
    y = a @ truth + noise * rng.normal(size=m)
    x = np.linalg.lstsq(a, y, rcond=None)[0]
    return a, x, a @ x - y, truth


def test_covariance_is_that_of_linear_regression():
    a, x, r, _truth = line()
    k = identify(x, r, a, bounded=False)
    expected = (r @ r) / (len(r) - 2) * np.linalg.inv(a.T @ a)
    np.testing.assert_allclose(k.covariance, expected, rtol=1e-10)
    np.testing.assert_allclose(k.standard_error, np.sqrt(np.diag(expected)), rtol=1e-10)
    assert k.correlation[0, 1] == pytest.approx(expected[0, 1] / np.sqrt(expected[0, 0] * expected[1, 1]))
    assert k.identifiable.all() and not k.unseen.any()
    np.testing.assert_allclose(identify(x, r, a).covariance, expected, rtol=0.02)  # the bounds add next to nothing


def test_intervals_cover_the_truth_as_often_as_they_say():
    inside = []
    for seed in range(400):
        a, x, r, truth = line(seed=seed)
        k = identify(x, r, a, groups=np.zeros(len(r), int), lag=3)
        inside.append([np.abs(x - truth) < 1.96 * k.standard_error, np.abs(x - truth) < 1.96 * k.robust_error])
    plain, robust = np.mean(inside, axis=(0, 2))
    assert 0.92 < plain < 0.98 and 0.92 < robust < 0.99


def test_correlated_residuals_widen_the_robust_interval_only():
    """Noise that repeats over 10 points carries a tenth of the information: errors sqrt(10) larger; taken for an
    autoregressive sequence, 0.9 from point to point, sqrt(19)."""
    rng = np.random.default_rng(1)
    m = 2000
    a = np.stack([np.ones(m), np.linspace(-1, 1, m)], axis=1)
    noise = np.repeat(rng.normal(size=m // 10), 10) * 0.1
    x = np.linalg.lstsq(a, a @ [0.5, 0.5] + noise, rcond=None)[0]
    r = a @ (x - 0.5) - noise
    k = identify(x, r, a, groups=np.zeros(m, int), lag=40)
    ratio = k.robust_error / k.standard_error
    assert (ratio > 0.8 * np.sqrt(10)).all() and (ratio < 1.1 * np.sqrt(19)).all()


def test_a_duplicated_parameter_is_not_identifiable():
    a, _x, _r, _truth = line()
    twin = np.stack([a[:, 0], a[:, 1], a[:, 1]], axis=1)
    r = 0.01 * np.random.default_rng(2).normal(size=len(a))
    k = identify(np.array([0.5, 0.4, 0.6]), r, twin)
    assert k.identifiable.tolist() == [True, False, False]
    assert k.unseen.tolist() == [True, False, False]
    np.testing.assert_allclose(np.abs(k.directions[0]), [0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-6)
    # the sum is known, the difference is as wide as the bounds leave it
    np.testing.assert_allclose(k.standard_error[1:], UNSEEN / np.sqrt(2), rtol=0.01)
    assert k.standard_error[0] < 0.01


def test_a_parameter_without_effect_and_one_at_a_bound_are_told_apart():
    a, _x, _r, _truth = line()
    j = np.stack([a[:, 0], np.zeros(len(a)), a[:, 1]], axis=1)
    r = 0.01 * np.random.default_rng(2).normal(size=len(a))
    k = identify(np.array([0.5, 0.4, 1.0]), r, j)
    assert k.free.tolist() == [True, True, False]
    assert k.identifiable.tolist() == [True, False, False]
    assert k.direction_error[0] > UNSEEN and np.isnan(k.standard_error[2])
    assert k.standard_error[1] == pytest.approx(UNSEEN)


def test_everything_at_a_bound_gives_nothing_rather_than_an_error():
    k = identify(np.array([0.0, 1.0]), np.ones(5), np.ones((5, 2)))
    assert not k.free.any() and k.directions.shape == (0, 2) and not k.identifiable.any()


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.8])
def test_an_autoregressive_sequence_is_seen_through_what_a_fit_takes_of_it(rho):
    """Errors of mean and slope over six groups of 40 points with the scatter of each its own: the estimated variance
    against the true J^T S J, and rho, which residuals alone show too small."""
    rng = np.random.default_rng(7)
    groups = np.repeat(np.arange(6), 40)
    size = np.repeat([1.0, 3.0, 0.1, 1.0, 0.5, 2.0], 40)
    along = np.tile(np.linspace(-1, 1, 40), 6)
    j = np.stack([np.ones(240), along, along**2, along**3], axis=1) / size[:, None]
    lags = np.abs(np.arange(40)[:, None] - np.arange(40))
    root = np.linalg.cholesky(rho**lags)
    truth = sum((j[groups == g]).T @ (rho**lags) @ j[groups == g] for g in range(6))
    found, shown = [], []
    for _ in range(60):
        errors = (root @ rng.normal(size=(40, 6))).T.ravel()
        r = errors - j @ np.linalg.lstsq(j, errors, rcond=None)[0]
        meat, estimate = lasting_meat(j, r, groups)
        found.append(np.sqrt(np.diag(meat) / np.diag(truth)))
        shown.append(estimate)
    # one standard error of rho on the safe side
    assert np.mean(shown) == pytest.approx(rho + np.sqrt((1 - rho**2) / 240), abs=0.04)
    assert 0.95 < np.mean(found) < 1.15


def smooth(seed=0, m=120, noise=1e-3):
    """Two parameters that are seen, one that is computed as rounding only: residuals, jacobian, its noise."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, m)
    j = np.stack([np.ones(m), t, 1e-9 * rng.normal(size=m)], axis=1)
    n = np.stack([1e-7 * t, 1e-7 * t**2, 1e-9 * rng.normal(size=m)], axis=1)
    return noise * rng.normal(size=m), j, n


@pytest.mark.parametrize("noise", [1e-3, 1e-12, 0.0])
def test_a_column_of_rounding_is_not_seen_however_exact_the_data(noise):
    r, j, n = smooth(noise=noise)
    x = np.array([0.4, 0.5, 0.6])
    k = identify(x, r, j, noise=n, floor=1e-10)
    assert k.identifiable.tolist() == [True, True, False] and k.unseen.tolist() == [True, False, False]
    assert k.standard_error[2] == pytest.approx(UNSEEN, rel=1e-6) and not k.doubtful.any()
    assert k.standard_error[0] >= 1e-10 / np.sqrt(len(r))
    if noise < 1e-10:  # without the noise: an absurdly small error of something that is not there
        assert identify(x, r, j).standard_error[2] < 0.1 * UNSEEN


@pytest.mark.parametrize("unit", [1e-12, 1e-3, 1e6])
def test_errors_and_verdicts_do_not_depend_on_units(unit):
    r, j, n = smooth()
    x = np.array([0.4, 0.5, 0.6])
    groups = np.repeat([0, 1, 2], 40)
    one = identify(x, r, j, noise=n, floor=1e-10, groups=groups, lag=3)
    other = identify(x, unit * r, unit * j, noise=unit * n, floor=unit * 1e-10, groups=groups, lag=3)
    np.testing.assert_allclose(other.robust_error, one.robust_error, rtol=1e-6)
    np.testing.assert_array_equal(other.identifiable, one.identifiable)


def test_verdicts_stay_when_inputs_are_blurred_or_added_up_in_another_order():
    r, j, n = smooth(noise=0.02)
    j[:, 1] *= 0.04  # about half of what the bounds leave open: in the grey zone
    x, rng = np.array([0.4, 0.5, 0.6]), np.random.default_rng(5)
    wanted = identify(x, r, j, noise=n)
    assert wanted.doubtful.tolist() == [False, True, False]
    for _ in range(20):
        rows, factor = rng.permutation(len(r)), 1.0 + 1e-9 * rng.normal(size=(len(r), 1))
        got = identify(x, (r * factor[:, 0])[rows], (j * factor)[rows], noise=n[rows])
        for name in ("identifiable", "doubtful", "unseen", "direction_doubtful", "near_bound", "free"):
            np.testing.assert_array_equal(getattr(got, name), getattr(wanted, name))


def test_a_search_that_stopped_early_says_how_far_it_had_to_go():
    a, x, _r, _truth = line(noise=1e-3)
    y = a @ x + 1e-3 * np.random.default_rng(1).normal(size=len(a))
    best = np.linalg.lstsq(a, y, rcond=None)[0]
    early = best + np.array([0.01, -0.02])
    k = identify(early, a @ early - y, a)
    assert (k.robust_error > np.abs(early - best)).all() and (k.pending > 0.9).all()
    done = identify(best, a @ best - y, a)
    assert (done.pending < 1e-6).all() and (done.robust_error < 1e-3).all()
