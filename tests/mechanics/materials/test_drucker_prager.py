"""The extended Drucker-Prager law against its defining equations, closed forms and finite differences."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graben.mechanics.materials.laws import LAWS, pack, update

LAW = LAWS["drucker-prager"]
NONE = np.zeros((0, 0))
BASE = {
    "young_modulus": 1.8e9,
    "poisson_ratio": 0.2,
    "friction_angle": math.radians(52),
    "dilation_angle": math.radians(22),
    "flow_stress_ratio": 0.81,
    "initial_yield": 5e4,
    "hardening_gain": 3e6,
    "hardening_rate": 200.0,
}
DAMAGE = {
    "damage": "ductile",
    "initiation_strain_050": 0.005,
    "initiation_strain_060": 0.02,
    "failure_displacement": 0.5,
}


def tensor(v, shear=1.0):
    full = np.zeros(6)
    full[: len(v)] = v
    xx, yy, zz, xy, yz, zx = full
    return np.array([[xx, xy * shear, zx * shear], [xy * shear, yy, yz * shear], [zx * shear, yz * shear, zz]])


def invariants(sig):
    """p, q, t's ratio r^3/q^3 from the definitions, Y (2.22)-(2.25) with p and q the right way round."""
    p = -np.trace(sig) / 3
    dev = sig + p * np.eye(3)
    q = math.sqrt(1.5 * np.sum(dev * dev))
    return p, q, 4.5 * np.trace(dev @ dev @ dev)


def surface(sig, k, tangent_angle):
    p, q, r3 = invariants(sig)
    t = 0.5 * q * (1 + 1 / k - (1 - 1 / k) * r3 / q**3) if q > 0 else 0.0
    return t - p * tangent_angle


def elastic_strain(sig, young, nu):
    return ((1 + nu) * sig - nu * np.trace(sig) * np.eye(3)) / young


def sigma_c(values, e):
    assert values.get("hardening", "exponential") == "exponential"
    return values["initial_yield"] + values["hardening_gain"] * (1 - math.exp(-values["hardening_rate"] * e))


@pytest.mark.parametrize("n", [4, 6])
@pytest.mark.parametrize("ratio", [1.0, 0.81, 7 / 9])
def test_return_satisfies_the_defining_equations(n, ratio):
    """Yield, flow along dG/dsigma (by differences of G itself) and hardening hold at the end of each increment."""
    values = {**BASE, "flow_stress_ratio": ratio}
    par = pack("drucker-prager", values)
    rng = np.random.default_rng(3)
    tb, tp = math.tan(values["friction_angle"]), math.tan(values["dilation_angle"])
    checked = 0
    for _ in range(60):
        sig, state = np.zeros(n), LAW.initial_state(par)
        sig[:3] = -2e6
        for _ in range(3):
            deps = rng.normal(size=n) * 10 ** rng.uniform(-4, -2)
            before, e0 = tensor(sig), state[0]
            assert update(LAW.id, deps, sig, state, par, 1.0, NONE) == 0
            if state[0] == e0:
                continue
            after = tensor(sig)
            d = (1 - tb / 3) * sigma_c(values, state[0])
            p, q, _r3 = invariants(after)
            assert abs(surface(after, ratio, tb) - d) < 1e-9 * (q + abs(p) + d)
            if q < 1e-6 * abs(p):
                continue  # at the apex
            plastic = tensor(deps, 0.5) - elastic_strain(after - before, 1.8e9, 0.2)
            normal = np.zeros((3, 3))
            h = 1e-5 * q
            for i in range(3):
                for j in range(i, 3):
                    step = np.zeros((3, 3))
                    step[i, j] = step[j, i] = h if i == j else 0.5 * h
                    normal[i, j] = normal[j, i] = (
                        surface(after + step, ratio, tp) - surface(after - step, ratio, tp)
                    ) / (2 * h)
            multiplier = (state[0] - e0) / (1 - tp / 3)
            np.testing.assert_allclose(plastic, multiplier * normal, atol=1e-6 * np.abs(plastic).max())
            checked += 1
    assert checked > 60


