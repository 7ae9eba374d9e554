"""Damage-plasticity of quasi-brittle materials: Lubliner's surface as extended by Lee and Fenves, Y 2.5.3,
2.7.2.

On the effective stress, with p = -tr/3, q von Mises and s the largest principal value:

    F = (q - 3 A p + B <s> - gamma <-s>) / (1 - A) - c(kc)             Y (2.35)
    A = (f0 - 1) / (2 f0 - 1),  gamma = 3 (1 - Kc) / (2 Kc - 1),  B = c(kc) / t(kt) (1 - A) - (1 + A)
    G = sqrt((e s0 tan psi)^2 + q^2) - p tan psi                       Y (2.37)

c and t are the effective yield stresses, the curves of Y (2.40), (2.41) over 1 - Dc and 1 - Dt. (Y (2.41)
lacks the minus sign: tension decays as exp(-lambda x).) The two hardening variables follow the largest and
smallest plastic principal strain: dkt = r de_max, dkc = -(1 - r) de_min with r of Y (2.44); Y (2.39) scales
them by fracture energies instead, which curves given over strain do not need. Damage: 1 - D = (1 - st Dc)(1 -
sc Dt), Y (2.47), st = 1 - wt r, sc = 1 - wc (1 - r): with wc = 1 cracks that close carry compression again.

Flow dissipates, s : de_p = dlambda (q^2 / n - p tan psi) with n^2 = (e s0 tan psi)^2 + q^2, as long as psi is not
steeper than the flattest meridian of F under pressure, the tensile one: q >= p tan psi needs

    tan psi <= 3 (3 A + gamma) / (3 + 2 gamma).

Steeper ones are refused. What is left is the rounding of G's tip: where crushing or cracking has used up the
strength, s : de_p may fall to -0.301 e s0 tan psi dlambda, 0.301 being the largest of y / (m (m + y)), m^2 = 1 + y^2.

Return mapping: G does not depend on the Lode angle, so the deviator shrinks along itself and every quantity
at the end of the increment is an explicit function of one multiplier. F is solved for it inside a bracket,
which always exists because psi > 0. The tangent differentiates these explicit functions by differences, and
the solve implicitly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import finite, moduli
from graben.mechanics.materials.hardening import BARCELONA, barcelona_coefficients, harden
from graben.mechanics.materials.law import NOT_CONVERGED, NOT_FINITE, OK, Law
from graben.mechanics.materials.lubliner_curves import (
    compression_rate,
    cracking_strain,
    inelastic_strain,
    tension_rate,
)
from graben.mechanics.tensors.principal import (
    back_plane_stress,
    back_plane_tangent,
    back_space_stress,
    back_space_tangent,
    shear_modulus,
    split_plane,
    split_space,
)

_E, _NU, _PSI, _ECC, _KC, _F0, _S0, _PEAK, _EPEAK, _DC, _T0, _DECAY, _DT, _WT, _WC, _XC, _XT, _DMAX, _FORM = range(19)
_A, _GAMMA, _ALPHA, _BETA, _M, _N, _TAN = range(19, 26)


@kernel(error_model="numpy")
def steepest_dilation(kc, f0):
    """Largest psi with which flow under pressure dissipates: the slope of the tensile meridian, see above."""
    a, gamma = (f0 - 1.0) / (2.0 * f0 - 1.0), 3.0 * (1.0 - kc) / (2.0 * kc - 1.0)
    return max(math.atan(3.0 * (3.0 * a + gamma) / (3.0 + 2.0 * gamma)), 1e-3)  # the least psi that is computed


@kernel(error_model="numpy")
def prepare_lubliner(par):
    """Fill the derived slots: A and gamma, Y (2.74)-(2.75), Barcelona's alpha and beta, m and n, tan psi."""
    par[_A] = (par[_F0] - 1.0) / (2.0 * par[_F0] - 1.0)
    par[_GAMMA] = 3.0 * (1.0 - par[_KC]) / (2.0 * par[_KC] - 1.0)
    par[_PSI] = min(par[_PSI], steepest_dilation(par[_KC], par[_F0]))
    par[_PEAK] = max(par[_PEAK], par[_S0])
    par[_ALPHA], par[_BETA] = barcelona_coefficients(par[_S0], par[_PEAK], par[_EPEAK])
    par[_M] = compression_rate(
        par[_FORM], par[_DC], par[_E], par[_S0], par[_ALPHA], par[_BETA], par[_EPEAK], par[_XC]
    )
    par[_N] = tension_rate(par[_FORM], par[_DT], par[_E], par[_T0], par[_DECAY], par[_XT])
    par[_TAN] = math.tan(par[_PSI])


