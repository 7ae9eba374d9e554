"""Internal forces of hexahedra with one point: mean gradient and stiffness-type hourglass control.

Volume and gradients follow Flanagan and Belytschko (1981): no volumetric locking, patch test exact in any shape.
The four hourglass modes per direction carry generalised forces Q that live in the rotated frame like the stress,
``dQ = chi G V |b|^2 / 24 dq``: chi = 1 is about the elastic bending stiffness of a cube.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.elements.hex8 import hourglass_shares, volume_gradient
from graben.mechanics.materials.laws import update
from graben.mechanics.scratch.rotation import follow_rotation, midstep_increment, rotate_stress

# Where each energy stands in the ledger [J] (half model).
INTERNAL, HOURGLASS_WORK, VISCOUS, EXTERNAL, TANGENTIAL, NORMAL_STORED, TANGENT_STORED, KINETIC = range(8)
DAMPING, ADDED_MASS, LEDGER_SIZE = 8, 9, 10


@kernel(error_model="numpy")
def forces_one_point(
    x,
    step,
    cells,
    g0,
    alive,
    vol,
    mass,
    rot,
    sig,
    state,
    hour,
    law,
    par,
    shear,
    chi,
    viscous,
    wave,
    dt,
    force,
    ledger,
):
    """Subtract internal forces [N] from force (n, 3) after the displacement step (n, 3) that led to x (n, 3).

    g0 (e, 1, 8, 3) reference mean gradients; vol (e,) volumes, updated; mass (e,) kg; rot (e, 1, 3, 3), sig
    (e, 1, 6), state (e, 1, m), hour (e, 4, 3) updated; shear modulus [Pa], chi hourglass factor, viscous the linear
    bulk viscosity, wave speed [m/s], dt [s]; ledger (LEDGER_SIZE,) J. Returns (code, element): code 0; -1 for a
    volume that is not positive; else the law's code.
    """
    xe, ue, b = np.empty((8, 3)), np.empty((8, 3)), np.empty((8, 3))
    f, a, m, k, s3 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    hx, dq, q = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    deps, old, no_tangent = np.empty(6), np.empty(6), np.empty((0, 0))
    internal, hourglass, dissipated = 0.0, 0.0, 0.0
    for e in range(cells.shape[0]):
        if alive[e] == 0:
            continue
        for n in range(8):
            node = cells[e, n]
            for i in range(3):
                xe[n, i] = x[node, i]
                ue[n, i] = step[node, i]
        volume = volume_gradient(xe, b)
        if not volume > 0.0:
            return -1, e
        for i in range(3):
            for j in range(3):
                total, grad = 0.0, 0.0
                for n in range(8):
                    total += xe[n, i] * g0[e, 0, n, j]
                    grad += ue[n, i] * b[n, j]
                f[i, j] = total
                a[i, j] = grad / volume
        r = rot[e, 0]
        follow_rotation(f, r, m, k)
        midstep_increment(a, r, deps, m, k)
        for i in range(6):
            old[i] = sig[e, 0, i]
        code = update(law, deps, sig[e, 0], state[e, 0], par, np.cbrt(volume), no_tangent)
        if code != 0:
            return code, e
        work = 0.0
        for i in range(6):
            work += (vol[e] * old[i] + volume * sig[e, 0, i]) * deps[i]
        internal += 0.5 * work
        vol[e] = volume
        rotate_stress(sig[e, 0], r, s3, k)
        trace = deps[0] + deps[1] + deps[2]
        pressure = viscous * mass[e] / volume * wave * np.cbrt(volume) * trace / dt
        dissipated += pressure * trace * volume
        square = 0.0
        for n in range(8):
            square += b[n, 0] * b[n, 0] + b[n, 1] * b[n, 1] + b[n, 2] * b[n, 2]
        stiffness = chi * shear * square / (24.0 * volume)
        if state.shape[2] > 1:
            stiffness *= 1.0 - state[e, 0, 1]
        hourglass_shares(xe, hx)
        hourglass_shares(ue, dq)
        for p in range(4):
            for i in range(3):
                dq[p, i] -= a[i, 0] * hx[p, 0] + a[i, 1] * hx[p, 1] + a[i, 2] * hx[p, 2]
            for i in range(3):
                move = r[0, i] * dq[p, 0] + r[1, i] * dq[p, 1] + r[2, i] * dq[p, 2]
                before = hour[e, p, i]
                hour[e, p, i] = before + stiffness * move
                hourglass += 0.5 * (before + hour[e, p, i]) * move
            for i in range(3):
                q[p, i] = r[i, 0] * hour[e, p, 0] + r[i, 1] * hour[e, p, 1] + r[i, 2] * hour[e, p, 2]
        for i in range(3):
            for j in range(3):
                turned = q[0, i] * hx[0, j] + q[1, i] * hx[1, j] + q[2, i] * hx[2, j] + q[3, i] * hx[3, j]
                s3[i, j] -= turned / volume
            s3[i, i] += pressure
        for i in range(3):
            # sums of the four hourglass forces with the signs of each corner
            q0, q1, q2, q3 = q[0, i], q[1, i], q[2, i], q[3, i]
            ue[0, i], ue[6, i] = q0 + q1 + q2 - q3, q0 + q1 + q2 + q3
            ue[1, i], ue[7, i] = q1 - q0 - q2 + q3, q1 - q0 - q2 - q3
            ue[2, i], ue[4, i] = q0 - q1 - q2 - q3, q0 - q1 - q2 + q3
            ue[3, i], ue[5, i] = q2 - q0 - q1 + q3, q2 - q0 - q1 - q3
        for n in range(8):
            node = cells[e, n]
            for i in range(3):
                force[node, i] -= s3[i, 0] * b[n, 0] + s3[i, 1] * b[n, 1] + s3[i, 2] * b[n, 2] + ue[n, i]
    ledger[INTERNAL] += internal
    ledger[HOURGLASS_WORK] += hourglass
    ledger[VISCOUS] += dissipated
    return 0, -1
