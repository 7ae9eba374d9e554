"""J2 with its three hardening forms against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, pack, update

TABLE = np.array([[0.0, 380e6], [0.02, 436e6], [0.2, 588e6], [1.0, 762e6]])
E, NU = 210e9, 0.33
LAW = LAWS["j2"]
NONE = np.empty((0, 0))


def make() -> np.ndarray:
    return pack("j2", {"young_modulus": E, "poisson_ratio": NU, "hardening": TABLE})


@pytest.mark.parametrize("n", [4, 6])
def test_uniaxial_stress_follows_the_table(n: int) -> None:
    """eps_axial = sigma / E + p, eps_lateral = -nu sigma / E - p / 2: feed the strain, get the stress."""
    par, sig, state = make(), np.zeros(n), np.zeros(1)
    last = np.zeros(n)
    for p in np.concatenate([[0.0], np.geomspace(1e-5, 1.4, 60)]):
        strength = np.interp(p, TABLE[:, 0], TABLE[:, 1])
        lateral = -NU * strength / E - p / 2
        strain = np.zeros(n)
        strain[:3] = strength / E + p, lateral, lateral
        assert update(LAW.id, strain - last, sig, state, par, 1.0, NONE) == 0
        last = strain
        exact = np.zeros(n)
        exact[0] = strength
        np.testing.assert_allclose(sig, exact, atol=1e-9 * strength)
        assert state[0] == pytest.approx(p, abs=1e-13)


def test_one_step_across_several_rows_of_the_table_is_exact() -> None:
    """Along a radial path the return does not depend on the number of steps, kinks of the table included."""
    par = make()
    direction = np.array([2.0, -1.0, -1.0, 0.6, 0.4, -0.3]) / 3
    results = []
    for steps in (1, 500):
        sig, state = np.zeros(6), np.zeros(1)
        for _ in range(steps):
            update(LAW.id, 0.7 * direction / steps, sig, state, par, 1.0, NONE)
        results.append((sig, state))
    np.testing.assert_allclose(results[0][0], results[1][0], rtol=1e-11)
    np.testing.assert_allclose(results[0][1], results[1][1], rtol=1e-11)


@pytest.mark.parametrize("n", [4, 6])
def test_tangent_is_the_derivative(n: int) -> None:
    par = make()
    rng = np.random.default_rng(0)
    for _ in range(20):
        start, d = 200e6 * rng.uniform(-1, 1, n), 3e-3 * rng.uniform(-1, 1, n)
        tangent, numeric = np.zeros((n, n)), np.zeros((n, n))
        update(LAW.id, d, start.copy(), np.array([0.01]), par, 1.0, tangent)
        for j in range(n):
            ends = []
            for h in (1e-7, -1e-7):
                sig, moved = start.copy(), d.copy()
                moved[j] += h
                update(LAW.id, moved, sig, np.array([0.01]), par, 1.0, NONE)
                ends.append(sig)
            numeric[:, j] = (ends[0] - ends[1]) / 2e-7
        np.testing.assert_allclose(tangent, numeric, atol=1e-5 * np.abs(numeric).max())


def test_yield_surface_and_dissipation_over_random_histories() -> None:
    par, sig, state = make(), np.zeros(6), np.zeros(1)
    rng = np.random.default_rng(4)
    for _ in range(300):
        d = rng.uniform(-1, 1, 6) * 10.0 ** rng.uniform(-5, -1)
        before = state[0]
        assert update(LAW.id, d, sig, state, par, 1.0, NONE) == 0
        s = sig[:3] - sig[:3].mean()
        q = np.sqrt(1.5 * ((s**2).sum() + 2 * (sig[3:] ** 2).sum()))
        assert q <= np.interp(state[0], TABLE[:, 0], TABLE[:, 1]) * (1 + 1e-12)
        assert state[0] >= before


def test_bad_input_leaves_the_point_alone_or_is_refused() -> None:
    par, sig, state = make(), np.full(6, 1e6), np.array([0.1])
    d = np.zeros(6)
    d[2] = np.nan
    assert update(LAW.id, d, sig, state, par, 1.0, NONE) > 0
    assert (sig == 1e6).all() and state[0] == 0.1
    for table in ([[0.1, 1e6]], [[0.0, 2e6], [0.1, 1e6]], [[0.0, -1.0]]):
        with pytest.raises(ValueError, match="hardening"):
            pack("j2", {"young_modulus": E, "poisson_ratio": NU, "hardening": table})


BASE = {"young_modulus": E, "poisson_ratio": NU, "initial_yield": 380e6}
FORMS = {
    "linear": ({"hardening_modulus": 2e9}, lambda p: 380e6 + 2e9 * p),
    "exponential": (
        {"hardening_gain": 250e6, "hardening_rate": 40.0},
        lambda p: 380e6 + 250e6 * (1 - np.exp(-40.0 * p)),
    ),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("n", [4, 6])
def test_curves_of_hardening_follow_their_formula(form: str, n: int) -> None:
    """Uniaxial stress as for the table; and one large radial step reaches the same as many."""
    values, curve = FORMS[form]
    par, sig, state = pack("j2", {**BASE, "hardening": form, **values}), np.zeros(n), np.zeros(1)
    last = np.zeros(n)
    for p in np.concatenate([[0.0], np.geomspace(1e-6, 1.4, 60)]):
        strain = np.zeros(n)
        strain[:3] = curve(p) / E + p, -NU * curve(p) / E - p / 2, -NU * curve(p) / E - p / 2
        assert update(LAW.id, strain - last, sig, state, par, 1.0, NONE) == 0
        last = strain
        assert sig[0] == pytest.approx(curve(p), rel=1e-9)
        np.testing.assert_allclose(sig[1:], 0.0, atol=1e-9 * curve(p))
        assert state[0] == pytest.approx(p, abs=1e-12)
    sig, state = np.zeros(n), np.zeros(1)
    update(LAW.id, last, sig, state, par, 1.0, NONE)
    assert state[0] == pytest.approx(1.4, rel=1e-9)


def test_a_steep_exponential_returns_from_any_distance() -> None:
    """q - 3 G dp = s(dp), whatever the rate, the gain and the size of the step."""
    shear = E / (2 * (1 + NU))
    rng = np.random.default_rng(2)
    for _ in range(300):
        gain, rate, step = 10.0 ** rng.uniform(3, 13), 10.0 ** rng.uniform(-3, 9), 10.0 ** rng.uniform(-2, 0)
        par = pack("j2", {**BASE, "hardening": "exponential", "hardening_gain": gain, "hardening_rate": rate})
        sig, state = np.zeros(6), np.zeros(1)
        assert update(LAW.id, step * np.array([0, 0, 0, 1.0, 0, 0]), sig, state, par, 1.0, NONE) == 0
        strength = 380e6 + gain * -np.expm1(-rate * state[0])
        q = np.sqrt(3.0) * shear * step
        if state[0] > 0:
            assert np.sqrt(3.0) * sig[3] == pytest.approx(strength, rel=1e-9)
            assert q - 3 * shear * state[0] == pytest.approx(strength, rel=1e-8, abs=1e-9 * q)
        else:
            assert q <= 380e6


def test_words_and_rows_mean_the_same_table() -> None:
    rows = {"young_modulus": E, "poisson_ratio": NU, "hardening": TABLE}
    words = {**rows, "hardening": "table", "hardening_table": TABLE}
    assert (pack("j2", rows) == pack("j2", words)).all()
    with pytest.raises(ValueError, match="initial_yield"):
        pack("j2", {**BASE, "hardening": TABLE})
    with pytest.raises(ValueError, match="hardening_modulus"):
        pack("j2", {**BASE, "hardening": "linear"})


@pytest.mark.parametrize("form", FORMS)
def test_tangent_of_the_curves(form: str) -> None:
    par = pack("j2", {**BASE, "hardening": form, **FORMS[form][0]})
    rng = np.random.default_rng(5)
    for _ in range(10):
        start, d = 200e6 * rng.uniform(-1, 1, 6), 3e-2 * rng.uniform(-1, 1, 6)
        tangent, numeric = np.zeros((6, 6)), np.zeros((6, 6))
        update(LAW.id, d, start.copy(), np.array([0.01]), par, 1.0, tangent)
        for j in range(6):
            ends = []
            for h in (1e-7, -1e-7):
                sig, moved = start.copy(), d.copy()
                moved[j] += h
                update(LAW.id, moved, sig, np.array([0.01]), par, 1.0, NONE)
                ends.append(sig)
            numeric[:, j] = (ends[0] - ends[1]) / 2e-7
        np.testing.assert_allclose(tangent, numeric, atol=1e-5 * np.abs(numeric).max())
