"""Explicit central differences: many steps in one compiled call, and the refresh of the time step between calls."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.continuum.scratch.contact import sphere_contact
from graben.mechanics.continuum.scratch.eight_points import forces_eight_points
from graben.mechanics.continuum.scratch.geometry import largest_face
from graben.mechanics.continuum.scratch.motion import tip_position
from graben.mechanics.continuum.scratch.one_point import ADDED_MASS, DAMPING, EXTERNAL, KINETIC, forces_one_point


@kernel(error_model="numpy")
def advance(
    steps,
    clock,
    x,
    v,
    force,
    node_mass,
    free,
    cells,
    g0,
    alive,
    vol,
    cell_mass,
    rot,
    sig,
    state,
    hour,
    law,
    par,
    step_slot,
    per_work,
    shear,
    chi,
    viscous,
    wave,
    damping,
    surface,
    stiffness,
    shear_ratio,
    tangent,
    tip,
    origin,
    phases,
    radius,
    friction,
    contact_force,
    mean_force,
    ledger,
):
    """Take `steps` steps of clock[1] seconds. Everything changes in place; positions x (n, 3), velocities v (n, 3).

    clock (3,): time, dt, and the dt before it. force (n, 3) holds the forces at x on entry and on return.
    step_slot >= 0: par[step_slot] is set to per_work times the external work of the step before (rate limit of
    damage, H 6.98). damping [1/s] is proportional to mass. mean_force (3,) is the tip force averaged over the steps.
    Returns (code, element, step, nodes in contact); code 0 when all steps were taken.
    """
    n = x.shape[0]
    step = np.zeros((n, 3))
    tip_step, next_tip, before = np.zeros(3), np.zeros(3), np.zeros(3)
    mean_force[:] = 0.0
    touching = 0
    work_before = ledger[EXTERNAL]
    for s in range(steps):
        dt = clock[1]
        span = 0.5 * (clock[1] + clock[2])
        keep = 1.0 - damping * span
        lost = 0.0
        for a in range(n):
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
        clock[0] += dt
        clock[2] = dt
        tip_position(clock[0], phases, origin, next_tip)
        for i in range(3):
            tip_step[i] = next_tip[i] - tip[i]
            tip[i] = next_tip[i]
            before[i] = contact_force[i]
        if step_slot >= 0:
            par[step_slot] = min(1.0, max(0.0, per_work * (ledger[EXTERNAL] - work_before)))
            work_before = ledger[EXTERNAL]
        if g0.shape[1] == 1:
            code, element = forces_one_point(
                x, step, cells, g0, alive, vol, cell_mass, rot, sig, state, hour, law, par, shear, chi, viscous, wave,
                dt, force, ledger,
            )  # fmt: skip
        else:
            code, element = forces_eight_points(
                x, step, cells, g0, alive, vol, cell_mass, rot, sig, state, law, par, viscous, wave, dt, force, ledger
            )
        if code != 0:
            return code, element, s, touching
        touching = sphere_contact(
            x, step, surface, stiffness, shear_ratio, tangent, tip, tip_step, radius, friction, force, contact_force,
            ledger,
        )  # fmt: skip
        for i in range(3):
            ledger[EXTERNAL] += 0.5 * (before[i] + contact_force[i]) * tip_step[i]
            mean_force[i] += contact_force[i] / steps
    kinetic = 0.0
    half = 0.5 * clock[1]
    for a in range(n):
        for i in range(3):
            now = free[a, i] * (v[a, i] + half * force[a, i] / node_mass[a])
            kinetic += 0.5 * node_mass[a] * now * now
    ledger[KINETIC] = kinetic
    return 0, -1, steps, touching


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
