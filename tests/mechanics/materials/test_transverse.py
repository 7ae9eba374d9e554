"""Transversely isotropic elasticity against its compliance, turned by the tensor rule."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, pack, update
from graben.mechanics.materials.point import follow

LAW = LAWS["transverse-elastic"]
E, E2, NU, NU2, G2 = 30e9, 12e9, 0.22, 0.15, 5e9
PAIRS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


def make(**more: float) -> np.ndarray:
    values = {
        "young_modulus": E,
        "young_modulus_across": E2,
        "poisson_ratio": NU,
        "poisson_ratio_across": NU2,
        "shear_modulus_across": G2,
        **more,
    }
    return pack("transverse-elastic", values)


def strain_of(stress: np.ndarray, angle: float) -> np.ndarray:
    """Tensor strain (3, 3) of a stress (3, 3): turn to the axes of the layers, apply the compliance, turn back."""
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    t = axes @ stress @ axes.T
    e = np.zeros((3, 3))
    e[0, 0] = t[0, 0] / E2 - NU2 / E2 * (t[1, 1] + t[2, 2])
    e[1, 1] = t[1, 1] / E - NU / E * t[2, 2] - NU2 / E2 * t[0, 0]
    e[2, 2] = t[2, 2] / E - NU / E * t[1, 1] - NU2 / E2 * t[0, 0]
    e[0, 1] = e[1, 0] = t[0, 1] / (2 * G2)
    e[0, 2] = e[2, 0] = t[0, 2] / (2 * G2)
    e[1, 2] = e[2, 1] = t[1, 2] * (1 + NU) / E
    return axes.T @ e @ axes


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2, -1.1])
@pytest.mark.parametrize("n", [4, 6])
def test_strain_of_a_stress_gives_that_stress_back(angle: float, n: int) -> None:
    rng = np.random.default_rng(1)
    par = make(axis_angle=angle)
    for _ in range(5):
        a = rng.normal(size=(3, 3)) * 1e6
        stress = a + a.T
        if n == 4:
            stress[:2, 2] = stress[2, :2] = 0.0
        strain = strain_of(stress, angle)
        deps = np.array([strain[p] * (1 if p[0] == p[1] else 2) for p in PAIRS[:n]])
        sig, tangent = np.zeros(n), np.zeros((n, n))
        assert update(LAW.id, deps, sig, np.zeros(2), par, 1.0, tangent) == 0
        exact = np.array([stress[p] for p in PAIRS[:n]])
        np.testing.assert_allclose(sig, exact, atol=1e-12 * np.abs(exact).max())
        np.testing.assert_allclose(tangent @ deps, sig, rtol=1e-12, atol=1e-4)
        np.testing.assert_allclose(tangent, tangent.T, rtol=1e-12, atol=1e-3)


def test_modulus_along_a_turned_axis_is_the_classical_one() -> None:
    """1/E(t) = c^4/E' + s^4/E + c^2 s^2 (1/G' - 2 nu'/E') under uniaxial stress, in plane stress and in space."""
    for angle in np.linspace(0.0, np.pi, 7):
        c, s = np.cos(angle), np.sin(angle)
        modulus = 1 / (c**4 / E2 + s**4 / E + c * c * s * s * (1 / G2 - 2 * NU2 / E2))
        for n, word in ((3, "ess"), (4, "esss"), (6, "esssss")):
            path = np.zeros((2, n))
            path[1, 0] = 1e-3
            r = follow("transverse-elastic", make(axis_angle=angle), word, path)
            assert r.stress[0, 1, 0] == pytest.approx(1e-3 * modulus, rel=1e-8)


def test_equal_constants_are_isotropy() -> None:
    par = make(
        young_modulus_across=E, poisson_ratio_across=NU, shear_modulus_across=E / (2 * (1 + NU)), axis_angle=0.7
    )
    plain = pack("elastic", {"young_modulus": E, "poisson_ratio": NU})
    a, b = np.zeros((6, 6)), np.zeros((6, 6))
    update(LAW.id, np.zeros(6), np.zeros(6), np.zeros(2), par, 1.0, a)
    update(LAWS["elastic"].id, np.zeros(6), np.zeros(6), np.zeros(2), plain, 1.0, b)
    np.testing.assert_allclose(a, b, atol=1e-12 * E)


def test_constants_that_set_energy_free_are_refused() -> None:
    limit = np.sqrt((1 - NU) / 2 * E2 / E)
    with pytest.raises(ValueError, match="poisson_ratio_across"):
        make(poisson_ratio_across=1.001 * limit)
    tangent = np.zeros((6, 6))
    update(LAW.id, np.zeros(6), np.zeros(6), np.zeros(2), make(poisson_ratio_across=0.999 * limit), 1.0, tangent)
    assert np.linalg.eigvalsh(tangent).min() > 0