@kernel(error_model="numpy")
def _compression(plastic, par):
    """Effective yield stress and damage in compression at an equivalent plastic strain."""
    x = inelastic_strain(par[_FORM], plastic, par[_M], par[_E], par[_S0], par[_ALPHA], par[_BETA], par[_XC])
    nominal, _slope = harden(BARCELONA, x, par[_S0], par[_ALPHA], par[_BETA], par, 0)
    damage = min(par[_M] * x, par[_DMAX])
    return nominal / (1.0 - damage), damage


@kernel(error_model="numpy")
def _tension(plastic, par):
    """Effective yield stress and damage in tension at an equivalent plastic strain."""
    x = cracking_strain(par[_FORM], plastic, par[_N], par[_E], par[_T0], par[_DECAY], par[_XT])
    damage = min(1.0 - math.pow(1.0 + x, -par[_N]), par[_DMAX])
    return par[_T0] * math.exp(-par[_DECAY] * x) / (1.0 - damage), damage


@kernel(error_model="numpy")
def _share(s1, s2, s3):
    """r of Y (2.44): 1 in all-round tension, 0 in all-round compression."""
    total = abs(s1) + abs(s2) + abs(s3)
    if total <= 0.0:
        return 0.0
    return (max(s1, 0.0) + max(s2, 0.0) + max(s3, 0.0)) / total


@kernel(error_model="numpy")
def _whole(dc, dt, r, par):
    """D of Y (2.47)."""
    keep = (1.0 - (1.0 - par[_WT] * r) * dc) * (1.0 - (1.0 - par[_WC] * (1.0 - r)) * dt)
    return min(1.0 - keep, par[_DMAX])


@kernel(error_model="numpy")
def _end(multiplier, t1, t2, t3, bulk, shear, kc, kt, par):
    """State at the end of an increment with this multiplier, from effective trial values t1 >= t2 >= t3.

    Returns F, effective principal values, kc, kt, Dc, Dt, D.
    """
    p = -(t1 + t2 + t3) / 3.0
    d1, d2, d3 = t1 + p, t2 + p, t3 + p
    q_trial = math.sqrt(1.5 * (d1 * d1 + d2 * d2 + d3 * d3))
    a = par[_ECC] * par[_S0] * par[_TAN]
    c = 3.0 * shear * multiplier
    # q (1 + c / sqrt(a^2 + q^2)) = q_trial: increasing and concave, so Newton from below climbs to the root
    q = max(q_trial / (1.0 + c / a), q_trial - c)
    if c > 0.0:
        for _iteration in range(60):
            norm = math.sqrt(a * a + q * q)
            f = q + c * q / norm - q_trial
            step = f / (1.0 + c * a * a / (norm * norm * norm))
            q -= step
            if abs(step) <= 1e-15 * q_trial:
                break
    norm = math.sqrt(a * a + q * q)
    left = q / q_trial if q_trial > 0.0 else 0.0
    p += bulk * multiplier * par[_TAN]
    s1, s2, s3 = left * d1 - p, left * d2 - p, left * d3 - p
    r = _share(s1, s2, s3)
    if multiplier > 0.0:
        volume = par[_TAN] / 3.0
        kt = kt + r * max(0.0, multiplier * (1.5 * left * d1 / norm + volume))
        kc = kc + (1.0 - r) * max(0.0, -multiplier * (1.5 * left * d3 / norm + volume))
    yield_c, dc = _compression(kc, par)
    yield_t, dt = _tension(kt, par)
    b = yield_c / yield_t * (1.0 - par[_A]) - (1.0 + par[_A])
    top = b * s1 if s1 > 0.0 else par[_GAMMA] * s1
    f = (q - 3.0 * par[_A] * p + top) / (1.0 - par[_A]) - yield_c
    return f, s1, s2, s3, kc, kt, dc, dt, _whole(dc, dt, r, par)


