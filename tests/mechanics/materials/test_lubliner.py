"""Quasi-brittle damage-plasticity: curves in uniaxial tests, strength ratios, recovery, limits, tangent."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from graben.mechanics.fitting.curves import Curve, CurveFit
from graben.mechanics.materials.laws import LAWS, pack, update
from graben.mechanics.materials.lubliner import steepest_dilation
from graben.mechanics.materials.lubliner_curves import (
    CURRENT,
    PRINTED,
    compression_rate,
    cracking_strain,
    inelastic_strain,
    lambert_w,
    plastic_tension,
    tension_rate,
)
from graben.mechanics.materials.point import follow

LAW = LAWS["lubliner"]
NONE = np.zeros((0, 0))
ROCK = {
    "young_modulus": 20e9,
    "poisson_ratio": 0.2,
    "dilation_angle": math.radians(20),
    "initial_yield": 10e6,
    "peak_yield": 30e6,
    "strain_at_peak": 0.002,
    "tensile_yield": 3e6,
    "tensile_decay": 2000.0,
    "compressive_damage": 0.6,
    "tensile_damage": 0.6,
    "largest_inelastic_strain": 0.02,
    "largest_cracking_strain": 0.01,
}
PAR = pack("lubliner", ROCK)
LINE = Curve("line", np.zeros((2, 4)), np.array([[0.0, 0.0, 0.0, 0.0], [0.0, -1e-4, 0.0, 0.0]]))


def uniaxial(strains, par=PAR):
    """Axial strain prescribed, lateral stresses zero."""
    path = np.zeros((len(strains), 4))
    path[:, 1] = strains
    r = follow("lubliner", par, "sese", path)
    assert r.complete.all()
    return r


ALPHA = (2 * 30 - 10 + 2 * math.sqrt(30 * 20)) / 10
BETA = math.log(2 * ALPHA / (1 + ALPHA)) / 0.002
SQUEEZE, PULL = (20e9, 10e6, ALPHA, BETA), (20e9, 3e6, 2000.0)  # E and the curves of ROCK


def barcelona(x):
    return 10e6 * ((1 + ALPHA) * np.exp(-BETA * x) - ALPHA * np.exp(-2 * BETA * x))


def test_lambert_w_matches_scipy():
    x = np.concatenate([np.geomspace(1e-8, 1e8, 50), -np.geomspace(1e-8, 0.367, 30), [0.0]])
    np.testing.assert_allclose([lambert_w(v) for v in x], lambertw(x).real, rtol=1e-12)


@pytest.mark.parametrize("form", [CURRENT, PRINTED])
def test_damage_rates_lie_at_their_limits_and_conversions_invert(form):
    """At d = 1 plastic strain stops growing with damage somewhere in the range, Y (2.83)-(2.84); not below. e_pl =
    x - D/(1 - D) s/E with the stress of the moment, or with the first yield as Y prints."""
    for d, steady in ((0.9, True), (1.1, False)):
        m = compression_rate(form, d, *SQUEEZE, 0.002, 0.02)
        n = tension_rate(form, d, *PULL, 0.01)
        x = np.linspace(0, 0.02, 4001)
        s = barcelona(x) if form == CURRENT else 10e6
        plastic = x - m * x / (1 - m * x) * s / 20e9
        assert (np.diff(plastic) > 0).all() == steady
        y = np.linspace(0, 0.01, 4001)
        s = 3e6 * np.exp(-2000 * y) if form == CURRENT else 3e6
        cracks = y - ((1 + y) ** n - 1) * s / 20e9
        assert (np.diff(cracks) > 0).all() == steady
        if steady:
            found = [inelastic_strain(form, p, m, *SQUEEZE, 0.02) for p in plastic[::400]]
            np.testing.assert_allclose(found, x[::400], atol=1e-13)
            found = [cracking_strain(form, p, n, *PULL, 0.01) for p in cracks[::400]]
            np.testing.assert_allclose(found, y[::400], atol=1e-13)


@pytest.mark.parametrize("decay", [0.0, 300.0, 2000.0, 1e5, 1e9])
@pytest.mark.parametrize("young", [1e9, 20e9, 1e15])
def test_the_limit_in_tension_is_where_plastic_strain_stops(decay, young):
    """Also where stress falls faster than E: a conversion at 0.99 of the limit never turns back."""
    n = tension_rate(CURRENT, 0.99, young, 3e6, decay, 0.01)
    x = np.concatenate([np.linspace(0, 0.01, 1001), np.geomspace(1e-12, 0.01, 1001)])
    x.sort()
    cracks = np.array([plastic_tension(CURRENT, v, n, young, 3e6, decay) for v in x])
    assert n > 0 and np.isfinite(cracks).all() and (np.diff(cracks) >= -1e-15).all()


def test_printed_limits_are_those_of_the_source():
    """Y (2.86) at the largest strain, (2.90) by Lambert's W: with the first yield as stress."""
    young, first, x = 20e9, 10e6, 0.02
    product = 2 * young * x
    m = (first + product - math.sqrt(first * (first + 2 * product))) / (product * x)
    assert compression_rate(PRINTED, 1.0, *SQUEEZE, 0.002, x) == pytest.approx(m, rel=1e-12)
    y = np.linspace(0, 0.01, 65)[1:]
    n = (lambertw(young / 3e6 * (1 + y) * np.log1p(y)).real / np.log1p(y)).min()
    assert tension_rate(PRINTED, 1.0, *PULL, 0.01) == pytest.approx(n, rel=1e-12)


