"""J2 (von Mises) plasticity with isotropic hardening from a table, radial return in closed form.

Strength follows sigma_y(p), piecewise linear in the equivalent plastic strain p; beyond the last pair it stays
constant. The return is exact: the segment of the solution is found by walking the table, and the increment
solves ``q_trial - 3 G dp = sigma_y(p + dp)`` there, without iteration.

Slots of ``par``: E [Pa], nu, count, then `count` pairs (p, sigma_y [Pa]); the first p is 0.
State: equivalent plastic strain p.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import POISSON, YOUNG, finite
from graben.mechanics.materials.law import NOT_FINITE, OK, Law, Parameter

TABLE = 2  # where the hardening table starts in par: count, then pairs


@kernel(error_model="numpy")
def yield_stress(p, par, start):
    """Yield stress [Pa] at equivalent plastic strain p by the table at par[start:]."""
    count = int(par[start])
    i = start + 1
    for k in range(count - 1):
        right = par[i + 2 * (k + 1)]
        if p <= right:
            left, low = par[i + 2 * k], par[i + 2 * k + 1]
            return low + (par[i + 2 * (k + 1) + 1] - low) * (p - left) / (right - left)
    return par[i + 2 * (count - 1) + 1]


@kernel(error_model="numpy")
def return_to_table(q_trial, p, three_g, par, start, scale):
    """Increment dp >= 0 that solves ``q_trial - three_g dp = scale * sigma_y(p + dp)``, and the slope there.

    Returns (dp, hardening): hardening is ``scale * d sigma_y / dp`` [Pa] on the segment of the solution.
    (0, 0) if ``q_trial`` lies inside the yield surface. The table must not soften.
    """
    now = scale * yield_stress(p, par, start)
    if q_trial <= now:
        return 0.0, 0.0
    count = int(par[start])
    i = start + 1
    left, low = p, now
    for k in range(1, count):
        right = par[i + 2 * k]
        if right <= p:
            continue
        high = scale * par[i + 2 * k + 1]
        if q_trial - three_g * (right - p) <= high:
            slope = (high - low) / (right - left)
            return (q_trial - low + three_g * p + slope * left) / (three_g + slope) - p, slope
        left, low = right, high
    return (q_trial - low) / three_g, 0.0


@kernel(error_model="numpy")
def fill_tangent(tangent, n, bulk, shear, theta, theta_bar, s, norm):
    """Consistent tangent ``K 1(x)1 + 2 G theta I_dev - 2 G theta_bar n(x)n`` for engineering shear strains.

    s (n,) is the deviator of the trial stress and norm its Frobenius norm.
    """
    for i in range(n):
        for j in range(n):
            value = 0.0
            if norm > 0.0:
                value = -2.0 * shear * theta_bar * s[i] * s[j] / (norm * norm)
            if i < 3 and j < 3:
                value += bulk - 2.0 * shear * theta / 3.0
            if i == j:
                value += 2.0 * shear * theta if i < 3 else shear * theta
            tangent[i, j] = value


@kernel(error_model="numpy")
def update_j2(deps, sig, state, par, length, tangent):
    """The law `j2`; arguments and return code as in `laws.update`. deps (n,), n = 4 or 6, engineering shears."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    n = deps.shape[0]
    young, nu = par[0], par[1]
    shear = young / (2.0 * (1.0 + nu))
    bulk = young / (3.0 * (1.0 - 2.0 * nu))
    volumetric = deps[0] + deps[1] + deps[2]
    mean_old = (sig[0] + sig[1] + sig[2]) / 3.0
    mean = mean_old + bulk * volumetric
    square = 0.0
    for i in range(3):
        s = sig[i] - mean_old + 2.0 * shear * (deps[i] - volumetric / 3.0)
        sig[i] = s
        square += s * s
    for i in range(3, n):
        s = sig[i] + shear * deps[i]
        sig[i] = s
        square += 2.0 * s * s
    q = np.sqrt(1.5 * square)
    dp, slope = return_to_table(q, state[0], 3.0 * shear, par, TABLE, 1.0)
    theta = 1.0
    if dp > 0.0:
        theta = 1.0 - 3.0 * shear * dp / q
        state[0] += dp
    if tangent.shape[0] > 0:
        bar = 0.0
        if dp > 0.0:
            bar = 1.0 / (1.0 + slope / (3.0 * shear)) - (1.0 - theta)
        fill_tangent(tangent, n, bulk, shear, theta, bar, sig, np.sqrt(square))
    for i in range(3):
        sig[i] = theta * sig[i] + mean
    for i in range(3, n):
        sig[i] *= theta
    return OK


def hardening_faults(values: Mapping[str, Any]) -> list[str]:
    """What is wrong with a hardening table beyond its shape; empty when it can be used."""
    rows = np.asarray(values["hardening"], dtype=np.float64)
    found = []
    if rows[0, 0] != 0.0:
        found.append("hardening: the first plastic strain must be 0")
    if np.any(rows[:, 1] <= 0.0):
        found.append("hardening: yield stresses must be positive")
    if np.any(np.diff(rows[:, 1]) < 0.0):
        found.append("hardening: yield stresses must not fall (softening belongs to damage)")
    return found


HARDENING = Parameter(
    "hardening",
    "Pa",
    description="table of (equivalent plastic strain, yield stress in Pa), linear between, constant beyond",
    table=True,
)

J2 = Law(
    id=1,
    name="j2",
    title="von Mises plasticity with a hardening table",
    parameters=(YOUNG, POISSON, HARDENING),
    state_names=("equivalent_plastic_strain",),
    initial_state=lambda par: np.zeros(1),
    check=hardening_faults,
)