@pytest.mark.parametrize("damage", [False, True])
@pytest.mark.parametrize("hardening", ["exponential", "barcelona", "linear", "table"])
def test_tangent_matches_finite_differences(damage, hardening):
    values = {k: v for k, v in BASE.items() if not k.startswith("hardening")}
    values |= {
        "exponential": {"hardening_gain": 3e6, "hardening_rate": 200.0},
        "barcelona": {"hardening": "barcelona", "peak_yield": 2e6, "strain_at_peak": 0.01},
        "linear": {"hardening": "linear", "hardening_modulus": 1e8},
        "table": {"hardening": "table", "hardening_table": [[0.0, 1e5], [0.02, 2e6], [0.1, 1e6]]},
    }[hardening]
    par = pack("drucker-prager", {**values, **(DAMAGE if damage else {})})
    rng = np.random.default_rng(5)
    errors = []
    for trial in range(120):
        n = 4 if trial % 2 else 6
        sig, state, tangent = np.zeros(n), LAW.initial_state(par), np.zeros((n, n))
        sig[:3] = -1e6
        for _ in range(3):
            deps = rng.normal(size=n) * 10 ** rng.uniform(-5, -2)
            deps[:3] += (0.0, 4e-3, -4e-3)[trial % 3]
            if trial % 5 == 0:
                deps[3:] = 0.0
            old, before = sig.copy(), state.copy()
            assert update(LAW.id, deps, sig, state, par, 1.0, tangent) == 0
            h = 1e-7 * np.abs(deps).max()
            numeric = np.zeros((n, n))
            for j in range(n):
                ends = []
                for way in (1, -1):
                    s, z, d = old.copy(), before.copy(), deps.copy()
                    d[j] += way * h
                    update(LAW.id, d, s, z, par, 1.0, NONE)
                    ends.append(s)
                numeric[:, j] = (ends[0] - ends[1]) / (2 * h)
            errors.append(np.abs(numeric - tangent).max() / 1.8e9)
    # a difference that straddles a kink (first yield, initiation, a table's corner) is not a derivative
    assert np.percentile(errors, 97) < 1e-5


def test_uniaxial_compression_yields_at_the_initial_yield_stress_and_measures_axial_plastic_strain():
    par = pack("drucker-prager", {**BASE, "initial_yield": 1e6})
    sig, state = np.zeros(6), LAW.initial_state(par)
    lateral = 0.0
    axial = 0.0
    for _ in range(200):  # lateral strain by bisection until the lateral stress vanishes
        low, high = -1e-4, 5e-4
        for _ in range(60):
            mid = 0.5 * (low + high)
            s, z = sig.copy(), state.copy()
            update(LAW.id, np.array([mid, -1e-4, mid, 0, 0, 0.0]), s, z, par, 1.0, NONE)
            low, high = (mid, high) if s[0] < 0 else (low, mid)
        first = state[0] == 0.0 and z[0] > 0.0
        if first:
            assert 1e6 < -s[1] < 1e6 + 1.8e9 * 1e-4
        sig, state = s, z
        lateral, axial = lateral + mid, axial - 1e-4
    assert -sig[1] == pytest.approx(1e6 + 3e6 * (1 - math.exp(-200 * state[0])), rel=1e-6)
    assert state[0] == pytest.approx(-(axial - sig[1] / 1.8e9), rel=1e-6)
    assert lateral > 0


@pytest.mark.parametrize("confining", [0.0, 1e6, 10e6])
def test_triaxial_strength_in_compression_and_extension(confining):
    """From F = 0: compression s = (3 tan b c + ...); t = q in compression and q/K in extension."""
    k, tb, cohesion = 0.8, math.tan(BASE["friction_angle"]), 2e6
    par = pack("drucker-prager", {**BASE, "flow_stress_ratio": k, "initial_yield": cohesion, "hardening_gain": 0.0})
    d = (1 - tb / 3) * cohesion
    for sign, factor in ((1.0, 1.0), (-1.0, 1.0 / k)):
        # axial = -confining - sign q, p = confining + sign q / 3
        q = (confining * tb + d) / (factor - sign * tb / 3)
        for scale, yields in ((1 - 1e-9, False), (1 + 1e-9, True)):
            sig = np.array([-confining, -confining - sign * q * scale, -confining, 0.0])
            state = LAW.initial_state(par)
            assert update(LAW.id, np.zeros(4), sig, state, par, 1.0, NONE) == 0
            assert (state[0] > 0) == yields


