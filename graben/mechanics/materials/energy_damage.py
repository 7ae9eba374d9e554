"""J2 plasticity with damage that an energy threshold limits: the local part of Model I of H.

Free energy f Psi_0 + w, H (6.22)-(6.23), with f = exp(-d) and without the gradient term H (6.24): beta = 0. The law
keeps D = 1 - f, so that the nominal stress is (1 - D) times the effective one. Damage obeys f Psi <= r_d, H (6.64)
without its Laplacian (the printed H (6.55) has slips of sign), whose update H (6.77) has then the closed solution
f = min(f, r_d / Psi). Under rising strain the stress falls as soon as Psi reaches r_d: without a gradient or
a body that regularizes, the width of a band is that of the elements. `length` does not enter.

`split` says which energy Psi drives:
  tension  that of the positive principal elastic strains, H (6.56)-(6.57): 1/2 e+ : C : e+
  none     all of Psi_0
As in H, f weakens the whole stiffness in both cases. Under compression with the split, damage starts only by the
strains to the sides, as in the model of Mazars to which H refers.

Plasticity acts on the nominal stress, with a radial return at the f of the last increment, then damage at fixed
plastic strain; so H orders it (H takes an explicit step, here it is implicit). H's yield condition reads
|dev s| <= r_p + K_H alpha_p (its Table 6.1 has the other sign) in Frobenius norms; with von Mises stress and
equivalent plastic strain that is linear hardening with initial_yield = sqrt(3/2) r_p and hardening_modulus = 3/2 K_H.

Slots of ``par``: E [Pa], nu, r_d [Pa], split, largest D, then those of `j2_hardening`.
State: equivalent plastic strain, D.
"""

from __future__ import annotations

import math

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import add_elastic, finite, moduli
from graben.mechanics.materials.j2 import fill_tangent
from graben.mechanics.materials.j2_hardening import hardening_faults, return_to_strength
from graben.mechanics.materials.law import NOT_FINITE, OK, Law
from graben.mechanics.tensors.principal import (
    back_plane_stress,
    back_space_stress,
    split_plane,
    split_space,
)

_THRESHOLD, _SPLIT, _LARGEST, _STRENGTH = 2, 3, 4, 5


@kernel(error_model="numpy")
def driving_energy(stress, split, young, nu, slope):
    """Psi [Pa] of an effective stress (n,), and into slope (n,) C^-1 : dPsi/d(strain), with tensor shears.

    split 1: of the positive principal strains only.
    """
    n = stress.shape[0]
    vectors = np.empty((3, 3))
    c, s, rank = 1.0, 0.0, 0
    if n == 4:
        s1, s2, s3, c, s, rank = split_plane(stress[0], stress[1], stress[2], stress[3])
    else:
        s1, s2, s3 = split_space(stress, vectors)
    trace = s1 + s2 + s3
    e1 = ((1.0 + nu) * s1 - nu * trace) / young
    e2 = ((1.0 + nu) * s2 - nu * trace) / young
    e3 = ((1.0 + nu) * s3 - nu * trace) / young
    if split == 0:
        energy = 0.5 * (s1 * e1 + s2 * e2 + s3 * e3)
        g1, g2, g3 = s1, s2, s3
    else:
        bulk, shear = moduli(young, nu)
        lame = bulk - 2.0 * shear / 3.0
        p1, p2, p3 = max(e1, 0.0), max(e2, 0.0), max(e3, 0.0)
        total = p1 + p2 + p3
        energy = 0.5 * lame * total * total + shear * (p1 * p1 + p2 * p2 + p3 * p3)
        g1 = lame * total + 2.0 * shear * p1 if e1 > 0.0 else 0.0
        g2 = lame * total + 2.0 * shear * p2 if e2 > 0.0 else 0.0
        g3 = lame * total + 2.0 * shear * p3 if e3 > 0.0 else 0.0
    trace = g1 + g2 + g3
    g1 = ((1.0 + nu) * g1 - nu * trace) / young
    g2 = ((1.0 + nu) * g2 - nu * trace) / young
    g3 = ((1.0 + nu) * g3 - nu * trace) / young
    if n == 4:
        back_plane_stress(g1, g2, g3, c, s, rank, slope)
    else:
        back_space_stress(g1, g2, g3, vectors, slope)
    return energy


@kernel(error_model="numpy")
def update_energy_damage(deps, sig, state, par, length, tangent):
    """The law `energy-damage`; arguments and return code as in `laws.update`. sig is the nominal stress."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    n = deps.shape[0]
    young, nu = par[0], par[1]
    bulk, shear = moduli(young, nu)
    keep = 1.0 - state[1]
    eff, trial, slopes = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        eff[i] = sig[i] / keep
    add_elastic(deps, 1.0, bulk, shear, eff)
    if not finite(eff):
        return NOT_FINITE
    mean = (eff[0] + eff[1] + eff[2]) / 3.0
    square = 0.0
    for i in range(n):
        trial[i] = eff[i] - mean if i < 3 else eff[i]
        square += trial[i] * trial[i] * (1.0 if i < 3 else 2.0)
    q = math.sqrt(1.5 * square)
    dp, slope, strength = return_to_strength(q, state[0], 3.0 * shear, par, _STRENGTH, 1.0 / keep)
    theta, bar = 1.0, 0.0
    if dp > 0.0:
        theta = strength / q
        bar = 1.0 / (1.0 + slope / (3.0 * shear)) - (1.0 - theta)
        for i in range(n):
            eff[i] = theta * trial[i] + (mean if i < 3 else 0.0)
    energy = driving_energy(eff, int(par[_SPLIT]), young, nu, slopes)
    fall = 0.0  # -df/dPsi
    after = keep
    if keep * energy > par[_THRESHOLD]:
        after = min(keep, par[_THRESHOLD] / energy)
        fall = after / energy
        if after < 1.0 - par[_LARGEST]:
            after = min(keep, 1.0 - par[_LARGEST])
            fall = 0.0
    state[0] += dp
    state[1] = 1.0 - after
    for i in range(n):
        sig[i] = after * eff[i]
    if tangent.shape[0] > 0:
        fill_tangent(tangent, n, bulk, shear, theta, bar, trial, math.sqrt(square))
        for j in range(n):
            rate = 0.0
            if fall > 0.0:
                for i in range(n):
                    rate += slopes[i] * tangent[i, j] * (1.0 if i < 3 else 2.0)
            for i in range(n):
                tangent[i, j] = after * tangent[i, j] - fall * rate * eff[i]
    return OK


ENERGY_DAMAGE = Law(
    id=7,
    name="energy-damage",
    title="J2 plasticity with damage by an energy threshold, f = exp(-d)",
    parameters=PARAMETERS["energy-damage"],
    state_names=("equivalent_plastic_strain", "damage"),
    initial_state=lambda par: np.zeros(2),
    check=hardening_faults,
)
