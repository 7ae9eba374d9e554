"""Extended Drucker-Prager plasticity with ductile damage, Y 2.5.2.

With p = -tr(s)/3, q the von Mises stress and r^3 = 27/2 det(dev s) of the effective stress s = sigma / (1 -
D) (Y prints p and q swapped):

    F = t - p tan(beta) - (1 - tan(beta)/3) sigma_c(e)        Y (2.29)
    t = q/2 (1 + 1/K - (1 - 1/K) (r/q)^3)
    G = t - p tan(psi)                                        Y (2.30)

beta is the friction angle in the p-t plane and e the equivalent plastic strain, which equals the axial
plastic strain in uniaxial compression: de = (1 - tan(psi)/3) dlambda. sigma_c(e) is a curve of
`hardening.py`.

Damage starts when the sum of de / e_f(eta) reaches 1, with triaxiality eta = -p/q and e_f = D2 exp(D3 eta), Y
(2.33) and (2.71)-(2.72); from there dD = L de / u_f, Y (2.34), with the element length L. D stops at
max_damage.

Return mapping: the law is isotropic, so only principal values change. In the deviatoric plane, with polar
coordinates rho = sqrt(2/3) q and Lode angle th (cos 3 th = (r/q)^3), t = sqrt(3/2) rho h(th) with
h = 1 + k/2 (1 + cos 3 th), k = 1/K - 1, and backward Euler reads

    rho = rho_tr cos(th - th_tr) - a h,   0 = rho_tr sin(th - th_tr) + a h',   a = sqrt(6) mu dlambda.

Two unknowns (dlambda, th); Newton first, nested bisection where that fails, which cannot for a convex surface
(K >= 7/9). Where rho would become negative the stress returns to the apex; beyond the flow along G, the apex
takes volumetric flow v whose equivalent plastic strain is (1 - tan(psi)/3) v / tan(beta), so that the two
agree when psi = beta.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.drucker_prager_return import ROOT32, apex_flow, bisect, newton, yield_stress
from graben.mechanics.materials.drucker_prager_slots import (
    BETA,
    D3,
    DAMAGE,
    DMAX,
    E50,
    E60,
    EPEAK,
    GAIN,
    HARD_A,
    HARD_B,
    KIND,
    LOG_D2,
    NU,
    PEAK,
    PSI,
    RATE,
    SIGMA0,
    SLOPE,
    TAN_BETA,
    TAN_PSI,
    UF,
    E,
    K,
)
from graben.mechanics.materials.elastic import add_elastic, fill_elastic, finite, moduli
from graben.mechanics.materials.hardening import BARCELONA, EXPONENTIAL, barcelona_coefficients
from graben.mechanics.materials.law import NOT_CONVERGED, NOT_FINITE, OK, Law
from graben.mechanics.tensors.principal import (
    back_plane_stress,
    back_plane_tangent,
    back_space_stress,
    back_space_tangent,
    shear_modulus,
    split_plane,
    split_space,
)

_ROOT2, _ROOT3, _ROOT6, _ROOT13 = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(6.0), math.sqrt(1.0 / 3.0)
_SIXTH_TURN = math.pi / 3.0


@kernel(error_model="numpy")
def prepare_drucker_prager(par):
    """Fill the derived slots of par: tangents of the angles, hardening coefficients, damage coefficients."""
    par[PSI] = min(par[PSI], par[BETA])
    par[PEAK] = max(par[PEAK], par[SIGMA0]) if int(par[KIND]) == BARCELONA else par[PEAK]
    par[TAN_BETA] = math.tan(par[BETA])
    par[TAN_PSI] = math.tan(par[PSI])
    kind = int(par[KIND])
    par[HARD_A], par[HARD_B] = 0.0, 0.0
    if kind == EXPONENTIAL:
        par[HARD_A], par[HARD_B] = par[GAIN], par[RATE]
    elif kind == BARCELONA:
        par[HARD_A], par[HARD_B] = barcelona_coefficients(par[SIGMA0], par[PEAK], par[EPEAK])
    else:
        par[HARD_A] = par[SLOPE]
    par[LOG_D2], par[D3] = 0.0, 0.0
    if par[DAMAGE] != 0.0:
        log50, log60 = math.log(par[E50]), math.log(par[E60])
        par[LOG_D2] = 6.0 * log50 - 5.0 * log60
        par[D3] = 10.0 * (log50 - log60)


@kernel(error_model="numpy")
def _damage(state, gain, eta, length, par):
    """Advance state[1] damage and state[2] initiation by an equivalent plastic strain `gain` at triaxiality
    eta.

    Returns d(damage)/d(gain) and d(damage)/d(eta).
    """
    eta = min(max(eta, -10.0), 10.0)
    exponent = min(max(par[LOG_D2] + par[D3] * eta, -60.0), 60.0)
    strain_f = math.exp(exponent)
    before = state[2]
    state[2] = before + gain / strain_f
    if state[2] <= 1.0 or state[1] >= par[DMAX]:
        return 0.0, 0.0
    left = max(0.0, 1.0 - before) * strain_f  # the part of gain spent before initiation
    speed = length / par[UF]
    damage = state[1] + speed * (gain - left)
    if damage >= par[DMAX]:
        state[1] = par[DMAX]
        return 0.0, 0.0
    state[1] = damage
    bounded = abs(eta) < 10.0 and abs(exponent) < 60.0
    return speed, -speed * left * par[D3] if bounded else 0.0


@kernel(error_model="numpy")
def _column(tangent, j, keep, stress, ds, dp, dd):
    """Column j of the principal block: keep (ds - dp) - dd stress."""
    tangent[0, j] = keep * (ds[0] - dp) - dd * stress[0]
    tangent[1, j] = keep * (ds[1] - dp) - dd * stress[1]
    tangent[2, j] = keep * (ds[2] - dp) - dd * stress[2]


@kernel(error_model="numpy")
def _return(s1, s2, s3, d, slope, bulk, shear, state, par, length, tangent):
    """Effective trial principal values (sorted) -> code, s1, s2, s3 nominal, with tangent[:3, :3] and state
    set.

    d, slope: yield term at the strain so far. Called only where the trial stress lies outside the yield
    surface.
    """
    tan_b, tan_p = par[TAN_BETA], par[TAN_PSI]
    rate = 1.0 - tan_p / 3.0
    k = 1.0 / par[K] - 1.0
    flow = _ROOT6 * shear
    p_trial = -(s1 + s2 + s3) / 3.0
    d1, d2, d3 = s1 + p_trial, s2 + p_trial, s3 + p_trial
    rho_trial = math.sqrt(d1 * d1 + d2 * d2 + d3 * d3)
    # unit vectors of the deviatoric plane at the trial stress: radial, and around towards compression
    over = 1.0 / rho_trial if rho_trial > 0.0 else 0.0
    u1, u2, u3 = d1 * over, d2 * over, d3 * over
    g12, g23, g13 = u1 - u2, u2 - u3, u1 - u3
    v1, v2, v3 = -g23 * _ROOT13, g13 * _ROOT13, -g12 * _ROOT13
    cos3, sin3 = 3.0 * _ROOT6 * u1 * u2 * u3, _ROOT2 * g12 * g23 * g13
    strain = state[0]
    found, multiplier, c, s = newton(p_trial, rho_trial, cos3, sin3, strain, d, slope, bulk, flow, k, par)
    apex = False
    if not found:
        theta_trial = min(math.atan2(_ROOT3 * g23, 3.0 * u1), _SIXTH_TURN)
        which, multiplier, theta = bisect(p_trial, rho_trial, theta_trial, strain, bulk, flow, k, par)
        apex = which == 1
        c, s = math.cos(theta - theta_trial), math.sin(theta - theta_trial)
    # the shape function at the end, by the same angle sums as in newton
    triple_c, triple_s = c * (4.0 * c * c - 3.0), s * (3.0 - 4.0 * s * s)
    cos3, sin3 = cos3 * triple_c - sin3 * triple_s, sin3 * triple_c + cos3 * triple_s
    h, h1, h2 = 1.0 + 0.5 * k * (1.0 + cos3), -1.5 * k * sin3, -4.5 * k * cos3
    p = p_trial + bulk * tan_p * multiplier
    a = flow * multiplier
    rho = 0.0
    extra = 0.0
    if apex:
        extra = apex_flow(p, strain + rate * multiplier, bulk, par)
        p += bulk * extra
    else:
        rho = rho_trial * c - a * h
    gain = rate * multiplier
    if extra > 0.0:
        gain += rate * extra / tan_b
    r1, r2, r3 = c * u1 + s * v1, c * u2 + s * v2, c * u3 + s * v3
    e1, e2, e3 = rho * r1 - p, rho * r2 - p, rho * r3 - p
    if not (abs(e1) + abs(e2) + abs(e3) + gain < 1e150):
        return NOT_CONVERGED, s1, s2, s3
    state[0] = strain + gain
    per_gain, per_eta = 0.0, 0.0
    q = ROOT32 * rho
    if par[DAMAGE] != 0.0:
        eta = -p / q if q > 1e-12 * abs(p) else (10.0 if p < 0.0 else -10.0)
        per_gain, per_eta = _damage(state, gain, eta, length, par)
    keep = 1.0 - state[1]
    if tangent.shape[0] == 0:
        return OK, keep * e1, keep * e2, keep * e3
    _d, slope = yield_stress(state[0], par)
    stress, radial = (e1, e2, e3), (r1, r2, r3)
    twice = 2.0 * shear
    if apex:
        soft = tan_b * bulk + (slope * rate / tan_b if tan_b > 0.0 else 0.0)
        for j in range(3):
            lam = twice * radial[j] / (flow * h)
            v = 0.0
            if extra > 0.0 and soft != 0.0:
                v = (tan_b * bulk - (tan_b * bulk * tan_p + slope * rate) * lam) / soft
            dp = -bulk + bulk * tan_p * lam + bulk * v
            dgain = rate * lam + (rate * v / tan_b if tan_b > 0.0 else 0.0)
            _column(tangent, j, keep, stress, (0.0, 0.0, 0.0), dp, per_gain * dgain)
        return OK, keep * e1, keep * e2, keep * e3
    m = 1.0 / (1.0 + a * (h + h2) / rho) if rho > 0.0 else 0.0
    turn = m * h1
    stiff = ROOT32 * flow * (h * h + h1 * turn) + tan_b * tan_p * bulk + slope * rate
    weak = 1.0 / stiff if stiff != 0.0 else 0.0
    t1, t2, t3 = c * v1 - s * u1, c * v2 - s * u2, c * v3 - s * u3
    around = (t1, t2, t3)
    n1, n2, n3 = h * r1 + turn * t1, h * r2 + turn * t2, h * r3 + turn * t3
    normal = (n1, n2, n3)
    for j in range(3):
        lam = (ROOT32 * twice * normal[j] + tan_b * bulk) * weak
        dp = -bulk + bulk * tan_p * lam
        dd = per_gain * rate * lam
        if per_eta != 0.0:
            dd += per_eta * (-dp + p / rho * (twice * radial[j] - flow * h * lam)) / q
        x, y, z = twice * radial[j], twice * m * around[j], flow * lam
        ds = (r1 * x + t1 * y - n1 * z, r2 * x + t2 * y - n2 * z, r3 * x + t3 * y - n3 * z)
        _column(tangent, j, keep, stress, ds, dp, dd)
    return OK, keep * e1, keep * e2, keep * e3


@kernel(error_model="numpy")
def update_drucker_prager(deps, sig, state, par, length, tangent):
    """The law `drucker-prager`; arguments and return code as in `laws.update`."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    bulk, shear = moduli(par[E], par[NU])
    keep = 1.0 - state[1]
    n = sig.shape[0]
    old0, old1, old2, old3 = sig[0], sig[1], sig[2], sig[3]
    old4, old5 = (sig[4], sig[5]) if n == 6 else (0.0, 0.0)
    add_elastic(deps, keep, bulk, shear, sig)
    # effective trial stress; the yield function needs only invariants
    x0, x1, x2, x3 = sig[0] / keep, sig[1] / keep, sig[2] / keep, sig[3] / keep
    x4, x5 = (sig[4] / keep, sig[5] / keep) if n == 6 else (0.0, 0.0)
    p = -(x0 + x1 + x2) / 3.0
    d0, d1, d2 = x0 + p, x1 + p, x2 + p
    q2 = 1.5 * (d0 * d0 + d1 * d1 + d2 * d2 + 2.0 * (x3 * x3 + x4 * x4 + x5 * x5))
    q = math.sqrt(q2)
    k = 1.0 / par[K] - 1.0
    cos3 = 0.0
    if k != 0.0 and q > 0.0:
        det = d0 * (d1 * d2 - x4 * x4) - x3 * (x3 * d2 - x4 * x5) + x5 * (x3 * x4 - d1 * x5)
        cos3 = 13.5 * det / (q2 * q)
    t = q * (1.0 + 0.5 * k * (1.0 + cos3))
    d, slope = yield_stress(state[0], par)
    friction = p * par[TAN_BETA]
    if t - friction - d <= 1e-13 * (t + abs(friction) + d):
        fill_elastic(keep, bulk, shear, tangent)
        return OK
    if n == 4:
        s1, s2, s3, c, s, rank = split_plane(x0, x1, x2, x3)
        code, e1, e2, e3 = _return(s1, s2, s3, d, slope, bulk, shear, state, par, length, tangent)
        if code != OK:
            sig[0], sig[1], sig[2], sig[3] = old0, old1, old2, old3
            return code
        back_plane_stress(e1, e2, e3, c, s, rank, sig)
        if tangent.shape[0] > 0:
            g12, g13, g23 = _shears(e1, e2, e3, s1, s2, s3, q, 1.0 - state[1], shear, tangent)
            back_plane_tangent(c, s, rank, g12, g13, g23, tangent)
        return OK
    vectors = np.empty((3, 3))
    whole = np.empty(6)
    whole[0], whole[1], whole[2], whole[3], whole[4], whole[5] = x0, x1, x2, x3, x4, x5
    s1, s2, s3 = split_space(whole, vectors)
    code, e1, e2, e3 = _return(s1, s2, s3, d, slope, bulk, shear, state, par, length, tangent)
    if code != OK:
        sig[0], sig[1], sig[2], sig[3], sig[4], sig[5] = old0, old1, old2, old3, old4, old5
        return code
    back_space_stress(e1, e2, e3, vectors, sig)
    if tangent.shape[0] > 0:
        g12, g13, g23 = _shears(e1, e2, e3, s1, s2, s3, q, 1.0 - state[1], shear, tangent)
        back_space_tangent(vectors, g12, g13, g23, tangent)
    return OK