def test_plane_and_space_agree():
    par = pack("drucker-prager", {**BASE, **DAMAGE})
    rng = np.random.default_rng(1)
    a, b = np.zeros(4), np.zeros(6)
    za, zb = LAW.initial_state(par), LAW.initial_state(par)
    for _ in range(50):
        deps = rng.normal(size=4) * 1e-3 + [0, -5e-4, 0, 0]
        ta, tb = np.zeros((4, 4)), np.zeros((6, 6))
        assert update(LAW.id, deps, a, za, par, 1.0, ta) == 0
        assert update(LAW.id, np.r_[deps, 0.0, 0.0], b, zb, par, 1.0, tb) == 0
        np.testing.assert_allclose(a, b[:4], rtol=1e-9, atol=1e-3)
        np.testing.assert_allclose(ta, tb[:4, :4], atol=1e-5 * 1.8e9)
        np.testing.assert_allclose(za, zb, rtol=1e-9, atol=1e-15)


def test_tension_goes_to_the_apex():
    par = pack("drucker-prager", {**BASE, "initial_yield": 1e6, "hardening_gain": 0.0})
    sig, state = np.zeros(4), LAW.initial_state(par)
    assert update(LAW.id, np.array([1e-2, 1e-2, 1e-2, 1e-3]), sig, state, par, 1.0, NONE) == 0
    tb = math.tan(BASE["friction_angle"])
    np.testing.assert_allclose(sig, [(1 - tb / 3) * 1e6 / tb] * 3 + [0.0], rtol=1e-9, atol=1e-6)


def test_damage_starts_and_grows_as_stated():
    """Simple shear at constant p: sum(de / e_f) reaches 1, then dD = L de / u_f."""
    values = {
        **BASE,
        **DAMAGE,
        "hardening_gain": 0.0,
        "initial_yield": 1e6,
        "dilation_angle": 0.0,
        "flow_stress_ratio": 1.0,
    }
    par = pack("drucker-prager", values)
    sig, state = np.full(6, 0.0), LAW.initial_state(par)
    sig[:3] = -0.5e6
    total, d2 = 0.0, 0.005**6 / 0.02**5
    d3 = 10 * math.log(0.005 / 0.02)
    length, damage = 2.0, 0.0
    for _ in range(400):
        e0 = state[0]
        assert update(LAW.id, np.array([0, 0, 0, 2e-4, 0, 0.0]), sig, state, par, length, NONE) == 0
        gain = state[0] - e0
        p, q, _r3 = invariants(tensor(sig) / (1 - state[1]))
        ef = d2 * math.exp(d3 * (-p / q)) if gain > 0 else 1.0
        started = total >= 1.0
        total += gain / ef
        if started:
            damage += length * gain / 0.5
        elif total > 1.0:
            damage += length * (total - 1.0) * ef / 0.5
        assert state[1] == pytest.approx(damage, abs=1e-9)
    assert 0.05 < damage < 0.9


def test_damage_stops_at_its_maximum_and_unloading_keeps_it():
    par = pack("drucker-prager", {**BASE, **DAMAGE, "max_damage": 0.999})
    sig, state = np.zeros(4), LAW.initial_state(par)
    for _ in range(100):
        assert update(LAW.id, np.array([5e-3, -1e-2, 0, 0]), sig, state, par, 10.0, NONE) == 0
    assert state[1] == 0.999
    tangent = np.zeros((4, 4))
    assert update(LAW.id, np.array([0, 1e-5, 0, 0]), sig, state, par, 10.0, tangent) == 0
    assert state[1] == 0.999 and tangent[1, 1] == pytest.approx(1e-3 * 2e9, rel=1e-9)


