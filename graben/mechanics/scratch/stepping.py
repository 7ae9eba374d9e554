"""Explicit central differences: the leapfrog step, and the refresh of its length from the present shape."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.elements.hex8 import largest_face
from graben.mechanics.scratch.one_point import ADDED_MASS, DAMPING


@kernel(error_model="numpy")
def kick_and_drift(x, v, step, force, node_mass, free, dt, span, damping, ledger):
    """One leapfrog step: velocities v (n, 3) over `span` [s] by force (n, 3), positions x over dt, both in place.

    step (n, 3) gets the displacement; force is cleared. damping [1/s] is proportional to mass.
    """
    keep = 1.0 - damping * span
    lost = 0.0
    for a in range(x.shape[0]):
        scale = span / node_mass[a]
        for i in range(3):
            old = v[a, i]
            new = free[a, i] * (keep * old + scale * force[a, i])
            lost += 0.5 * node_mass[a] * damping * span * old * (old + new)
            v[a, i] = new
            step[a, i] = dt * new
            x[a, i] += dt * new
            force[a, i] = 0.0
    ledger[DAMPING] += lost


@kernel(error_model="numpy")
def kinetic_energy(v, force, node_mass, free, half):
    """Kinetic energy [J] at the time of the forces: velocities v (n, 3) lie half a step [s] earlier."""
    total = 0.0
    for a in range(v.shape[0]):
        for i in range(3):
            now = free[a, i] * (v[a, i] + half * force[a, i] / node_mass[a])
            total += 0.5 * node_mass[a] * now * now
    return total


@kernel(error_model="numpy")
def refresh(x, v, cells, alive, vol, cell_mass, stiff, safety, floor, node_mass, scaled, ledger):
    """Largest stable step [s], safety times volume over largest face over the wave speed, of the living elements.

    stiff is the longitudinal modulus [Pa]. Elements whose step would fall below floor [s] get mass until it does
    not; node_mass (n,) is rebuilt, scaled (e,) holds each element's mass factor, which never falls, and the kinetic
    energy that the added mass brings goes to the ledger. Returns (step, added mass [kg], largest factor).
    """
    xe = np.empty((8, 3))
    shortest, added, top = 1.0e300, 0.0, 1.0
    for a in range(node_mass.shape[0]):
        square = v[a, 0] * v[a, 0] + v[a, 1] * v[a, 1] + v[a, 2] * v[a, 2]
        ledger[ADDED_MASS] -= 0.5 * node_mass[a] * square
        node_mass[a] = 0.0
    for e in range(cells.shape[0]):
        if alive[e] == 0:
            continue
        for n in range(8):
            for i in range(3):
                xe[n, i] = x[cells[e, n], i]
        size = vol[e] / largest_face(xe)
        speed = np.sqrt(stiff * vol[e] / (cell_mass[e] * scaled[e]))
        allowed = safety * size / speed
        if allowed < floor:
            scaled[e] *= (floor / allowed) ** 2
            allowed = floor
        shortest = min(shortest, allowed)
        added += cell_mass[e] * (scaled[e] - 1.0)
        top = max(top, scaled[e])
        for n in range(8):
            node_mass[cells[e, n]] += 0.125 * cell_mass[e] * scaled[e]
    for a in range(node_mass.shape[0]):
        if node_mass[a] == 0.0:  # every element around it is gone: it rests where it is
            node_mass[a] = 1.0
            v[a, 0] = v[a, 1] = v[a, 2] = 0.0
            continue
        square = v[a, 0] * v[a, 0] + v[a, 1] * v[a, 1] + v[a, 2] * v[a, 2]
        ledger[ADDED_MASS] += 0.5 * node_mass[a] * square
    return shortest, added, top
