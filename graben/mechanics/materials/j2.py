"""J2 (von Mises) plasticity with isotropic hardening: a table, a line or an exponential (`j2_hardening`).

The return is radial: the increment dp of the equivalent plastic strain solves ``q_trial - 3 G dp = sigma_y(p + dp)``,
in closed form along a table or a line.

Slots of ``par``: E [Pa], nu, then those of `j2_hardening`. State: equivalent plastic strain p.
"""

from __future__ import annotations

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import finite
from graben.mechanics.materials.j2_hardening import hardening_faults, return_to_strength
from graben.mechanics.materials.law import NOT_FINITE, OK, Law

STRENGTH = 2  # where the slots of the hardening start in par


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
    dp, slope, strength = return_to_strength(q, state[0], 3.0 * shear, par, STRENGTH, 1.0)
    theta = 1.0
    if dp > 0.0:
        theta = strength / q
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


J2 = Law(
    id=1,
    name="j2",
    title="von Mises plasticity with isotropic hardening",
    parameters=PARAMETERS["j2"],
    state_names=("equivalent_plastic_strain",),
    initial_state=lambda par: np.zeros(1),
    check=hardening_faults,
)
