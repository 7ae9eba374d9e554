"""Errors against what a fit really misses: several laws, stresses from Pa to GPa; data exact, printed, with noise."""

import math

import numpy as np
import pytest

from graben.mechanics.fitting.curves import Curve, CurveFit, Weights
from graben.mechanics.fitting.first_state import settle
from graben.mechanics.fitting.identifiability import identify
from graben.mechanics.fitting.objective import Objective, Priors
from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.point import follow
from graben.mechanics.optimise.levenberg_marquardt import levenberg_marquardt
from graben.mechanics.optimise.space import Box

SAND = {"young_modulus": 60e6, "poisson_ratio": 0.31, "friction_angle": math.radians(34)}
SAND |= {"dilation_angle": math.radians(9), "cohesion": 5e3}
CONE = {"young_modulus": 60e6, "poisson_ratio": 0.31, "friction_angle": 0.9, "dilation_angle": 0.4}
CONE |= {"initial_yield": 1e4, "hardening_gain": 2e5, "hardening_rate": 200.0}
LAWS = {
    "elastic": ({"young_modulus": 60e6, "poisson_ratio": 0.31}, ["young_modulus", "poisson_ratio"]),
    "mohr-coulomb": (SAND, ["young_modulus", "poisson_ratio", "friction_angle", "dilation_angle"]),
    "drucker-prager": (CONE, ["young_modulus", "friction_angle", "hardening_gain"]),
}
STRESSES = ("young_modulus", "cohesion", "initial_yield", "hardening_gain")


def curve(law, values, cell, data, rng):
    """A triaxial test at `cell` (Pa), as exact, as printed with four digits, or with 1 % of noise."""
    path = np.zeros((41, 4))
    path[:, [0, 2]], path[:, 1] = -cell, -np.linspace(0, 0.04, 41)
    start = np.array([-cell, -cell, -cell, 0.0])
    r = follow(law, pack(law, values), "sese", path, stress=start, parts=2)
    stress, strain = r.stress[0].copy(), r.strain[0].copy()
    for table, column in ((stress, 1), (strain, 0)):
        if data == "printed":
            table[:, column] = [float(f"{v:.3e}") for v in table[:, column]]
        elif data == "noisy":
            table[1:, column] += 0.01 * np.abs(table[:, column]).max() * rng.normal(size=40)
    return Curve(f"{cell:g}", stress, strain, control="sese", seat="ssse")


def fit(law, data, unit, strain=1.0):
    values, free = LAWS[law]
    values = {n: v * unit if n in STRESSES else v for n, v in values.items()}
    rng = np.random.default_rng(3)
    curves = [curve(law, values, cell * unit, data, rng) for cell in (5e4, 2e5)]
    truth = np.array([values[n] for n in free])
    box = Box.of(free, 0.6 * truth, 1.4 * truth, [n in STRESSES for n in free])
    fixed = {n: v for n, v in values.items() if n not in free}
    curve_fit = CurveFit(law, fixed, free, curves, Weights(last=1.0, strain=strain))
    objective = Objective(curve_fit, box, Priors.none())
    start = np.clip(box.to_unit(truth) + 0.1, 0.02, 0.98)
    settled = settle(objective, levenberg_marquardt(objective, start, max_iterations=60))
    best = settled.best
    known = identify(
        best.x, best.residuals, best.jacobian, groups=curve_fit.groups, lag=3, beside=settled.beside,
        noise=settled.noise, floor=curve_fit.floor,
    )  # fmt: skip
    return np.abs(best.x - box.to_unit(truth)), known


@pytest.mark.parametrize("law", sorted(LAWS))
@pytest.mark.parametrize("data", ["exact", "printed", "noisy"])
@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e4])
def test_errors_hold_what_the_fit_misses(law, data, unit):
    missed, known = fit(law, data, unit)
    assert known.identifiable.all() and not known.doubtful.any()
    assert (missed <= 4.0 * known.robust_error).all()
    assert (known.robust_error < {"exact": 1e-4, "printed": 1e-2, "noisy": 0.2}[data]).all()


@pytest.mark.parametrize("data", ["exact", "printed", "noisy"])
def test_without_lateral_strain_the_contraction_is_not_in_the_data(data):
    """At a given lateral stress Mohr-Coulomb's axial stress knows neither Poisson's ratio nor dilation."""
    missed, known = fit("mohr-coulomb", data, 1.0, strain=0.0)
    assert known.identifiable.tolist() == [True, False, True, False] and not known.doubtful.any()
    assert (missed[[0, 2]] <= 4.0 * known.robust_error[[0, 2]]).all()
    assert (known.robust_error[[1, 3]] > 0.28).all()
