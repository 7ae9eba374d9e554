"""Mohr-Coulomb plasticity with a tension cut-off: perfectly plastic, non-associated in shear, associated in
tension.

With principal values s1 >= s2 >= s3 (tension positive), the surface is made of planes

    shear     s_i (1 + sin phi) - s_j (1 - sin phi) - 2 c cos phi = 0,   (i, j) = (1, 3), (2, 3), (1, 2)
    tension   s_i - T = 0,                                               i = 1, 2, 3

and the flow of a shear plane has the dilation angle psi in place of phi. Between planes the stress returns to
an edge or a corner with one multiplier per plane (Koiter). All planes are linear, so each choice of active
planes is one small linear system; the return is the first choice, from few planes to many, whose multipliers
are not negative and whose stress lies inside all other planes. The equivalent plastic strain sums sqrt(2/3
de_p : de_p).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.elastic import add_elastic, fill_elastic, finite, moduli
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

_E, _NU, _PHI, _PSI, _C, _T = range(6)
_ROOT23 = math.sqrt(2.0 / 3.0)

# planes: 0 shear 13, 1 shear 23, 2 shear 12, 3 tension 1, 4 tension 2, 5 tension 3; -1 none
_HIGH = np.array([0, 1, 0, 0, 1, 2])
_LOW = np.array([2, 2, 1, -1, -1, -1])
_CHOICES = np.array(
    [
        (0, -1, -1), (3, -1, -1),
        (0, 1, -1), (0, 2, -1), (0, 3, -1), (3, 4, -1),
        (0, 1, 3), (0, 2, 3), (0, 3, 4), (0, 1, 4), (0, 2, 4), (0, 1, 2), (3, 4, 5), (0, 3, 5),
    ]
)  # fmt: skip


@kernel(error_model="numpy")
def prepare_mohr_coulomb(par):
    """No derived slots: the dilation angle stays at most the friction angle."""
    par[_PSI] = min(par[_PSI], par[_PHI])


@kernel(error_model="numpy")
def _normal(plane, sine, out):
    """Gradient of a plane in principal axes: sin phi gives the yield function's, sin psi the potential's."""
    out[0] = out[1] = out[2] = 0.0
    if plane < 3:
        out[_HIGH[plane]] = 1.0 + sine
        out[_LOW[plane]] = sine - 1.0
    else:
        out[_HIGH[plane]] = 1.0


@kernel(error_model="numpy")
def _value(plane, s, sine, term, tension):
    """Yield function of a plane at principal values s (3,); term = 2 c cos phi."""
    if plane < 3:
        return s[_HIGH[plane]] * (1.0 + sine) - s[_LOW[plane]] * (1.0 - sine) - term
    return s[_HIGH[plane]] - tension


@kernel(error_model="numpy")
def _cut_off(par):
    """Tensile strength, at most the apex c cot phi of the shear planes: beyond it there is nothing to cut."""
    sine = math.sin(par[_PHI])
    if sine <= 0.0:
        return par[_T]
    return min(par[_T], par[_C] * math.cos(par[_PHI]) / sine)


@kernel(error_model="numpy")
def _solve3(a, b, m):
    """Solve a[:m, :m] x = b[:m] by Gauss-Jordan with pivoting, on all columns of a; False when singular."""
    for i in range(m):
        pivot = i
        for r in range(i + 1, m):
            if abs(a[r, i]) > abs(a[pivot, i]):
                pivot = r
        if not abs(a[pivot, i]) > 1e-12:
            return False
        if pivot != i:
            for c in range(a.shape[1]):
                a[i, c], a[pivot, c] = a[pivot, c], a[i, c]
            b[i], b[pivot] = b[pivot], b[i]
        over = 1.0 / a[i, i]
        for c in range(a.shape[1]):
            a[i, c] *= over
        b[i] *= over
        for r in range(m):
            if r != i:
                ratio = a[r, i]
                for c in range(a.shape[1]):
                    a[r, c] -= ratio * a[i, c]
                b[r] -= ratio * b[i]
    return True


@kernel(error_model="numpy")
def _return(trial, bulk, shear, par, out, tangent):
    """Sorted trial values -> out (3,) and tangent[:3, :3]; the plastic strain gained, or -1 without a
    return."""
    sine, flow = math.sin(par[_PHI]), math.sin(par[_PSI])
    term = 2.0 * par[_C] * math.cos(par[_PHI])
    tension = _cut_off(par)
    lame = bulk - 2.0 * shear / 3.0
    size = abs(trial[0]) + abs(trial[1]) + abs(trial[2]) + term + tension
    gradient, potential, moved = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    system, right = np.empty((3, 6)), np.empty(3)
    for choice in range(_CHOICES.shape[0]):
        m = 0 * choice
        for a in range(3):
            plane = _CHOICES[choice, a]
            if plane < 0:
                break
            _normal(plane, sine, gradient[a])
            _normal(plane, flow, potential[a])
            trace = potential[a, 0] + potential[a, 1] + potential[a, 2]
            for i in range(3):
                moved[a, i] = (lame * trace + 2.0 * shear * potential[a, i]) / shear
            right[a] = _value(plane, trial, sine, term, tension) / shear
            m += 1
        # the right half collects the inverse, for the tangent
        for a in range(m):
            for b in range(m):
                system[a, b] = 0.0
                system[a, 3 + b] = 1.0 if a == b else 0.0
                for i in range(3):
                    system[a, b] += gradient[a, i] * moved[b, i]
            for b in range(m, 3):
                system[a, b] = system[a, 3 + b] = 0.0
        if not _solve3(system, right, m):
            continue
        good = True
        for a in range(m):
            good = good and right[a] >= -1e-12 * size / shear
        if not good:
            continue
        for i in range(3):
            out[i] = trial[i]
            for a in range(m):
                out[i] -= shear * moved[a, i] * right[a]
        slack = 1e-10 * size
        if out[0] < out[1] - slack or out[1] < out[2] - slack:
            continue
        for plane in range(6):
            good = good and _value(plane, out, sine, term, tension) <= slack
        if not good:
            continue
        strain = 0.0
        for i in range(3):
            part = 0.0
            for a in range(m):
                part += right[a] * potential[a, i]
            strain += part * part
        if tangent.shape[0] > 0:
            for j in range(3):
                for i in range(3):
                    tangent[i, j] = lame + (2.0 * shear if i == j else 0.0)
            # C - C n A^-1 f C; f C in units of the shear modulus, as `moved`
            for a in range(m):
                for b in range(m):
                    trace = gradient[b, 0] + gradient[b, 1] + gradient[b, 2]
                    for j in range(3):
                        pull = (lame * trace + 2.0 * shear * gradient[b, j]) / shear
                        for i in range(3):
                            tangent[i, j] -= shear * moved[a, i] * system[a, 3 + b] * pull
        return _ROOT23 * math.sqrt(strain)
    return -1.0


@kernel(error_model="numpy")
def update_mohr_coulomb(deps, sig, state, par, length, tangent):
    """The law `mohr-coulomb`; arguments and return code as in `laws.update`."""
    if not (finite(deps) and finite(sig)):
        return NOT_FINITE
    bulk, shear = moduli(par[_E], par[_NU])
    n = sig.shape[0]
    old = sig.copy()
    add_elastic(deps, 1.0, bulk, shear, sig)
    trial, out, vectors = np.empty(3), np.empty(3), np.empty((3, 3))
    c, s, rank = 1.0, 0.0, 2
    if n == 4:
        trial[0], trial[1], trial[2], c, s, rank = split_plane(sig[0], sig[1], sig[2], sig[3])
    else:
        trial[0], trial[1], trial[2] = split_space(sig, vectors)
    sine = math.sin(par[_PHI])
    term = 2.0 * par[_C] * math.cos(par[_PHI])
    size = abs(trial[0]) + abs(trial[2]) + term
    outside = max(_value(0, trial, sine, term, par[_T]), trial[0] - _cut_off(par))
    if outside <= 1e-12 * size:
        fill_elastic(1.0, bulk, shear, tangent)
        return OK
    gain = _return(trial, bulk, shear, par, out, tangent)
    if gain < 0.0:
        for i in range(n):
            sig[i] = old[i]
        return NOT_CONVERGED
    state[0] += gain
    if n == 4:
        back_plane_stress(out[0], out[1], out[2], c, s, rank, sig)
    else:
        back_space_stress(out[0], out[1], out[2], vectors, sig)
    if tangent.shape[0] > 0:
        g12 = shear_modulus(out[0], out[1], trial[0], trial[1], tangent[0, 0], tangent[0, 1], size, shear)
        g13 = shear_modulus(out[0], out[2], trial[0], trial[2], tangent[0, 0], tangent[0, 2], size, shear)
        g23 = shear_modulus(out[1], out[2], trial[1], trial[2], tangent[1, 1], tangent[1, 2], size, shear)
        if n == 4:
            back_plane_tangent(c, s, rank, g12, g13, g23, tangent)
        else:
            back_space_tangent(vectors, g12, g13, g23, tangent)
    return OK


def _check(values: Mapping[str, Any]) -> list[str]:
    found = []
    if values["dilation_angle"] > values["friction_angle"]:
        found.append("dilation_angle at most friction_angle")
    return found


MOHR_COULOMB = Law(
    id=2,
    name="mohr-coulomb",
    title="Mohr-Coulomb with a tension cut-off, perfectly plastic",
    parameters=PARAMETERS["mohr-coulomb"],
    state_names=("equivalent_plastic_strain",),
    initial_state=lambda par: np.zeros(1),
    prepare=prepare_mohr_coulomb,
    check=_check,
)
