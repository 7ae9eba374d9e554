"""ERVE damage against the formulas of H and a plain loop."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, pack, update

E, NU = 210e9, 0.33
LAW = LAWS["erve"]
NONE = np.empty((0, 0))
STRONG = [[0.0, 1e12]]


def make(**more) -> np.ndarray:
    values = {"young_modulus": E, "poisson_ratio": NU, "damage_threshold": 0.1e6, "hardening": STRONG, **more}
    return pack("erve", values)


def strain_for(stress: float) -> np.ndarray:
    return stress / E * np.array([1.0, -NU, -NU, 0, 0, 0])


def test_damage_starts_at_the_printed_threshold() -> None:
    """2 Psi_0 > r_d: 145 MPa uniaxial for r_d = 0.1 MPa in steel, far below yield."""
    limit = np.sqrt(0.1e6 * E)
    assert limit == pytest.approx(145e6, rel=2e-3)
    for factor, damaged in ((0.999, False), (1.001, True)):
        par = make()
        sig, state = np.zeros(6), LAW.initial_state(par)
        update(LAW.id, strain_for(factor * limit), sig, state, par, 1.0, NONE)
        assert (state[1] > 0) == damaged
        if not damaged:
            assert sig[0] == pytest.approx(factor * limit)


def test_sequential_loop_is_that_of_algorithm_2() -> None:
    step, n = 0.03, 20
    par = make(max_damage_step=step, subdomains=n)
    sig, state = np.zeros(6), LAW.initial_state(par)
    d = np.zeros(n)
    total = np.zeros(6)
    rng = np.random.default_rng(0)
    for _ in range(60):
        deps = strain_for(8e6) + 1e-5 * rng.uniform(-1, 1, 6)
        total += deps
        update(LAW.id, deps, sig, state, par, 1.0, NONE)
        c = np.zeros((6, 6))
        c[:3, :3] = E * NU / ((1 + NU) * (1 - 2 * NU))
        c[range(6), range(6)] += [E / (1 + NU)] * 3 + [E / (2 * (1 + NU))] * 3
        eff = c @ total
        energy = 0.5 * eff @ total
        for i in range(n):
            bar = n / (1 / (1 - d) ** 2).sum()
            f, slope = (1 - d[i]) ** 2, -2 * (1 - d[i])
            if -(bar**2) * slope / (n * f**2) * energy > 0.1e6 / n:
                d[i] = min(d[i] + step, 0.999)
        bar = n / (1 / (1 - d) ** 2).sum()
        np.testing.assert_allclose(state[2 : 2 + n], d, atol=1e-12)
        np.testing.assert_allclose(sig, bar * eff, atol=1e-8 * np.abs(eff).max())
    assert len(set(np.round(d, 6))) > 1  # the loop breaks the symmetry between equal subdomains


def test_splits_spare_compression() -> None:
    hydrostatic = -2e-3 * np.array([1.0, 1.0, 1.0, 0, 0, 0])
    for split, spared in (("none", False), ("volumetric", True), ("positive-principal", True)):
        par = make(split=split)
        sig, state = np.zeros(6), LAW.initial_state(par)
        update(LAW.id, hydrostatic, sig, state, par, 1.0, NONE)
        assert (state[1] == 0.0) == spared


def test_without_damage_it_is_j2_and_with_damage_it_never_heals() -> None:
    table = [[0.0, 380e6], [0.2, 588e6], [1.0, 762e6]]
    par = make(hardening=table, max_damage_step=0.0)
    plain = pack("j2", {"young_modulus": E, "poisson_ratio": NU, "hardening": table})
    sig, state, ref, p = np.zeros(6), LAW.initial_state(par), np.zeros(6), np.zeros(1)
    worn = make(hardening=table, max_damage_step=1e-3, damage_threshold=5e6, split="positive-principal")
    sig_w, state_w = np.zeros(6), LAW.initial_state(worn)
    rng = np.random.default_rng(3)
    damage = 0.0
    for _ in range(200):
        d = 2e-3 * rng.uniform(-1, 1, 6)
        update(LAW.id, d, sig, state, par, 1.0, NONE)
        update(LAWS["j2"].id, d, ref, p, plain, 1.0, NONE)
        np.testing.assert_allclose(sig, ref, atol=1e-3)
        assert update(LAW.id, d, sig_w, state_w, worn, 1.0, NONE) == 0
        assert damage <= state_w[1] < 1.0
        damage = state_w[1]
    assert damage > 0.0


def test_tangent_is_the_derivative_while_damage_holds() -> None:
    par = make(hardening=[[0.0, 380e6], [1.0, 762e6]], max_damage_step=0.0, split="volumetric")
    state = LAW.initial_state(par)
    state[1] = 0.3
    state[2:22] = 1 - np.sqrt(0.7)
    rng = np.random.default_rng(8)
    for _ in range(10):
        d = 4e-3 * rng.uniform(-1, 1, 6)
        tangent, numeric = np.zeros((6, 6)), np.zeros((6, 6))
        update(LAW.id, d, np.zeros(6), state.copy(), par, 1.0, tangent)
        for j in range(6):
            ends = []
            for h in (1e-7, -1e-7):
                sig, moved = np.zeros(6), d.copy()
                moved[j] += h
                update(LAW.id, moved, sig, state.copy(), par, 1.0, NONE)
                ends.append(sig)
            numeric[:, j] = (ends[0] - ends[1]) / 2e-7
        np.testing.assert_allclose(tangent, numeric, atol=1e-5 * np.abs(numeric).max())
