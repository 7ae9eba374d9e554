"""Internal forces of hexahedra with eight points and a mean dilatation (B-bar): the reference for one point."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.elements.hex8 import shape_gradient, volume_gradient
from graben.mechanics.materials.laws import update
from graben.mechanics.scratch.one_point import INTERNAL, VISCOUS
from graben.mechanics.scratch.rotation import follow_rotation, midstep_increment, rotate_stress


@kernel(error_model="numpy")
def forces_eight_points(
    x, step, cells, g0, alive, vol, mass, rot, sig, state, law, par, viscous, wave, dt, force, ledger
):
    """As `forces_one_point`, with g0 (e, 8, 8, 3), rot (e, 8, 3, 3), sig (e, 8, 6), state (e, 8, m).

    Each point takes the volumetric increment of the whole element and gives its pressure to the mean gradient.
    """
    xe, ue, b, g = np.empty((8, 3)), np.empty((8, 3)), np.empty((8, 3)), np.empty((8, 3))
    f, a, m, k, s3 = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    deps, old, no_tangent = np.empty(6), np.empty(6), np.empty((0, 0))
    internal, dissipated = 0.0, 0.0
    root = 1.0 / np.sqrt(3.0)
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
        mean_trace = 2.0 * (volume - vol[e]) / (volume + vol[e])
        share = vol[e] / volume
        vol[e] = volume
        viscous_pressure = viscous * mass[e] / volume * wave * np.cbrt(volume) * mean_trace / dt
        dissipated += viscous_pressure * mean_trace * volume
        total_pressure = viscous_pressure * volume
        for p in range(8):
            xi = root if (p & 1) else -root
            eta = root if (p & 2) else -root
            zeta = root if (p & 4) else -root
            weight = shape_gradient(xe, xi, eta, zeta, g)
            if not weight > 0.0:
                return -1, e
            for i in range(3):
                for j in range(3):
                    total, grad = 0.0, 0.0
                    for n in range(8):
                        total += xe[n, i] * g0[e, p, n, j]
                        grad += ue[n, i] * g[n, j]
                    f[i, j] = total
                    a[i, j] = grad
            r = rot[e, p]
            follow_rotation(f, r, m, k)
            midstep_increment(a, r, deps, m, k)
            shift = (mean_trace - deps[0] - deps[1] - deps[2]) / 3.0
            for i in range(3):
                deps[i] += shift
            for i in range(6):
                old[i] = sig[e, p, i]
            code = update(law, deps, sig[e, p], state[e, p], par, np.cbrt(volume), no_tangent)
            if code != 0:
                return code, e
            work = 0.0
            for i in range(6):
                work += (share * old[i] + sig[e, p, i]) * deps[i]
            internal += 0.5 * work * weight
            pressure = (sig[e, p, 0] + sig[e, p, 1] + sig[e, p, 2]) / 3.0
            total_pressure += pressure * weight
            rotate_stress(sig[e, p], r, s3, k)
            for i in range(3):
                s3[i, i] -= pressure
            for n in range(8):
                node = cells[e, n]
                for i in range(3):
                    force[node, i] -= weight * (s3[i, 0] * g[n, 0] + s3[i, 1] * g[n, 1] + s3[i, 2] * g[n, 2])
        for n in range(8):
            node = cells[e, n]
            for i in range(3):
                force[node, i] -= total_pressure / volume * b[n, i]
    ledger[INTERNAL] += internal
    ledger[VISCOUS] += dissipated
    return 0, -1
