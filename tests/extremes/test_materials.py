"""Edges and apex of every yield surface under triaxial compression, extension, plane strain and all-round tension.

What happens between them, over decades of stiffness and in random histories, is in tests/mechanics/materials.
"""

import math

import numpy as np
import pytest

from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.point import follow

E, NU = 10e9, 0.25
SOFT = {"young_modulus": E, "poisson_ratio": NU}
PHI, C = math.radians(35), 1e6
N = math.tan(math.pi / 4 + PHI / 2) ** 2
MC = {**SOFT, "friction_angle": PHI, "cohesion": C, "dilation_angle": math.radians(10), "tensile_strength": 1e9}
TRESCA = {**SOFT, "friction_angle": 0.0, "cohesion": C, "dilation_angle": 0.0, "tensile_strength": 1e9}
J2 = {**SOFT, "hardening": [[0.0, 2 * C]]}
BETA, D = math.radians(50), 2e6
DP = {
    **SOFT, "friction_angle": BETA, "dilation_angle": BETA, "flow_stress_ratio": 1.0, "initial_yield": 2e6,
    "hardening_gain": 0.0, "hardening_rate": 1.0,
}  # fmt: skip


TB = math.tan(BETA)
COHESION = (1 - TB / 3) * D  # d of F = t - p tan(beta) - d, from the yield stress of uniaxial compression
# The Mohr-Coulomb surface that an associated Drucker-Prager one touches in plane strain.
SINE = TB / math.sqrt(3 - TB**2 / 3)
TOUCHING = COHESION * math.sqrt(1 + SINE**2 / 3) / math.sqrt(3 * (1 - SINE**2))
N_TOUCHING = (1 + SINE) / (1 - SINE)
CELL = 10e6
LAWS_OF = {
    "mohr-coulomb": ("mohr-coulomb", MC), "tresca": ("mohr-coulomb", TRESCA), "j2": ("j2", J2),
    "drucker-prager": ("drucker-prager", DP),
}  # fmt: skip


def axial(name, word, strain, cell=CELL, rows=201):
    """Pressure along y at the end of a path from an all-round pressure; "s" in the word keeps a stress."""
    law, values = LAWS_OF[name]
    path = np.zeros((rows, 4))
    path[:, [k for k in range(3) if word[k] == "s"]] = -cell
    path[:, 1] = np.linspace(0.0, strain, rows)
    start = np.array([-cell, -cell, -cell, 0.0])
    r = follow(law, pack(law, values), word, path, stress=start)
    assert r.complete.all() and np.isfinite(r.stress).all()
    return -r.stress[0, -1, 1]


@pytest.mark.parametrize(("name", "expected"), [
    ("mohr-coulomb", N * CELL + 2 * C * math.sqrt(N)),
    ("tresca", CELL + 2 * C),
    ("j2", CELL + 2 * C),
    ("drucker-prager", CELL + (CELL * TB + COHESION) / (1 - TB / 3)),
])  # fmt: skip
def test_triaxial_compression_ends_on_the_edge_of_two_equal_least_pressures(name, expected):
    assert axial(name, "sese", -0.05) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("name", "expected"), [
    ("mohr-coulomb", (CELL - 2 * C * math.sqrt(N)) / N),
    ("tresca", CELL - 2 * C),
    ("j2", CELL - 2 * C),
    ("drucker-prager", CELL - (CELL * TB + COHESION) / (1 + TB / 3)),
])  # fmt: skip
def test_triaxial_extension_ends_on_the_other_edge(name, expected):
    assert axial(name, "sese", 0.05) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("name", "expected"), [
    ("mohr-coulomb", N * CELL + 2 * C * math.sqrt(N)),
    ("tresca", CELL + 2 * C),
    ("j2", CELL + 2 * C * 2 / math.sqrt(3)),
    ("drucker-prager", N_TOUCHING * CELL + 2 * TOUCHING * math.sqrt(N_TOUCHING)),
])  # fmt: skip
def test_plane_strain_compression(name, expected):
    """Where the stress out of the plane no longer changes; Drucker-Prager flows along its normal."""
    assert axial(name, "seee", -0.05) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(("law", "values", "expected"), [
    ("mohr-coulomb", MC, C / math.tan(PHI)),
    ("mohr-coulomb", {**MC, "tensile_strength": 0.7e6}, 0.7e6),
    ("mohr-coulomb", {**MC, "cohesion": 0.0}, 0.0),
    ("drucker-prager", DP, COHESION / TB),
    ("drucker-prager", {**DP, "initial_yield": 0.0}, 0.0),
    ("j2", J2, E * 0.01 / (1 - 2 * NU)),
    ("mohr-coulomb", {**TRESCA, "tensile_strength": 0.7e6}, 0.7e6),
])  # fmt: skip
def test_all_round_tension_ends_at_the_apex(law, values, expected):
    """c / tan(phi), d / tan(beta), or the cut-off; a cylinder has no apex and stays elastic: 3 K e."""
    path = np.zeros((11, 4))
    path[:, :3] = np.linspace(0.0, 0.01, 11)[:, None]
    r = follow(law, pack(law, values), "eeee", path)
    assert r.complete.all()
    np.testing.assert_allclose(r.stress[0, -1, :3], expected, rtol=1e-9, atol=1e-3)
    # And back: from the apex into pressure, elastic in volume.
    back = np.zeros((12, 4))
    back[:11], back[11, :3] = path, 0.01 - 1e-3
    again = follow(law, pack(law, values), "eeee", back)
    drop = E * 1e-3 / (1 - 2 * NU)
    np.testing.assert_allclose(again.stress[0, -1, :3], expected - drop, rtol=1e-9, atol=1e-2)