@kernel(error_model="numpy")
def _shears(e1, e2, e3, s1, s2, s3, scale, keep, shear, tangent):
    """The three tangent shear moduli between principal axes; e nominal values, s effective trial values."""
    g12 = shear_modulus(e1, e2, s1, s2, tangent[0, 0], tangent[0, 1], scale, shear)
    g13 = shear_modulus(e1, e3, s1, s3, tangent[0, 0], tangent[0, 2], scale, shear)
    g23 = shear_modulus(e2, e3, s2, s3, tangent[1, 1], tangent[1, 2], scale, shear)
    return g12, g13, g23


def _check(values: Mapping[str, Any]) -> list[str]:
    found = []
    if values["dilation_angle"] > values["friction_angle"]:
        found.append("dilation_angle at most friction_angle, otherwise flow under pressure yields work")
    if values["hardening"] == "barcelona" and values["peak_yield"] < values["initial_yield"]:
        found.append("peak_yield at least initial_yield")
    if values["hardening"] == "table" and np.any(np.asarray(values["hardening_table"])[:, 1] < 0.0):
        found.append("hardening_table without negative stresses")
    return found


DRUCKER_PRAGER = Law(
    id=3,
    name="drucker-prager",
    title="extended Drucker-Prager with ductile damage",
    parameters=PARAMETERS["drucker-prager"],
    derived=("tan_friction", "tan_dilation", "hardening_a", "hardening_b", "log_d2", "d3"),
    state_names=("equivalent_plastic_strain", "damage", "initiation"),
    initial_state=lambda par: np.zeros(3),
    prepare=prepare_drucker_prager,
    check=_check,
)