@kernel(error_model="numpy")
def _solve(t1, t2, t3, f0, bulk, shear, kc, kt, par):
    """Multiplier with F = 0 where F(0) = f0 > 0: bracket by doubling, then false position with halving, then with
    bisection in turn (F falls off a cliff where a nearly isotropic stress changes sign); -1 on failure."""
    scale = abs(t1) + abs(t2) + abs(t3)
    high = f0 / (3.0 * shear + bulk * par[_TAN])
    low, f_low, f_high = 0.0, f0, f0
    for _iteration in range(200):
        f_high = _end(high, t1, t2, t3, bulk, shear, kc, kt, par)[0]
        if f_high <= 0.0:
            break
        low, f_low = high, f_high
        high *= 2.0
    if not f_high <= 0.0:
        return -1.0
    side = 0
    x = high
    for iteration in range(200):
        x = (low * f_high - high * f_low) / (f_high - f_low)
        if not low < x < high or (iteration > 12 and iteration % 2 == 0):
            x = 0.5 * (low + high)
        f = _end(x, t1, t2, t3, bulk, shear, kc, kt, par)[0]
        if abs(f) <= 1e-13 * scale or high - low <= 1e-16 * high:
            return x
        if f > 0.0:
            low, f_low = x, f
            if side == 1:
                f_high *= 0.5
            side = 1
        else:
            high, f_high = x, f
            if side == -1:
                f_low *= 0.5
            side = -1
    return x


