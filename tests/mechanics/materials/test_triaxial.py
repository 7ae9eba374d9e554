"""Triaxial tests of isotropic laws: both lateral strains alike, and Mohr-Coulomb's closed forms on its edges."""

import math

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, isotropic, pack
from graben.mechanics.materials.point import follow

E, NU = 9e9, 0.23
SOFT = {"young_modulus": E, "poisson_ratio": NU}
ROCK = {**SOFT, "friction_angle": math.radians(33), "dilation_angle": math.radians(11)}
ROCK |= {"cohesion": 2e6, "tensile_strength": 0.7e6}
TRESCA = {**SOFT, "friction_angle": 0.0, "cohesion": 3e6, "tensile_strength": 50e6}
VALUES = {
    "elastic": SOFT,
    "j2": {**SOFT, "hardening": "linear", "initial_yield": 6e6, "hardening_modulus": 1e8},
    "mohr-coulomb": ROCK,
    "drucker-prager": {
        **SOFT, "friction_angle": 0.6, "dilation_angle": 0.3, "initial_yield": 6e6, "hardening_gain": 4e6,
        "hardening_rate": 500.0,
    },
    "erve": {**SOFT, "hardening": [[0.0, 6e6], [0.1, 9e6]], "damage_threshold": 1e3, "subdomains": 5},
    "energy-damage": {**SOFT, "hardening": [[0.0, 6e6], [0.1, 9e6]], "damage_threshold": 1e3},
    "lubliner": {
        **SOFT, "dilation_angle": 0.3, "initial_yield": 6e6, "peak_yield": 12e6, "strain_at_peak": 2e-3,
        "tensile_yield": 1e6,
    },
}  # fmt: skip


def triaxial(law, values, axis, size, cell, strain, rows=31):
    """Stress and strain (rows, size) of a test along `axis` at the lateral stress `cell` (tension positive)."""
    sides = [k for k in range(3) if k != axis]
    word = "".join("e" if k == axis or k > 2 else "s" for k in range(size))
    path = np.zeros((rows, size))
    path[:, sides] = cell
    path[:, axis] = np.linspace(0, strain, rows)
    start = np.zeros(size)
    start[:3] = cell
    r = follow(law, pack(law, values), word, path, stress=start)
    assert r.complete.all()
    return r.stress[0], r.strain[0], sides


def plastic(stress, strain, cell):
    """Plastic normal strains (rows, 3) after an all-round stress."""
    change = stress[:, :3] - cell
    return strain[:, :3] - ((1 + NU) * change - NU * change.sum(axis=1, keepdims=True)) / E


@pytest.mark.parametrize("size", [4, 6])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("values", [ROCK, TRESCA, {**ROCK, "dilation_angle": 0.0}], ids=["rock", "tresca", "psi0"])
@pytest.mark.parametrize(("cell", "strain"), [(-3e6, -0.01), (-0.4e6, -0.01), (-11e6, 0.01)])
def test_mohr_coulomb_flows_to_both_sides_alike(size, axis, values, cell, strain):
    stress, total, sides = triaxial("mohr-coulomb", values, axis, size, cell, strain)
    sine, flow = math.sin(values["friction_angle"]), math.sin(values.get("dilation_angle", 0.0))
    term = 2 * values["cohesion"] * math.cos(values["friction_angle"])
    if strain < 0:
        end, ratio = (cell * (1 + sine) - term) / (1 - sine), -(1 + flow) / (2 * (1 - flow))
    else:
        end, ratio = (cell * (1 - sine) + term) / (1 + sine), -(1 - flow) / (2 * (1 + flow))
    assert stress[-1, axis] == pytest.approx(end, rel=1e-8)
    p = plastic(stress, total, cell)
    assert abs(p[-1, axis]) > 0.5 * abs(strain)
    np.testing.assert_allclose(p[:, sides], np.repeat(ratio * p[:, [axis]], 2, axis=1), atol=1e-9)
    np.testing.assert_array_equal(total[:, sides[0]], total[:, sides[1]])


