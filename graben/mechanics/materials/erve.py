"""ERVE: J2 plasticity coupled with relaxed, rate-limited damage of an emulated representative volume (Model II).

A point stands for n subdomains of equal volume with damage d_i, f(d) = (1 - d)^2. Minimising over their strains
gives the harmonic mean ``f_bar = n / sum(1/f(d_i))``, H (6.87), and the relaxed energy ``f_bar Psi_0``, H (6.89).
Subdomain i is driven by ``p_i = -f_bar^2 f'(d_i) / (n f(d_i)^2) Psi_0``, H (6.94); if p_i exceeds r_d / n its
damage grows by the largest step allowed, H (6.95), here `max_step`. The loop is sequential: f_bar is refreshed
after each subdomain (H, algorithm 2), which is what breaks the symmetry between equal subdomains. Damage stops
at 0.999.

H (6.98), (6.103) limit the step by the work of the external forces: ``max_step = alpha * dW_ext``. The work
belongs to the body, not to the point, so the calling stage writes it into par[MAX_STEP] before each step (a
constant there is a rate limit per increment). H prints alpha in 1/(N mm) in one place and in 1/s in another.

The yield condition acts on the nominal stress, as in H: ``f_bar q_eff <= sigma_y(p)``, with the table of j2.
H's linear hardening r_p, K_H in terms of the Frobenius norm reads ``sigma_y = sqrt(3/2) r_p + 1.5 K_H p``.

The split says which part of the elastic energy drives damage and which stress it takes away:
  0 none: all (H).
  1 volumetric-deviatoric: pressure under compression neither drives nor is degraded.
  2 positive principal: only positive principal effective stresses drive and are degraded; the yield condition
    then acts on the effective stress.

Slots of ``par``: E [Pa], nu, r_d [Pa], n, max_step, split, then the hardening table (count, pairs).
State: p, damage ``1 - f_bar``, n values d_i, then the effective stress (6).
"""

from __future__ import annotations

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import finite
from graben.mechanics.materials.j2 import fill_tangent
from graben.mechanics.materials.j2_hardening import hardening_faults, return_to_table
from graben.mechanics.materials.law import NOT_FINITE, OK, Law
from graben.mechanics.tensors.principal import back_space_stress, split_space

MAX_STEP = 4
TABLE = 6
FULL = 0.999  # H, algorithm 2


@kernel(error_model="numpy")
def effective_factor(damage, n):
    """Harmonic mean f_bar of f(d_i) = (1 - d_i)^2 over the n subdomains, H (6.87)."""
    total = 0.0
    for i in range(n):
        f = (1.0 - damage[i]) ** 2
        total += 1.0 / f
    return n / total


@kernel(error_model="numpy")
def grow(damage, n, energy, threshold, step):
    """One damage step of the subdomains (in place), H algorithm 2. Returns the new f_bar."""
    total = 0.0
    for i in range(n):
        total += 1.0 / (1.0 - damage[i]) ** 2
    for i in range(n):
        bar = n / total
        one = 1.0 - damage[i]
        force = bar * bar * 2.0 * energy / (n * one * one * one)  # -f'/f^2 = 2/(1-d)^3
        if force > threshold / n and damage[i] < FULL:
            total -= 1.0 / (one * one)
            damage[i] = min(damage[i] + step, FULL)
            one = 1.0 - damage[i]
            total += 1.0 / (one * one)
    return effective_factor(damage, n)


@kernel(error_model="numpy")
def positive_part(stress, out):
    """Positive principal part of a stress (6,) into out (6,)."""
    vectors = np.empty((3, 3))
    s1, s2, s3 = split_space(stress, vectors)
    back_space_stress(max(s1, 0.0), max(s2, 0.0), max(s3, 0.0), vectors, out)


@kernel(error_model="numpy")
def elastic_energy(s, young, nu):
    """Energy density [Pa] of an elastic stress (6,): ((1 + nu) s:s - nu tr(s)^2) / (2 E)."""
    square = s[0] ** 2 + s[1] ** 2 + s[2] ** 2 + 2.0 * (s[3] ** 2 + s[4] ** 2 + s[5] ** 2)
    trace = s[0] + s[1] + s[2]
    return ((1.0 + nu) * square - nu * trace * trace) / (2.0 * young)


@kernel(error_model="numpy")
def update_erve(deps, sig, state, par, length, tangent):
    """The law `erve`; arguments and return code as in `laws.update`. sig is the nominal stress.

    The tangent is that of the plastic step times f_bar: damage grows by a fixed step or not at all, so its
    derivative is zero almost everywhere.
    """
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    n = deps.shape[0]
    young, nu, threshold, step = par[0], par[1], par[2], par[MAX_STEP]
    parts = int(par[3])
    split = int(par[5])
    shear = young / (2.0 * (1.0 + nu))
    bulk = young / (3.0 * (1.0 - 2.0 * nu))
    damage = state[2 : 2 + parts]
    eff = state[2 + parts : 8 + parts]
    bar = 1.0 - state[1]

    volumetric = deps[0] + deps[1] + deps[2]
    mean_old = (eff[0] + eff[1] + eff[2]) / 3.0
    mean = mean_old + bulk * volumetric
    trial = np.zeros(6)
    square = 0.0
    for i in range(3):
        trial[i] = eff[i] - mean_old + 2.0 * shear * (deps[i] - volumetric / 3.0)
        square += trial[i] * trial[i]
    for i in range(3, n):
        trial[i] = eff[i] + shear * deps[i]
        square += 2.0 * trial[i] * trial[i]
    q = np.sqrt(1.5 * square)
    scale = 1.0 if split == 2 else 1.0 / bar
    dp, slope = return_to_table(q, state[0], 3.0 * shear, par, TABLE, scale)
    theta = 1.0
    if dp > 0.0:
        theta = 1.0 - 3.0 * shear * dp / q
        state[0] += dp
    for i in range(3):
        eff[i] = theta * trial[i] + mean
    for i in range(3, n):
        eff[i] = theta * trial[i]

    positive = np.zeros(6)
    if split == 2:
        positive_part(eff, positive)
        energy = elastic_energy(positive, young, nu)
    else:
        energy = elastic_energy(eff, young, nu)
        if split == 1 and mean < 0.0:
            energy -= mean * mean / (2.0 * bulk)
    if energy > 0.0 and step > 0.0:
        bar = grow(damage, parts, energy, threshold, step)
        state[1] = 1.0 - bar

    pressure_factor = bar
    if split == 1 and mean < 0.0:
        pressure_factor = 1.0
    for i in range(n):
        if split == 2:
            sig[i] = eff[i] - (1.0 - bar) * positive[i]
        elif i < 3:
            sig[i] = bar * (eff[i] - mean) + pressure_factor * mean
        else:
            sig[i] = bar * eff[i]
    if tangent.shape[0] > 0:
        spare = 0.0
        if dp > 0.0:
            spare = 1.0 / (1.0 + slope / (3.0 * shear)) - (1.0 - theta)
        fill_tangent(tangent, n, bulk, shear, theta, spare, trial, np.sqrt(square))
        for i in range(n):
            for j in range(n):
                tangent[i, j] *= bar
                if i < 3 and j < 3:
                    tangent[i, j] += (pressure_factor - bar) * bulk
    return OK


ERVE = Law(
    id=5,
    name="erve",
    title="J2 plasticity with relaxed, rate-limited damage (emulated representative volume element)",
    parameters=PARAMETERS["erve"],
    state_names=("equivalent_plastic_strain", "damage"),
    initial_state=lambda par: np.zeros(8 + int(par[3])),
    check=hardening_faults,
)