@kernel(error_model="numpy")
def update_lubliner(deps, sig, state, par, length, tangent):
    """The law `lubliner`; arguments and return code as in `laws.update`."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    bulk, shear = moduli(par[_E], par[_NU])
    lame = bulk - 2.0 * shear / 3.0
    n = sig.shape[0]
    keep = 1.0 - state[1]
    trial = np.empty(n)
    spread = lame * (deps[0] + deps[1] + deps[2])
    for i in range(n):
        trial[i] = sig[i] / keep + (spread + 2.0 * shear * deps[i] if i < 3 else shear * deps[i])
    vectors = np.empty((3, 3))
    c, s, rank = 1.0, 0.0, 2
    if n == 4:
        t1, t2, t3, c, s, rank = split_plane(trial[0], trial[1], trial[2], trial[3])
    else:
        t1, t2, t3 = split_space(trial, vectors)
    kc, kt = state[2], state[3]
    scale = abs(t1) + abs(t2) + abs(t3)
    multiplier = 0.0
    f, s1, s2, s3, new_c, new_t, dc, dt, damage = _end(0.0, t1, t2, t3, bulk, shear, kc, kt, par)
    if f > 1e-12 * (scale + par[_S0]):
        multiplier = _solve(t1, t2, t3, f, bulk, shear, kc, kt, par)
        if multiplier < 0.0:
            return NOT_CONVERGED
        f, s1, s2, s3, new_c, new_t, dc, dt, damage = _end(multiplier, t1, t2, t3, bulk, shear, kc, kt, par)
    keep = 1.0 - damage
    if tangent.shape[0] > 0:
        # differences of the explicit end state with respect to the trial values and the multiplier
        h = 1e-7 * (scale + par[_S0])
        values = np.empty((4, 4))
        for j in range(4):
            a1 = t1 + h if j == 0 else t1
            a2 = t2 + h if j == 1 else t2
            a3 = t3 + h if j == 2 else t3
            b1 = t1 - h if j == 0 else t1
            b2 = t2 - h if j == 1 else t2
            b3 = t3 - h if j == 2 else t3
            hm = 0.0
            if j == 3:
                if multiplier <= 0.0:
                    break
                hm = min(1e-5 * multiplier, h / (3.0 * shear))
            up = _end(multiplier + hm, a1, a2, a3, bulk, shear, kc, kt, par)
            down = _end(multiplier - hm, b1, b2, b3, bulk, shear, kc, kt, par)
            wide = 2.0 * (hm if j == 3 else h)
            values[0, j] = (up[0] - down[0]) / wide
            values[1, j] = ((1.0 - up[8]) * up[1] - (1.0 - down[8]) * down[1]) / wide
            values[2, j] = ((1.0 - up[8]) * up[2] - (1.0 - down[8]) * down[2]) / wide
            values[3, j] = ((1.0 - up[8]) * up[3] - (1.0 - down[8]) * down[3]) / wide
        for i in range(3):
            along0, along1, along2 = values[i + 1, 0], values[i + 1, 1], values[i + 1, 2]
            if multiplier > 0.0 and values[0, 3] != 0.0:
                ratio = values[i + 1, 3] / values[0, 3]
                along0 -= ratio * values[0, 0]
                along1 -= ratio * values[0, 1]
                along2 -= ratio * values[0, 2]
            total = lame * (along0 + along1 + along2)
            tangent[i, 0] = total + 2.0 * shear * along0
            tangent[i, 1] = total + 2.0 * shear * along1
            tangent[i, 2] = total + 2.0 * shear * along2
    state[0], state[1], state[2], state[3] = new_c + new_t, damage, new_c, new_t
    state[4], state[5] = dc, dt
    e1, e2, e3 = keep * s1, keep * s2, keep * s3
    if n == 4:
        back_plane_stress(e1, e2, e3, c, s, rank, sig)
    else:
        back_space_stress(e1, e2, e3, vectors, sig)
    if tangent.shape[0] > 0:
        g12 = shear_modulus(e1, e2, t1, t2, tangent[0, 0], tangent[0, 1], scale, shear)
        g13 = shear_modulus(e1, e3, t1, t3, tangent[0, 0], tangent[0, 2], scale, shear)
        g23 = shear_modulus(e2, e3, t2, t3, tangent[1, 1], tangent[1, 2], scale, shear)
        if n == 4:
            back_plane_tangent(c, s, rank, g12, g13, g23, tangent)
        else:
            back_space_tangent(vectors, g12, g13, g23, tangent)
    return OK


def _check(values: Mapping[str, Any]) -> list[str]:
    found = []
    if values["peak_yield"] < values["initial_yield"]:
        found.append("peak_yield at least initial_yield")
    limit = steepest_dilation(values["stress_invariant_ratio"], values["biaxial_ratio"])
    if values["dilation_angle"] > limit * (1.0 + 1e-9):
        found.append(
            f"dilation_angle at most {math.degrees(limit):.4g} deg with this stress_invariant_ratio and "
            "biaxial_ratio, otherwise flow under pressure yields work"
        )
    return found


LUBLINER = Law(
    id=4,
    name="lubliner",
    title="damage-plasticity of quasi-brittle materials (Lubliner; Lee and Fenves)",
    parameters=PARAMETERS["lubliner"],
    derived=("a", "gamma", "alpha", "beta", "m", "n", "tan_dilation"),
    state_names=(
        "equivalent_plastic_strain", "damage", "compressive_plastic_strain", "tensile_plastic_strain",
        "compressive_damage", "tensile_damage",
    ),
    initial_state=lambda par: np.zeros(6),
    prepare=prepare_lubliner,
    check=_check,
)  # fmt: skip
