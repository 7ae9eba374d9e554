"""The fit of a law to curves: the truth comes back, failing candidates stay finite, threads change nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from graben.mechanics.fitting.curves import Curve, CurveFit, Weights
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.materials.point import drive
from graben.mechanics.optimise.levenberg_marquardt import levenberg_marquardt
from graben.mechanics.optimise.multistart import Plan, search
from graben.mechanics.optimise.space import Box

TRUTH = {
    "young_modulus": 2.0e9,
    "poisson_ratio": 0.2,
    "friction_angle": 0.9,
    "dilation_angle": 0.6,
    "initial_yield": 5e4,
    "hardening_gain": 1e6,
    "hardening_rate": 300.0,
}
FREE = ["young_modulus", "friction_angle", "dilation_angle", "hardening_gain", "hardening_rate"]
FIXED = {k: v for k, v in TRUTH.items() if k not in FREE}
BOX = Box.of(FREE, [0.5e9, 0.7, 0.1, 1e5, 30.0], [2e10, 1.1, 1.0, 1e7, 3000.0], [True, False, False, True, True])
VALUES = np.array([TRUTH[n] for n in FREE])


def synthetic(noise=0.0, seed=0, confinements=(0.5e6, 1e6, 4e6), steps=41):
    """Curves of the law itself: seated at the confinement in four increments, then two per point."""
    par = pack("drucker-prager", TRUTH)
    rng = np.random.default_rng(seed)
    curves = []
    for c in confinements:
        path = np.zeros((steps, 4))
        path[:, 0], path[:, 1] = -c, -np.linspace(0, 0.04, steps)
        sig, state, eps = np.zeros(4), LAWS["drucker-prager"].initial_state(par), np.zeros(4)
        seat, plane = np.array([1, 1, 0, 0]), np.array([1, 0, 0, 0])
        ramp = np.array([np.zeros(4), [-c, -c, 0.0, 0.0]])
        none = np.empty((0, 3))
        drive(3, par, 1.0, 1e-8, 4, seat, ramp, sig, state, eps, np.empty((2, 4)), np.empty((2, 4)), none)
        eps[:] = 0.0
        stress, strain = np.empty((steps, 4)), np.empty((steps, 4))
        assert drive(3, par, 1.0, 1e-8, 2, plane, path, sig, state, eps, stress, strain, none) == steps - 1
        stress[:, 1] *= 1 + noise * rng.normal(size=steps)
        strain[:, 0] *= 1 + noise * rng.normal(size=steps)
        curves.append(Curve(f"{c / 1e6:g} MPa", stress, strain))
    return curves


def test_truth_has_no_residual_and_comes_back_from_elsewhere():
    fit = CurveFit("drucker-prager", FIXED, FREE, synthetic())
    assert fit.objective(VALUES[None])[0] < 1e-12
    found = search(lambda u: fit.residuals(BOX.to_values(u)), BOX.size, Plan(starts=1, particles=16, generations=30))
    np.testing.assert_allclose(BOX.to_values(found.best.x), VALUES, rtol=2e-3)


def test_noise_is_recovered_as_error_of_the_fit():
    fit = CurveFit("drucker-prager", FIXED, FREE, synthetic(noise=0.02), Weights(last=1.0))
    r = levenberg_marquardt(lambda u: fit.residuals(BOX.to_values(u)), BOX.to_unit(VALUES * 1.05))
    np.testing.assert_allclose(BOX.to_values(r.x), VALUES, rtol=0.1)
    assert fit.errors(BOX.to_values(r.x))["stress"] == pytest.approx(0.02 * 12e6, rel=0.5)


def test_threads_do_not_change_a_bit():
    curves = synthetic()
    candidates = BOX.to_values(np.random.default_rng(0).random((17, BOX.size)))
    one = CurveFit("drucker-prager", FIXED, FREE, curves, workers=1).residuals(candidates)
    two = CurveFit("drucker-prager", FIXED, FREE, curves, workers=2).residuals(candidates)
    np.testing.assert_array_equal(one, two)


def test_every_candidate_of_the_box_gives_finite_residuals_even_when_damage_ends_its_path():
    free = [*FREE, "failure_displacement", "initiation_strain_050"]
    fixed = {**FIXED, "damage": "ductile", "initiation_strain_060": 1e-3, "max_damage": 0.99999}
    fit = CurveFit("drucker-prager", fixed, free, synthetic(), length=10.0)
    box = Box.of(free, [*BOX.lower, 1e-4, 1e-6], [*BOX.upper, 1.0, 1.0], [*BOX.log, True, True])
    u = np.random.default_rng(1).random((60, box.size))
    assert np.isfinite(fit.residuals(box.to_values(u))).all()
    assert (fit.predict(box.to_values(u)).reached <= 40).all()


def test_weights_give_each_curve_the_same_say():
    curves = synthetic()
    fit = CurveFit("drucker-prager", FIXED, FREE, curves, Weights(strain=0.0, last=1.0))
    shares = []
    for i, c in enumerate(curves):
        scaled = [
            Curve(d.name, d.stress * np.array([1, 1.1 if j == i else 1.0, 1, 1]), d.strain)
            for j, d in enumerate(curves)
        ]
        # compare the shift's cost: 10 % of one curve's stress
        moved = CurveFit("drucker-prager", FIXED, FREE, scaled, Weights(strain=0.0, last=1.0))
        base = fit.residuals(VALUES[None])[0]
        shares.append(np.sum((moved.residuals(VALUES[None])[0] - base) ** 2))
        assert len(c.stress) == 41
    assert max(shares) < 2.0 * min(shares)


def test_triaxial_control_holds_both_lateral_stresses():
    path = np.zeros((11, 4))
    path[:, [0, 2]], path[:, 1] = -1e6, -1e6 - np.linspace(0, 2e6, 11)
    strain = np.zeros((11, 4))
    strain[:, 1] = -np.linspace(0, 2e6, 11) / 2e9
    strain[:, 0] = strain[:, 2] = 0.2 * np.linspace(0, 2e6, 11) / 2e9
    curve = Curve("lab", path, strain, control="sese", seat="ssse")
    fit = CurveFit("elastic", {"poisson_ratio": 0.2}, ["young_modulus"], [curve])
    assert fit.objective(np.array([[2e9]]))[0] < 1e-16
    assert fit.errors(np.array([2e9]))["stress"] < 1.0


@pytest.mark.parametrize(
    ("curves", "text"),
    [
        ([], "at least one"),
        ([Curve("short", np.zeros((1, 4)), np.zeros((1, 4)))], "short"),
        ([Curve("hole", np.full((3, 4), np.nan), np.zeros((3, 4)))], "finite"),
    ],
)
def test_bad_curves_are_refused(curves, text):
    with pytest.raises(ValueError, match=text):
        CurveFit("elastic", {"poisson_ratio": 0.2}, ["young_modulus"], curves)


@pytest.mark.parametrize("last", [0.0, 0.5, 1.0, 3.0])
def test_no_curve_dominates_by_its_size_its_points_or_the_weights_along_it(last):
    """Curves of 1 and 100 MPa with 11 and 101 points, all wrong by 10 % of their top: with "curve" each costs the
    same whatever the weights along it, with "all" as the square of its stress."""
    curves, tops = [], np.array([1e6, 1e8, 5e6])
    for top, steps in zip(tops, (11, 11, 101)):
        strain, stress = np.zeros((steps, 4)), np.zeros((steps, 4))
        strain[:, 1] = -np.linspace(0.0, 0.9 * top / 1e9, steps)
        stress[:, 1] = 1e9 * strain[:, 1] - 0.1 * top
        curves.append(Curve(f"{top:g}", stress, strain, seat="seee"))
    costs = {}
    for normalise in ("curve", "all"):
        weights = Weights(normalise, last=last, strain=0.0)
        fit = CurveFit("elastic", {"poisson_ratio": 0.0}, ["young_modulus"], curves, weights)
        r = fit.residuals(np.array([[1e9]]))[0, : fit.points]
        costs[normalise] = np.array([np.sum(r[fit.groups[: fit.points] == g] ** 2) for g in range(3)])
    np.testing.assert_allclose(costs["curve"], 0.01 / 3, rtol=1e-9)
    np.testing.assert_allclose(costs["all"], 0.01 / 3 * (tops / tops.max()) ** 2, rtol=1e-9)


def test_lateral_strain_counts_as_its_weight_says_on_every_curve():
    """Lateral strain that is missed from the first state on costs weight^2 times what
    missing the stress would, on every curve."""
    curves = []
    for top in (0.01, 0.1):
        strain, stress = np.zeros((21, 4)), np.zeros((21, 4))
        strain[:, 1] = -np.linspace(0.0, top, 21)
        strain[1:, 0] = 0.1 * top  # the law answers 0 with nu = 0
        stress[:, 1] = 1e9 * strain[:, 1]
        curves.append(Curve(f"{top:g}", stress, strain))
    weights = Weights("curve", last=0.5, strain=0.3)
    fit = CurveFit("elastic", {"poisson_ratio": 0.0}, ["young_modulus"], curves, weights)
    r = fit.residuals(np.array([[1e9]]))[0, : fit.points]
    costs = np.array([np.sum(r[fit.groups[: fit.points] == g] ** 2) for g in range(4)])
    along = np.linspace(1.0, 0.5, 21) ** 2
    missed = 0.3**2 / 2 * along[1:].sum() / along.sum()
    np.testing.assert_allclose(costs, [0.0, missed, 0.0, missed], atol=1e-12)


@pytest.mark.parametrize(
    ("law", "fixed", "asked"),
    [
        ("mohr-coulomb", {"cohesion": 1e6}, {"friction_angle": 0.5, "dilation_angle": 0.7}),
        (
            "drucker-prager",
            {"hardening": "barcelona", "strain_at_peak": 0.01},
            {"friction_angle": 0.8, "dilation_angle": 0.9, "initial_yield": 2e6, "peak_yield": 1e6},
        ),
        (
            "lubliner",
            {"tensile_yield": 1e5, "strain_at_peak": 0.01},
            {"dilation_angle": 1.0, "stress_invariant_ratio": 0.9, "initial_yield": 2e6, "peak_yield": 1e6},
        ),
        (
            "transverse-elastic",
            {"shear_modulus_across": 1e9, "young_modulus_across": 1e9},
            {"poisson_ratio_across": -0.9},
        ),
    ],
)
def test_values_that_do_not_go_together_become_the_nearest_that_do(law, fixed, asked):
    """A search may ask for more dilation than friction; what it ends with is a material that other stages take."""
    fixed = {"young_modulus": 2e9, "poisson_ratio": 0.2, **fixed}
    assert LAWS[law].faults({**fixed, **asked})
    fit = CurveFit(law, fixed, list(asked), synthetic(confinements=(1e6,)))
    values = np.array(list(asked.values()))
    used = fit.used(values)
    assert LAWS[law].faults({**fixed, **dict(zip(asked, used))}) == []
    asked_for, taken = fit.predict(values[None]), fit.predict(used[None])
    np.testing.assert_array_equal(asked_for.stress, taken.stress)
    assert asked_for.moved[0] > 0.0 == taken.moved[0]
    assert fit.objective(values[None])[0] > fit.objective(used[None])[0]


@settings(max_examples=20, deadline=None, derandomize=True)
@given(arrays(float, 4, elements=st.floats(-0.01, 0.01)), st.sampled_from(["curve", "all"]))
def test_it_makes_no_difference_where_the_gauges_were_zeroed(offset, normalise):
    """Constants on any strain, lateral ones too: the same residuals, errors and predictions."""
    curves = synthetic(noise=0.02, confinements=(0.5e6, 4e6))
    moved = [Curve(c.name, c.stress, c.strain + offset * (i + 1)) for i, c in enumerate(curves)]
    weights = Weights(normalise, strain=1.0)
    one, other = (CurveFit("drucker-prager", FIXED, FREE, c, weights) for c in (curves, moved))
    np.testing.assert_allclose(other.residuals(VALUES[None]), one.residuals(VALUES[None]), rtol=0, atol=1e-9)
    assert other.errors(VALUES)["strain"] == pytest.approx(one.errors(VALUES)["strain"], abs=1e-12)
    np.testing.assert_array_equal(one.predict(VALUES[None]).strain[0, :, 0, :2], 0.0)


def test_a_first_state_under_a_deviator_is_where_strain_begins():
    """A log that begins at half of the load: the point is seated at that stress, and both count strain from there."""
    e, nu, cell = 18e9, 0.25, 8e6
    q = np.linspace(20e6, 40e6, 21)
    stress, strain = np.zeros((21, 4)), np.zeros((21, 4))
    stress[:, [0, 2]], stress[:, 1] = -cell, -cell - q
    strain[:, 1], strain[:, 0] = -q / e, nu * q / e
    strain[:, 2] = strain[:, 0]
    curve = Curve("late", stress, strain, control="sese", seat="ssse")
    fit = CurveFit("elastic", {}, ["young_modulus", "poisson_ratio"], [curve])
    assert fit.objective(np.array([[e, nu]]))[0] < 1e-16
