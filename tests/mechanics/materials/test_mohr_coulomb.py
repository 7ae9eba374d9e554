"""Mohr-Coulomb with tension cut-off: closed forms, edges and corners, tangent, random histories."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graben.mechanics.materials.laws import LAWS, pack, update

LAW = LAWS["mohr-coulomb"]
NONE = np.zeros((0, 0))
ROCK = {
    "young_modulus": 65e9,
    "poisson_ratio": 0.2,
    "friction_angle": math.radians(51),
    "dilation_angle": math.radians(10),
    "cohesion": 55.1e6,
    "tensile_strength": 11.7e6,
}


def principal(sig):
    full = np.zeros(6)
    full[: len(sig)] = sig
    xx, yy, zz, xy, yz, zx = full
    return np.linalg.eigvalsh(np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]))[::-1]


def excess(sig, values):
    """Largest yield function."""
    s = principal(sig)
    phi, c = values["friction_angle"], values["cohesion"]
    shear = s[0] * (1 + math.sin(phi)) - s[2] * (1 - math.sin(phi)) - 2 * c * math.cos(phi)
    return max(shear, s[0] - values["tensile_strength"])


@pytest.mark.parametrize("confining", [0.0, 10e6, 50e6])
def test_triaxial_strength(confining):
    """s1 = s3 N + 2 c sqrt(N) with N = tan^2(45 + phi/2), compression positive."""
    par = pack("mohr-coulomb", ROCK)
    n = math.tan(math.pi / 4 + ROCK["friction_angle"] / 2) ** 2
    strength = confining * n + 2 * ROCK["cohesion"] * math.sqrt(n)
    for scale, yields in ((1 - 1e-9, False), (1 + 1e-6, True)):
        sig, state = np.array([-confining, -strength * scale, -confining, 0.0]), LAW.initial_state(par)
        assert update(LAW.id, np.zeros(4), sig, state, par, 1.0, NONE) == 0
        assert (state[0] > 0) == yields


def test_uniaxial_tension_stops_at_the_cut_off_and_all_round_tension_at_its_corner():
    par = pack("mohr-coulomb", ROCK)
    sig, state = np.zeros(6), LAW.initial_state(par)
    assert update(LAW.id, np.array([1e-2, -2e-3, -2e-3, 0, 0, 0]), sig, state, par, 1.0, NONE) == 0
    assert sig[0] == pytest.approx(11.7e6)
    sig, state = np.zeros(6), LAW.initial_state(par)
    assert update(LAW.id, np.array([1e-2, 1e-2, 1e-2, 1e-3, 0, 2e-3]), sig, state, par, 1.0, NONE) == 0
    np.testing.assert_allclose(sig, [11.7e6] * 3 + [0] * 3, atol=1.0)


def test_plastic_volume_follows_the_dilation_angle_in_plane_shear():
    """Shear on the main plane: dv = 2 sin(psi) dlambda, and the maximal plastic shear is 2 dlambda."""
    par = pack("mohr-coulomb", ROCK)
    sig, state = np.array([-200e6, -200e6, -200e6, 0.0]), LAW.initial_state(par)
    deps = np.array([5e-3, -5e-3, 0.0, 0.0])
    before = sig.copy()
    assert update(LAW.id, deps, sig, state, par, 1.0, NONE) == 0
    change = sig - before
    elastic = ((1 + 0.2) * change[:3] - 0.2 * change[:3].sum()) / 65e9
    plastic = deps[:3] - elastic
    assert plastic[2] == pytest.approx(0.0, abs=1e-15)
    assert plastic.sum() / (plastic[0] - plastic[1]) == pytest.approx(math.sin(ROCK["dilation_angle"]), rel=1e-9)


def test_tangent_matches_finite_differences():
    par = pack("mohr-coulomb", ROCK)
    rng = np.random.default_rng(0)
    errors = []
    for trial in range(200):
        n = 4 if trial % 2 else 6
        sig, state, tangent = np.zeros(n), LAW.initial_state(par), np.zeros((n, n))
        sig[:3] = -20e6
        for _ in range(2):
            deps = rng.normal(size=n) * 10 ** rng.uniform(-4, -2)
            deps[:3] += (0.0, 2e-3, -2e-3)[trial % 3]
            old = sig.copy()
            assert update(LAW.id, deps, sig, state, par, 1.0, tangent) == 0
            h = 1e-7 * np.abs(deps).max()
            numeric = np.zeros((n, n))
            for j in range(n):
                ends = []
                for way in (1, -1):
                    s, z, d = old.copy(), LAW.initial_state(par), deps.copy()
                    d[j] += way * h
                    update(LAW.id, d, s, z, par, 1.0, NONE)
                    ends.append(s)
                numeric[:, j] = (ends[0] - ends[1]) / (2 * h)
            errors.append(np.abs(numeric - tangent).max() / 65e9)
    assert np.percentile(errors, 96) < 1e-5


@settings(max_examples=200)
@given(
    young=st.floats(3, 15),
    nu=st.sampled_from([0.0, 0.3, 0.4999]),
    phi=st.sampled_from([0.0, 5.0, 32.0, 51.0, 75.0]),
    flow=st.sampled_from([0.0, 0.3, 1.0]),
    cohesion=st.sampled_from([0.0, 1e-6, 1e-3]),
    tension=st.sampled_from([0.0, 1e-7, 1e-4, 1.0]),
    seed=st.integers(0, 10_000),
)
def test_every_finite_increment_returns_to_the_surface(young, nu, phi, flow, cohesion, tension, seed):
    e = 10.0**young
    values = {"young_modulus": e, "poisson_ratio": nu, "friction_angle": math.radians(phi)}
    values |= {"dilation_angle": flow * math.radians(phi), "cohesion": cohesion * e, "tensile_strength": tension * e}
    par = pack("mohr-coulomb", values)
    rng = np.random.default_rng(seed)
    n = 4 if seed % 2 else 6
    sig, state, tangent = np.zeros(n), LAW.initial_state(par), np.zeros((n, n))
    for step in range(6):
        deps = rng.normal(size=n) * 10 ** rng.uniform(-8, -1)
        if step % 3 == 2:
            deps[3:] = 0.0
        before = state[0]
        size = e / (1 - 2 * nu) * np.abs(deps).max() * 3 + np.abs(sig).max()
        assert update(LAW.id, deps, sig, state, par, 1.0, tangent) == 0
        assert excess(sig, values) <= 1e-8 * size
        assert state[0] >= before and np.isfinite(tangent).all()


def test_dilation_beyond_friction_is_refused():
    with pytest.raises(ValueError, match="dilation_angle"):
        pack("mohr-coulomb", {**ROCK, "dilation_angle": math.radians(60)})