def test_uniaxial_compression_follows_the_barcelona_curve_over_crack_strain():
    """x = e - s/E, from strain and stress themselves: Y's own definition, which its (2.81) breaks."""
    r = uniaxial(-np.linspace(0, 0.006, 121))
    stress, strain, state = -r.stress[0, :, 1], -r.strain[0, :, 1], r.state[0]
    flowing = state[:, 2] > 1e-9
    x = (strain - stress / 20e9)[flowing]
    m = compression_rate(CURRENT, 0.6, *SQUEEZE, 0.002, 0.02)
    assert flowing.sum() > 100
    np.testing.assert_allclose(stress[flowing], barcelona(x), rtol=1e-7)
    np.testing.assert_allclose(state[flowing, 4], m * x, rtol=1e-8)
    np.testing.assert_allclose(state[flowing, 2], x - m * x / (1 - m * x) * barcelona(x) / 20e9, rtol=1e-7)
    assert (state[:, 3] < 1e-12).all() and stress.max() == pytest.approx(30e6, rel=1e-3)


def test_uniaxial_tension_follows_its_decay_over_crack_strain():
    r = uniaxial(np.linspace(0, 0.002, 81))
    stress, strain, state = r.stress[0, :, 1], r.strain[0, :, 1], r.state[0]
    flowing = state[:, 3] > 1e-9
    x = (strain - stress / 20e9)[flowing]
    n = tension_rate(CURRENT, 0.6, *PULL, 0.01)
    assert flowing.sum() > 60
    np.testing.assert_allclose(stress[flowing], 3e6 * np.exp(-2000 * x), rtol=1e-6)
    np.testing.assert_allclose(state[flowing, 5], 1 - (1 + x) ** -n, rtol=1e-6)
    assert (state[:, 2] < 1e-12).all()


def test_the_printed_conversion_shifts_the_curve_from_its_own_definition():
    """At the peak the shift is D/(1 - D) (s - s0)/E."""
    r = uniaxial(-np.linspace(0, 0.006, 601), pack("lubliner", {**ROCK, "crack_strain": "printed"}))
    stress, strain, state = -r.stress[0, :, 1], -r.strain[0, :, 1], r.state[0]
    m = compression_rate(PRINTED, 0.6, *SQUEEZE, 0.002, 0.02)
    for k in (150, 250, 400):
        x = inelastic_strain(PRINTED, state[k, 2], m, *SQUEEZE, 0.02)
        damage = state[k, 4]
        assert stress[k] == pytest.approx(barcelona(x), rel=1e-8)
        shift = strain[k] - stress[k] / 20e9 - x
        assert shift == pytest.approx(damage / (1 - damage) * (stress[k] - 10e6) / 20e9, rel=1e-6)


def test_biaxial_compression_yields_at_f0_times_the_uniaxial_stress():
    for scale, yields in ((1 - 1e-6, False), (1 + 1e-6, True)):
        stress = 1.16 * 10e6 * scale
        sig, state = np.array([-stress, -stress, 0.0, 0.0]), LAW.initial_state(PAR)
        assert update(LAW.id, np.zeros(4), sig, state, PAR, 1.0, NONE) == 0
        assert (state[0] > 0) == yields