def test_the_cut_off_in_extension_leaves_the_sides_elastic():
    stress, total, sides = triaxial("mohr-coulomb", ROCK, 1, 4, -0.5e6, 2e-3)
    assert stress[-1, 1] == pytest.approx(0.7e6, rel=1e-9)
    p = plastic(stress, total, -0.5e6)
    assert p[-1, 1] > 1e-3
    np.testing.assert_allclose(p[:, sides], 0.0, atol=1e-10)


def test_all_axes_under_one_stress_share_one_strain_up_to_the_apex():
    path = np.zeros((12, 6))
    path[:, :3] = np.linspace(0, 1.1e6, 12)[:, None]
    r = follow("mohr-coulomb", pack("mohr-coulomb", ROCK), "ssseee", path)
    assert not r.complete[0] and r.reached[0] == pytest.approx(7, abs=0.01)  # 0.7 of steps of 0.1 MPa
    np.testing.assert_array_equal(r.strain[0, :, 0], r.strain[0, :, 1])
    np.testing.assert_array_equal(r.strain[0, :, 0], r.strain[0, :, 2])


def test_unequal_lateral_stresses_send_all_flow_to_the_weaker_side():
    """s2 takes no part in Mohr-Coulomb, whatever little separates it from s1: a jump, not a rounding."""
    flow = math.sin(ROCK["dilation_angle"])
    for apart in (1.0, 0.01):
        path = np.zeros((31, 4))
        path[:, 0], path[:, 2] = -3e6, -3e6 * (1 + apart)
        path[:, 1] = -np.linspace(0, 0.01, 31)
        start = np.array([-3e6, -3e6 * (1 + apart), -3e6 * (1 + apart), 0.0])
        r = follow("mohr-coulomb", pack("mohr-coulomb", ROCK), "sese", path, stress=start)
        p = plastic(r.stress[0], r.strain[0], start[:3])
        assert p[-1, 0] == pytest.approx(-p[-1, 1] * (1 + flow) / (1 - flow), rel=1e-6)
        assert abs(p[-1, 2]) < 1e-9


@pytest.mark.parametrize("law", sorted(VALUES))
@pytest.mark.parametrize(("cell", "strain"), [(-3e6, -4e-3), (0.0, -2e-3), (0.0, 1e-3), (-12e6, 3e-3)])
def test_isotropic_laws_keep_the_sides_alike_and_answer_as_under_these_strains(law, cell, strain):
    """The strains found, prescribed to the law in space, give the stresses found: what an element would see."""
    stress, total, sides = triaxial(law, VALUES[law], 1, 4, cell, strain)
    np.testing.assert_array_equal(total[:, sides[0]], total[:, sides[1]])
    path = np.zeros((len(total), 6))
    path[:, :3] = total[:, :3]
    start = np.array([cell, cell, cell, 0.0, 0.0, 0.0])
    again = follow(law, pack(law, VALUES[law]), "eeeeee", path, stress=start)
    # erve's damage grows by the increment, and the point halves one of them
    close = (1e-3 if law == "erve" else 1e-6) * np.abs(stress).max()
    np.testing.assert_allclose(again.stress[0, :, :3], stress[:, :3], atol=close)


@pytest.mark.parametrize("law", sorted(LAWS))
def test_only_the_law_with_an_axis_knows_a_direction(law):
    assert set(VALUES) | {"transverse-elastic"} == set(LAWS)
    assert isotropic(LAWS[law].id) == (law != "transverse-elastic")


@pytest.mark.parametrize(("angle", "alike"), [(0.0, False), (0.5 * math.pi, True)])
def test_a_law_with_an_axis_keeps_its_sides_apart_unless_loaded_along_it(angle, alike):
    values = {"young_modulus": E, "young_modulus_across": 4e9, "poisson_ratio": 0.2, "poisson_ratio_across": 0.1}
    values |= {"shear_modulus_across": 2e9, "axis_angle": angle}
    _stress, total, sides = triaxial("transverse-elastic", values, 1, 4, -1e6, -1e-3)
    assert (abs(total[-1, sides[0]] - total[-1, sides[1]]) < 1e-9) == alike
