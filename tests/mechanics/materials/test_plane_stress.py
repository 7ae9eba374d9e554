"""Plane stress, axisymmetric (triaxial) and three-dimensional paths of the point driver against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.point import follow

E, NU = 10e9, 0.25
ELASTIC = {"young_modulus": E, "poisson_ratio": NU}


def driven(law: str, values: dict, word: str, path: np.ndarray, stress: np.ndarray | None = None):
    r = follow(law, pack(law, {**ELASTIC, **values}), word, path, stress=stress)
    assert r.complete.all()
    return r


def line(end: list[float], steps: int = 201) -> np.ndarray:
    return np.linspace(0.0, 1.0, steps)[:, None] * np.array(end)


def test_plane_stress_is_zz_under_stress_control() -> None:
    """Elastic: sigma = E / (1 - nu^2) (e_x + nu e_y), zz strain -nu / (1 - nu) (e_x + e_y); three letters or four."""
    path = line([1e-3, 4e-4, 2e-4], 3)
    r = driven("elastic", {}, "eee", path)
    m = E / (1 - NU**2)
    np.testing.assert_allclose(
        r.stress[0, -1],
        [m * (1e-3 + NU * 4e-4), m * (4e-4 + NU * 1e-3), 0, E / (1 + NU) * 2e-4],
        rtol=1e-8,
        atol=1e-3,
    )
    assert r.strain[0, -1, 2] == pytest.approx(-NU / (1 - NU) * 1.4e-3, rel=1e-8)
    four = driven("elastic", {}, "eese", np.insert(path, 2, 0.0, axis=1))
    assert (four.stress == r.stress).all()
    with pytest.raises(ValueError, match="control"):
        follow("elastic", pack("elastic", ELASTIC), "eeee", path)


METAL = {"hardening": "linear", "initial_yield": 20e6, "hardening_modulus": 1e9}


@pytest.mark.parametrize("law", ["j2", "energy-damage", "erve"])
def test_von_mises_ellipse_in_plane_stress(law: str) -> None:
    """Proportional biaxial straining to large strains: sx^2 - sx sy + sy^2 = sigma_y(p)^2, and 0 on zz."""
    values = METAL
    if law == "energy-damage":
        values = {**METAL, "damage_threshold": 1e12}
    if law == "erve":
        values = {"damage_threshold": 1e12, "hardening": [[0.0, 20e6], [1.0, 1020e6]]}
    for ratio in (1.0, 0.3, -0.5, -1.0):
        r = driven(law, values, "eee", line([0.02, 0.02 * ratio, 0.0]))
        sx, sy, sz, _ = r.stress[0, -1]
        p = r.state[0, -1, 0]
        assert p > 0.01 and abs(sz) < 1.0
        assert math.sqrt(sx * sx - sx * sy + sy * sy) == pytest.approx(20e6 + 1e9 * p, rel=1e-8)
    # equal biaxial: e = (1 - nu) s / E + p / 2 with s = sigma_y
    r = driven(law, values, "eee", line([0.02, 0.02, 0.0]))
    s, p = r.stress[0, -1, 0], r.state[0, -1, 0]
    assert (1 - NU) * s / E + p / 2 == pytest.approx(0.02, rel=1e-8)


def test_mohr_coulomb_in_plane_stress_is_its_hexagon() -> None:
    """Biaxial compression with the smallest at 0: s = -2 c cos(phi) / (1 - sin(phi)); cut-off in tension."""
    phi, c, t = 0.6, 2e6, 1e6
    values = {"friction_angle": phi, "dilation_angle": 0.1, "cohesion": c, "tensile_strength": t}
    strength = 2 * c * math.cos(phi) / (1 - math.sin(phi))
    uniaxial = driven("mohr-coulomb", values, "ese", line([-0.01, 0.0, 0.0]))
    biaxial = driven("mohr-coulomb", values, "eee", line([-0.01, -0.01, 0.0]))
    pulled = driven("mohr-coulomb", values, "eee", line([0.01, 0.005, 0.0]))
    assert uniaxial.stress[0, -1, 0] == pytest.approx(-strength, rel=1e-8)
    np.testing.assert_allclose(biaxial.stress[0, -1, :2], -strength, rtol=1e-8)
    np.testing.assert_allclose(pulled.stress[0, -1, :2], t, rtol=1e-8)


def test_drucker_prager_in_plane_stress() -> None:
    """q = p tan(b) + d, d = (1 - tan(b) / 3) s_c, K = 1: uniaxial compression s_c; equal biaxial d / (1 - 2/3 tan b);
    uniaxial tension d / (1 + tan(b) / 3)."""
    tan_b, s_c = 1.2, 5e6
    values = {"friction_angle": math.atan(tan_b), "dilation_angle": 0.3, "hardening": "linear"}
    values |= {"initial_yield": s_c, "hardening_modulus": 0.0}
    d = (1 - tan_b / 3) * s_c
    for end, word, exact in (
        ([-0.01, 0.0, 0.0], "ese", -s_c),
        ([-0.02, -0.02, 0.0], "eee", -d / (1 - 2 * tan_b / 3)),
        ([0.005, 0.0, 0.0], "ese", d / (1 + tan_b / 3)),
    ):
        r = driven("drucker-prager", values, word, line(end))
        assert r.stress[0, -1, 0] == pytest.approx(exact, rel=1e-7)
        assert abs(r.stress[0, -1, 2]) < 1.0


def test_lubliner_in_plane_stress_yields_where_its_biaxial_ratio_says() -> None:
    values = {"dilation_angle": 0.4, "initial_yield": 10e6, "peak_yield": 20e6, "strain_at_peak": 2e-3}
    values |= {"tensile_yield": 1e6, "tensile_decay": 500.0, "biaxial_ratio": 1.16}
    both = follow("lubliner", pack("lubliner", {**ELASTIC, **values}), "sse", line([-13e6, -13e6, 0.0], 1301))
    first = int(np.argmax(both.state[0, :, 0] > 0.0))
    assert both.stress[0, first, 0] == pytest.approx(-11.6e6, rel=2e-3)


@pytest.mark.parametrize("word", ["sese", "sesees"])
def test_triaxial_compression_in_axisymmetry_and_in_space(word: str) -> None:
    """Cell pressure on xx and zz, strain along yy; the strengths of each law by its closed form."""
    cell, n = -3e6, len(word)
    start = np.zeros(n)
    start[:3] = cell
    path = np.tile(start, (201, 1))
    path[:, 1] = np.linspace(0.0, -0.05, 201)
    path[:, 3:] = 0.0
    phi, c = 0.6, 2e6
    rise = (1 + math.sin(phi)) / (1 - math.sin(phi))
    tan_b, s_c = 1.2, 5e6
    drucker = {"friction_angle": math.atan(tan_b), "dilation_angle": 0.3, "hardening": "linear"}
    drucker |= {"initial_yield": s_c, "hardening_modulus": 0.0, "flow_stress_ratio": 0.8}
    mohr = {"friction_angle": phi, "dilation_angle": 0.1, "cohesion": c, "tensile_strength": 0.0}
    flat = {**METAL, "hardening_modulus": 0.0}
    strengths = {
        "mohr-coulomb": (mohr, rise * cell - 2 * c * math.sqrt(rise)),
        "drucker-prager": (drucker, cell + (tan_b * cell - (1 - tan_b / 3) * s_c) / (1 - tan_b / 3)),
        "j2": (flat, cell - 20e6),
        "energy-damage": ({**flat, "damage_threshold": 1e12}, cell - 20e6),
        "erve": ({"damage_threshold": 1e12, "hardening": [[0.0, 20e6]]}, cell - 20e6),
    }
    for law, (values, exact) in strengths.items():
        if (
            law == "erve"
        ):  # keeps its effective stress in its state: start from nothing, raise the cell pressure first
            whole = np.concatenate([line(list(start * (np.arange(n) != 1)), 5)[:-1], path])
            whole[:5, 1] = cell * (1 - 2 * NU) / E * np.linspace(0, 1, 5)
            whole[5:, 1] += whole[4, 1]
            r = driven(law, values, word, whole)
        else:
            r = driven(law, values, word, path, start)
        assert r.stress[0, -1, 1] == pytest.approx(exact, rel=1e-7), law
        np.testing.assert_allclose(r.stress[0, -1, [0, 2]], cell, rtol=1e-6)
        if n == 6:
            np.testing.assert_allclose(r.stress[0, -1, 3:], 0.0, atol=1.0)