def test_cracks_that_close_carry_compression_again():
    """With w_c = 1 the modulus under compression is E (1 - Dc) whatever the tensile damage; in tension E (1 - D)."""
    r = uniaxial(np.concatenate([np.linspace(0, 1e-3, 41), np.linspace(1e-3, -2e-4, 121)[1:]]))
    strain, stress, state = r.strain[0, :, 1], r.stress[0, :, 1], r.state[0]
    assert state[-1, 5] > 0.15
    pulling = slice(40, 43)
    slope = np.diff(stress[pulling]) / np.diff(strain[pulling])
    np.testing.assert_allclose(slope, 20e9 * (1 - state[42, 5]), rtol=1e-6)
    closing = (stress < -1e5) & (state[:, 4] < 1e-9)  # before it crushes
    assert closing.sum() > 10
    slope = np.diff(stress[closing]) / np.diff(strain[closing])
    np.testing.assert_allclose(slope, 20e9, rtol=1e-6)


def test_tangent_matches_finite_differences():
    rng = np.random.default_rng(0)
    errors = []
    for trial in range(150):
        n = 4 if trial % 2 else 6
        sig, state, tangent = np.zeros(n), LAW.initial_state(PAR), np.zeros((n, n))
        sig[:3] = -5e6
        for _ in range(3):
            deps = rng.normal(size=n) * 10 ** rng.uniform(-4.5, -3)
            deps[:3] += (0.0, 2e-4, -4e-4)[trial % 3]
            old, before = sig.copy(), state.copy()
            assert update(LAW.id, deps, sig, state, PAR, 1.0, tangent) == 0
            h = 1e-6 * np.abs(deps).max()
            numeric = np.zeros((n, n))
            for j in range(n):
                ends = []
                for way in (1, -1):
                    s, z, d = old.copy(), before.copy(), deps.copy()
                    d[j] += way * h
                    update(LAW.id, d, s, z, PAR, 1.0, NONE)
                    ends.append(s)
                numeric[:, j] = (ends[0] - ends[1]) / (2 * h)
            errors.append(np.abs(numeric - tangent).max() / 20e9)
    assert np.median(errors) < 1e-6 and np.percentile(errors, 95) < 1e-3


def test_flow_steeper_than_the_flattest_meridian_would_make_work_under_pressure():
    """Triaxial extension at 1000 times the yield stress, Kc = 1 and 2/3, psi forced to 0.99 and 1.01 of its limit:
    effective stress times plastic strain changes sign. What is stated beyond the limit is refused, what a search
    asks for is brought back to it."""
    for kc in (2 / 3, 1.0):
        limit = steepest_dilation(kc, 1.16)
        values = {**ROCK, "stress_invariant_ratio": kc, "compressive_damage": 0.0, "flow_eccentricity": 1e-4}
        power = []
        for factor in (0.99, 1.01):
            par = pack("lubliner", {**values, "dilation_angle": limit})
            par[-1] *= factor  # tan psi itself, past the check
            sig, state = np.array([-1e10, -1e10, -1e10, 0.0]), LAW.initial_state(par)
            deps = np.array([-1.0, 2.0, -1.0, 0.0])
            before = sig.copy()
            assert update(LAW.id, deps, sig, state, par, 1.0, NONE) == 0
            step = sig[:3] - before[:3]
            plastic = deps[:3] - ((1 + 0.2) * step - 0.2 * step.sum()) / 20e9
            power.append(sig[:3] @ plastic / (np.abs(sig[:3]).max() * np.abs(plastic).max()))
        assert power[0] > 1e-3 and power[1] < -1e-3
        with pytest.raises(ValueError, match="dilation_angle at most"):
            pack("lubliner", {**values, "dilation_angle": 1.01 * limit})
        fixed = {k: v for k, v in values.items() if k != "dilation_angle"}
        fit = CurveFit("lubliner", fixed, ["dilation_angle"], [LINE])
        assert fit.used(np.array([1.2])) == pytest.approx([limit], rel=1e-12)


