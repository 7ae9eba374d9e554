"""Linear isotropic elasticity: sigma = lambda tr(eps) I + 2 mu eps."""

from __future__ import annotations

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.law import NOT_FINITE, OK, Law


@kernel(error_model="numpy")
def moduli(young, poisson):
    """Bulk modulus and shear modulus in Pa from Young's modulus and Poisson's ratio."""
    return young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))


@kernel(error_model="numpy")
def add_elastic(deps, factor, bulk, shear, sig):
    """sig += factor C : deps for the isotropic C; deps (n,) with engineering shears, n is 4 or 6. In place."""
    lame = bulk - 2.0 * shear / 3.0
    spread = factor * lame * (deps[0] + deps[1] + deps[2])
    for i in range(3):
        sig[i] += spread + factor * 2.0 * shear * deps[i]
    for i in range(3, sig.shape[0]):
        sig[i] += factor * shear * deps[i]


@kernel(error_model="numpy")
def fill_elastic(factor, bulk, shear, tangent):
    """tangent = factor C (n, n). Does nothing when tangent has size 0."""
    n = tangent.shape[0]
    if n == 0:
        return
    lame = factor * (bulk - 2.0 * shear / 3.0)
    tangent[:, :] = 0.0
    for i in range(3):
        for j in range(3):
            tangent[i, j] = lame
        tangent[i, i] += factor * 2.0 * shear
    for i in range(3, n):
        tangent[i, i] = factor * shear


@kernel(error_model="numpy")
def finite(a):
    """True when no entry of the (n,) array is nan, inf or too large to square."""
    total = 0.0
    for i in range(a.shape[0]):
        total += abs(a[i])
    return total < 1e140


@kernel(error_model="numpy")
def update_elastic(deps, sig, state, par, length, tangent):
    """The law `elastic`; arguments and return code as in `laws.update`."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    bulk, shear = moduli(par[0], par[1])
    add_elastic(deps, 1.0, bulk, shear, sig)
    fill_elastic(1.0, bulk, shear, tangent)
    return OK


ELASTIC = Law(
    id=0,
    name="elastic",
    title="linear isotropic elasticity",
    parameters=PARAMETERS["elastic"],
    state_names=("equivalent_plastic_strain", "damage"),
    initial_state=lambda par: np.zeros(2),
)