def test_bad_numbers_are_refused_and_leave_the_state_alone():
    par = pack("drucker-prager", BASE)
    for bad in (np.nan, np.inf):
        sig, state = np.full(4, -1e6), LAW.initial_state(par)
        assert update(LAW.id, np.array([bad, 0, 0, 0]), sig, state, par, 1.0, NONE) > 0
        assert (sig == -1e6).all() and (state == 0).all()


@settings(max_examples=150)
@given(
    young=st.floats(3, 15),
    nu=st.sampled_from([0.0, 0.2, 0.45, 0.4999]),
    ratio=st.sampled_from([7 / 9, 0.9, 1.0]),
    cohesion=st.sampled_from([0.0, 1e-8, 1e-3]),
    friction=st.sampled_from([0.0, 1.0, 30.0, 56.0, 70.0]),
    flow=st.floats(0.0, 1.0),
    form=st.sampled_from(["exponential", "barcelona", "linear"]),
    damage=st.booleans(),
    seed=st.integers(0, 10_000),
)
def test_every_finite_increment_converges_on_or_inside_the_surface(
    young, nu, ratio, cohesion, friction, flow, form, damage, seed
):
    """Moduli over 12 decades, increments to 10 % and reversals: no failure, F <= 0, dissipation not negative."""
    e = 10.0**young
    c0 = cohesion * e
    values = {"young_modulus": e, "poisson_ratio": nu, "flow_stress_ratio": ratio, "initial_yield": c0}
    values |= {"friction_angle": math.radians(friction), "dilation_angle": math.radians(flow * friction)}
    values |= {
        "exponential": {"hardening_gain": 1e-3 * e, "hardening_rate": 1e4},
        "barcelona": {"hardening": "barcelona", "peak_yield": 3 * c0, "strain_at_peak": 1e-3},
        "linear": {"hardening": "linear", "hardening_modulus": -0.01 * e},
    }[form]
    if damage:
        values |= {**DAMAGE, "initiation_strain_050": 1e-3, "failure_displacement": 0.01, "max_damage": 0.999}
    par = pack("drucker-prager", values)
    rng = np.random.default_rng(seed)
    n = 4 if seed % 2 else 6
    sig, state, tangent = np.zeros(n), LAW.initial_state(par), np.zeros((n, n))
    shear, bulk = e / (2 * (1 + nu)), e / (3 * (1 - 2 * nu))
    tb = math.tan(math.radians(friction))
    hard = LAW.index("hardening")
    for step in range(6):
        deps = rng.normal(size=n) * 10 ** rng.uniform(-8, -1)
        if step % 3 == 2:
            deps = -deps
        old, before, d0 = tensor(sig) / (1 - state[1]), state[0], state[1]
        assert update(LAW.id, deps, sig, state, par, 1.0, tangent) == 0
        assert np.isfinite(sig).all() and np.isfinite(tangent).all() and np.isfinite(state).all()
        assert state[0] >= before and d0 <= state[1] <= 0.999
        effective = tensor(sig) / (1 - state[1])
        curve = hardening_value(par, hard, values, state[0])
        _p, _q, _r3 = invariants(effective)
        size = 2 * shear * np.abs(deps).max() + 3 * bulk * np.abs(deps[:3]).max() + np.abs(old).max() + curve
        assert surface(effective, ratio, tb) <= (1 - tb / 3) * curve + 1e-9 * size
        plastic = tensor(deps, 0.5) - elastic_strain(effective - old, e, nu)
        # the plastic strain is a difference of elastic strains: their rounding times the stress is not dissipation
        rounding = 1e-14 * size**2 / e
        assert np.sum(effective * plastic) >= -1e-9 * size * np.abs(deps).max() - rounding


def hardening_value(par, slot, values, strain):
    from graben.mechanics.materials.hardening import harden

    a, b = par[LAW.index("max_damage") + 3], par[LAW.index("max_damage") + 4]
    return harden(int(par[slot]), strain, values["initial_yield"], a, b, par, 0)[0]
