"""Priors: the posterior of linear regression in closed form, and the weight of a prior against curves."""

import pickle

import numpy as np
import pytest

from graben.mechanics.fitting.curves import Curve, CurveFit, Weights
from graben.mechanics.fitting.identifiability import UNSEEN, identify
from graben.mechanics.fitting.objective import Objective, Priors
from graben.mechanics.optimise.levenberg_marquardt import levenberg_marquardt
from graben.mechanics.optimise.space import Box

TRUTH, NOISE, POINTS = 2e9, 0.05, 200


def elastic_curve(seed, modulus=TRUTH):
    """Axial compression without lateral stress in plane strain, nu = 0: stress = E strain; noise of the top."""
    strain, stress = np.zeros((POINTS, 4)), np.zeros((POINTS, 4))
    strain[:, 1] = -np.linspace(0.0, 0.01, POINTS)
    top = modulus * 0.01
    stress[:, 1] = modulus * strain[:, 1] + NOISE * top * np.random.default_rng(seed).normal(size=POINTS)
    stress[0, 1] = 0.0
    return Curve("bar", stress, strain)


def objective(curve, mean, deviation):
    fit = CurveFit("elastic", {"poisson_ratio": 0.0}, ["young_modulus"], [curve], Weights(last=1.0, strain=0.0))
    box = Box.of(["young_modulus"], [1e9], [3e9])
    priors = Priors(np.array([0]), np.array([(mean - 1e9) / 2e9]), np.array([deviation / 2e9]))
    return Objective(fit, box, priors, NOISE), box


@pytest.mark.parametrize("deviation", [2e6, 2e7, 2e8])
def test_prior_and_curve_meet_where_bayes_says(deviation):
    """Normal noise of known size and a normal prior: the posterior mean weighs both by their inverse variances."""
    curve, mean = elastic_curve(1), 2.2e9
    goal, box = objective(curve, mean, deviation)
    found = box.to_values(levenberg_marquardt(goal, np.array([0.5])).x)[0]
    e, s = curve.strain[:, 1], curve.stress[:, 1]
    sigma = NOISE * np.abs(s).max()  # noise is stated relative to the largest stress of the curve
    data_precision = e @ e / sigma**2
    expected = (e @ s / sigma**2 + mean / deviation**2) / (data_precision + deviation**-2.0)
    assert found == pytest.approx(expected, rel=1e-5)
    known = identify(
        np.array([(found - 1e9) / 2e9]), goal.data(np.array([[(found - 1e9) / 2e9]]))[0],
        np.concatenate([e * 2e9, [0.0]])[:, None] / np.abs(s).max() / np.sqrt(POINTS),
        precision=goal.priors.precision(1), bounded=False,
    )  # fmt: skip
    actual = e @ e / (NOISE * TRUTH * 0.01) ** 2  # the error is judged by the scatter found, not by the one stated
    assert known.standard_error[0] * 2e9 == pytest.approx((actual + deviation**-2.0) ** -0.5, rel=0.1)


def test_correlated_points_leave_more_weight_to_the_prior():
    goal, _box = objective(elastic_curve(0), 2.2e9, 2e7)
    slow = Objective(goal.fit, goal.box, goal.priors, goal.noise, lag=3)
    assert slow.prior_scale == pytest.approx(2.0 * goal.prior_scale)


def test_a_prior_alone_does_not_make_a_parameter_identifiable():
    x, r, j = np.array([0.5]), np.full(10, 0.01), np.full((10, 1), 1e-9)
    tight = np.array([0.02**-2.0])
    known = identify(x, r, j, precision=tight)
    assert known.standard_error[0] == pytest.approx((tight[0] + UNSEEN**-2.0) ** -0.5)
    assert not known.identifiable[0] and known.unseen[0]


def test_the_objective_travels_between_processes():
    goal, _box = objective(elastic_curve(0), 2.2e9, 2e7)
    points = np.array([[0.2], [0.7]])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(goal))(points), goal(points))


def test_priors_must_agree():
    with pytest.raises(ValueError, match="above zero"):
        Priors(np.array([0]), np.array([0.5]), np.array([0.0]))
    with pytest.raises(ValueError, match="as many"):
        Priors(np.array([0, 1]), np.array([0.5]), np.array([0.1]))
