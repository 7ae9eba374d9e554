"""What an assembly is doing: energies, unbalanced force, contacts, stable step."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.particles.motion import FLOOR, PISTON


@kernel
def largest_eigenvalue(k):
    """Of a symmetric 3 x 3 matrix (xx, yy, zz, xy, yz, zx), by the trigonometric formula."""
    mean = (k[0] + k[1] + k[2]) / 3.0
    a, b, c, d, e, f = k[0] - mean, k[1] - mean, k[2] - mean, k[3], k[4], k[5]
    p = np.sqrt((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) / 6.0)
    if p == 0.0:
        return mean
    half_det = 0.5 * (a * (b * c - e * e) - d * (d * c - e * f) + f * (d * e - b * f)) / (p * p * p)
    return mean + 2.0 * p * np.cos(np.arccos(min(1.0, max(-1.0, half_det))) / 3.0)


@kernel
def survey(
    x,
    v,
    spin,
    radius,
    kind,
    mass,
    first,
    partner,
    slip,
    force,
    kn,
    kt,
    wall_kn,
    wall_kt,
    wall_slip,
    rubs,
    periodic,
    width,
    place,
    gravity,
    piston_on,
    floor_force,
    coordination,
    stiffness,
):
    """Sums over all contacts of the present state, springs only.

    Fills floor_force (n,), coordination (n,) with the contacts of each particle (walls included) and stiffness (n,)
    with the largest eigenvalue of the 3 x 3 stiffness that its contacts give it, N/m.
    Returns an array: kinetic, spinning, elastic, potential energy (J), mean contact force, mean net force (N),
    number of contacts, largest overlap over radius, pushes on floor and piston, and the force with which friction on
    the side walls lifts the particles (N).
    """
    n = x.shape[0]
    rows = np.zeros((n, 6))
    kinetic = spinning = elastic = potential = force_sum = net_sum = worst = floor = piston = lift = 0.0
    contacts = 0
    for i in range(n):
        coordination[i] = 0
        floor_force[i] = 0.0
    end_wall = 6 if piston_on else 5
    first_wall = 4 if periodic else 0
    for i in range(n):
        m = mass[kind[i]]
        r = radius[i]
        kinetic += 0.5 * m * (v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2)
        potential += m * gravity * x[i, 2]
        net_sum += np.sqrt(force[i, 0] ** 2 + force[i, 1] ** 2 + force[i, 2] ** 2)
        if rubs:
            spinning += 0.2 * m * r * r * (spin[i, 0] ** 2 + spin[i, 1] ** 2 + spin[i, 2] ** 2)
        for w in range(first_wall, end_wall):
            a = w // 2
            s = 1.0 if w % 2 == 0 else -1.0
            overlap = r - s * (x[i, a] - place[w])
            if overlap > 0.0:
                k = wall_kn[kind[i]]
                elastic += 0.5 * k * overlap * overlap
                if rubs:
                    s2 = wall_slip[i, w, 0] ** 2 + wall_slip[i, w, 1] ** 2 + wall_slip[i, w, 2] ** 2
                    elastic += 0.5 * s2 / wall_kt[kind[i]]
                    if w < FLOOR:
                        lift += wall_slip[i, w, 2]
                rows[i, a] += k
                force_sum += k * overlap
                contacts += 1
                coordination[i] += 1
                worst = max(worst, overlap / r)
                if w == FLOOR:
                    floor_force[i] = k * overlap
                    floor += k * overlap
                elif w == PISTON:
                    piston += k * overlap
        for q in range(first[i], first[i + 1]):
            j = partner[q]
            g0, g1, g2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            if periodic:
                if g0 > 0.5 * width[0]:
                    g0 -= width[0]
                elif g0 < -0.5 * width[0]:
                    g0 += width[0]
                if g1 > 0.5 * width[1]:
                    g1 -= width[1]
                elif g1 < -0.5 * width[1]:
                    g1 += width[1]
            d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            overlap = r + radius[j] - d
            if overlap > 0.0:
                k = kn[kind[i], kind[j]]
                elastic += 0.5 * k * overlap * overlap
                if rubs:
                    elastic += 0.5 * (slip[q, 0] ** 2 + slip[q, 1] ** 2 + slip[q, 2] ** 2) / kt[kind[i], kind[j]]
                force_sum += k * overlap
                contacts += 1
                coordination[i] += 1
                coordination[j] += 1
                worst = max(worst, overlap / min(r, radius[j]))
                scale = k / (d * d)
                for p in (i, np.int64(j)):
                    rows[p, 0] += scale * g0 * g0
                    rows[p, 1] += scale * g1 * g1
                    rows[p, 2] += scale * g2 * g2
                    rows[p, 3] += scale * g0 * g1
                    rows[p, 4] += scale * g1 * g2
                    rows[p, 5] += scale * g2 * g0
    for i in range(n):
        stiffness[i] = largest_eigenvalue(rows[i])
    out = np.empty(11)
    out[0], out[1], out[2], out[3] = kinetic, spinning, elastic, potential
    out[4] = force_sum / max(contacts, 1)
    out[5] = net_sum / max(n, 1)
    out[6], out[7], out[8], out[9], out[10] = float(contacts), worst, floor, piston, lift
    return out


@kernel
def list_contacts(x, radius, kind, first, partner, kn, width, periodic, pair, normal, push):
    """Write the touching pairs: pair (m, 2), unit normal first to second (m, 3), spring force (m,) N; returns m."""
    m = 0
    for i in range(x.shape[0]):
        for q in range(first[i], first[i + 1]):
            j = partner[q]
            g0, g1, g2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            if periodic:
                g0 -= width[0] * np.rint(g0 / width[0])
                g1 -= width[1] * np.rint(g1 / width[1])
            d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            overlap = radius[i] + radius[j] - d
            if overlap > 0.0:
                pair[m, 0], pair[m, 1] = i, j
                normal[m, 0], normal[m, 1], normal[m, 2] = g0 / d, g1 / d, g2 / d
                push[m] = kn[kind[i], kind[j]] * overlap
                m += 1
    return m