def test_a_pressed_plane_with_free_faces_softens_all_the_way():
    """The free face is the largest principal stress, 0, where F has its kink: Newton alone stopped past yield."""
    values = {"young_modulus": 1e10, "poisson_ratio": 0.4999, "dilation_angle": 0.1581, "flow_eccentricity": 1e-3}
    values |= {"initial_yield": 1e6, "peak_yield": 2e6, "strain_at_peak": 2e-4, "tensile_yield": 1e5}
    values |= {"tensile_decay": 500.0, "compressive_damage": 0.0, "tensile_damage": 0.0, "biaxial_ratio": 1.01}
    ends = []
    for rows in (41, 401):
        path = np.zeros((rows, 3))
        path[:, 1] = -np.linspace(0, 1e-3, rows)
        path[:, 0] = 0.3 * path[:, 1]
        r = follow("lubliner", pack("lubliner", values), "eee", path)
        assert r.complete[0] and np.abs(r.stress[0, :, 2]).max() < 1.0
        ends.append(r.stress[0, -1, :2])
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.02)
    assert -0.6e6 < ends[1].min() < -0.5e6  # softened from 2.7 MPa


@pytest.mark.parametrize("cell", [0.0, 5e6, 20e6])
@pytest.mark.parametrize(("kc", "word"), [(2 / 3, "sese"), (1.0, "sese"), (2 / 3, "sesees")])
def test_triaxial_compression_follows_its_closed_form(cell, kc, word):
    """s1 = s2 = -cell: q (1 - A) = (3 A + gamma) cell + (1 - A) c(x), at every step of the hardening curve."""
    values = {**ROCK, "compressive_damage": 0.0, "tensile_damage": 0.0, "stress_invariant_ratio": kc}
    path = np.zeros((61, len(word)))
    path[:, [0, 2]], path[:, 1] = -cell, -np.linspace(0, 0.02, 61)
    start = np.zeros(len(word))
    start[:3] = -cell
    par = pack("lubliner", {**values, "dilation_angle": math.radians(15)})
    r = follow("lubliner", par, word, path, stress=start)
    assert r.complete.all()
    a, gamma = 0.16 / 1.32, 3 * (1 - kc) / (2 * kc - 1)
    alpha = (2 * 30 - 10 + 2 * math.sqrt(30 * 20)) / 10
    beta = math.log(2 * alpha / (1 + alpha)) / 0.002
    flowing = r.state[0, :, 2] > 0
    x = r.state[0, flowing, 2]
    yields = 10e6 * ((1 + alpha) * np.exp(-beta * x) - alpha * np.exp(-2 * beta * x))
    q = -r.stress[0, flowing, 1] - cell
    assert flowing.sum() > 40
    np.testing.assert_allclose(q, yields + (3 * a + gamma) / (1 - a) * cell, rtol=1e-7)


@settings(max_examples=150)
@given(
    young=st.floats(4, 15),
    nu=st.sampled_from([0.0, 0.2, 0.4999]),
    psi=st.sampled_from([0.01, 0.2, 0.8, 1.0]),
    kc=st.sampled_from([0.51, 2 / 3, 1.0]),
    strength=st.sampled_from([1e-6, 1e-4, 1e-2]),
    tension=st.sampled_from([1e-4, 0.1, 1.0]),
    damage=st.sampled_from([0.0, 0.5, 0.95]),
    seed=st.integers(0, 10_000),
)
def test_every_finite_increment_converges(young, nu, psi, kc, strength, tension, damage, seed):
    """Over 11 decades of modulus and with reversals: no failure, damage only grows in each direction, all finite."""
    e = 10.0**young
    values = {"young_modulus": e, "poisson_ratio": nu, "dilation_angle": max(psi * steepest_dilation(kc, 1.16), 1e-3)}
    values |= {"stress_invariant_ratio": kc, "initial_yield": strength * e, "peak_yield": 2 * strength * e}
    values |= {"strain_at_peak": 2 * strength, "tensile_yield": tension * strength * e, "tensile_decay": 500.0}
    values |= {"compressive_damage": damage, "tensile_damage": damage, "max_damage": 0.999}
    par = pack("lubliner", values)
    rng = np.random.default_rng(seed)
    n = 4 if seed % 2 else 6
    sig, state, tangent = np.zeros(n), LAW.initial_state(par), np.zeros((n, n))
    for step in range(6):
        deps = rng.normal(size=n) * 10 ** rng.uniform(-8, -1)
        if step % 3 == 2:
            deps = -deps
        before = state.copy()
        assert update(LAW.id, deps, sig, state, par, 1.0, tangent) == 0
        assert np.isfinite(sig).all() and np.isfinite(tangent).all() and np.isfinite(state).all()
        assert (state[2:] >= before[2:]).all() and state[1] <= 0.999
