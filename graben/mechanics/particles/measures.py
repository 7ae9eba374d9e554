"""What an assembly is doing: energies, unbalanced force, contacts, stable step."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.particles.dispatch import normal, normal_energy, shear_energy, stiffness


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
def _add_stiffness(k, scale, g0, g1, g2):
    """Add scale times the outer product of a vector with itself to k (xx, yy, zz, xy, yz, zx)."""
    k[0] += scale * g0 * g0
    k[1] += scale * g1 * g1
    k[2] += scale * g2 * g2
    k[3] += scale * g0 * g1
    k[4] += scale * g1 * g2
    k[5] += scale * g2 * g0


@kernel
def survey(bodies, contacts, slip, walls, wall_slip, force, laws, drive, period, floor_force, coordination, hardest):
    """Sums over all contacts of the present state, springs only.

    Fills floor_force (n,), coordination (n,) with the contacts of each particle (walls included) and hardest (n,)
    with the largest eigenvalue of the 3 x 3 stiffness that its contacts give it, N/m.
    Returns an array: kinetic, spinning, elastic, potential energy (J), mean contact force, mean net force (N),
    number of contacts, largest overlap over radius, pushes on floor and piston, and the force against gravity with
    which friction on the side walls, the rows before the floor, lifts the particles (N).
    """
    x, v, spin, radius, mass, kind = (
        bodies.position, bodies.velocity, bodies.spin, bodies.radius, bodies.mass, bodies.kind,
    )  # fmt: skip
    first, partner = contacts.first, contacts.partner
    g = drive.gravity
    weight = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
    n = x.shape[0]
    rows = np.zeros((n, 6))
    kinetic = spinning = elastic = potential = force_sum = net_sum = worst = floor = piston = lift = 0.0
    contacts_found = 0
    for i in range(n):
        coordination[i] = 0
        floor_force[i] = 0.0
    for i in range(n):
        m, r, c = mass[i], radius[i], kind[i]
        kinetic += 0.5 * m * (v[i, 0] ** 2 + v[i, 1] ** 2 + v[i, 2] ** 2)
        potential -= m * g[0] * x[i, 0] + m * g[1] * x[i, 1] + m * g[2] * x[i, 2]
        net_sum += np.sqrt(force[i, 0] ** 2 + force[i, 1] ** 2 + force[i, 2] ** 2)
        if slip is not None:
            spinning += 0.2 * m * r * r * (spin[i, 0] ** 2 + spin[i, 1] ** 2 + spin[i, 2] ** 2)
        for w in range(walls.push.shape[0]):
            n0, n1, n2 = walls.normal[w, 0], walls.normal[w, 1], walls.normal[w, 2]
            p0, p1, p2 = walls.point[w, 0], walls.point[w, 1], walls.point[w, 2]
            overlap = r - (n0 * (x[i, 0] - p0) + n1 * (x[i, 1] - p1) + n2 * (x[i, 2] - p2))
            if overlap > 0.0:
                b = walls.kind[w]
                spring, _ = normal(laws.walls, c, b, overlap, 0.0)
                elastic += normal_energy(laws.walls, c, b, overlap)
                if wall_slip is not None:
                    s0, s1, s2 = wall_slip[i, w, 0], wall_slip[i, w, 1], wall_slip[i, w, 2]
                    elastic += shear_energy(laws.walls, c, b, overlap, s0**2 + s1**2 + s2**2)
                    if w < drive.floor and weight > 0.0:
                        lift -= s0 * (g[0] / weight) + s1 * (g[1] / weight) + s2 * (g[2] / weight)
                _add_stiffness(rows[i], stiffness(laws.walls, c, b, overlap), n0, n1, n2)
                force_sum += spring
                contacts_found += 1
                coordination[i] += 1
                worst = max(worst, overlap / r)
                if w == drive.floor:
                    floor_force[i] = spring
                    floor += spring
                elif w == drive.piston:
                    piston += spring
        for q in range(first[i], first[i + 1]):
            j = partner[q]
            g0, g1, g2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            if period is not None:
                if g0 > 0.5 * period[0]:
                    g0 -= period[0]
                elif g0 < -0.5 * period[0]:
                    g0 += period[0]
                if g1 > 0.5 * period[1]:
                    g1 -= period[1]
                elif g1 < -0.5 * period[1]:
                    g1 += period[1]
            d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            overlap = r + radius[j] - d
            if overlap > 0.0:
                b = kind[j]
                spring, _ = normal(laws.pairs, c, b, overlap, 0.0)
                elastic += normal_energy(laws.pairs, c, b, overlap)
                if slip is not None:
                    size2 = slip[q, 0] ** 2 + slip[q, 1] ** 2 + slip[q, 2] ** 2
                    elastic += shear_energy(laws.pairs, c, b, overlap, size2)
                force_sum += spring
                contacts_found += 1
                coordination[i] += 1
                coordination[j] += 1
                worst = max(worst, overlap / min(r, radius[j]))
                scale = stiffness(laws.pairs, c, b, overlap) / (d * d)
                _add_stiffness(rows[i], scale, g0, g1, g2)
                _add_stiffness(rows[j], scale, g0, g1, g2)
    for i in range(n):
        hardest[i] = largest_eigenvalue(rows[i])
    out = np.empty(11)
    out[0], out[1], out[2], out[3] = kinetic, spinning, elastic, potential
    out[4] = force_sum / max(contacts_found, 1)
    out[5] = net_sum / max(n, 1)
    out[6], out[7], out[8], out[9], out[10] = float(contacts_found), worst, floor, piston, lift
    return out


@kernel
def list_contacts(bodies, contacts, law, period, pair, facing, push):
    """Write the touching pairs: pair (m, 2), unit normal first to second (m, 3), spring force (m,) N; returns m."""
    x, radius, kind, first, partner = bodies.position, bodies.radius, bodies.kind, contacts.first, contacts.partner
    m = 0
    for i in range(x.shape[0]):
        for q in range(first[i], first[i + 1]):
            j = partner[q]
            g0, g1, g2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
            if period is not None:
                g0 -= period[0] * np.rint(g0 / period[0])
                g1 -= period[1] * np.rint(g1 / period[1])
            d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
            overlap = radius[i] + radius[j] - d
            if overlap > 0.0:
                pair[m, 0], pair[m, 1] = i, j
                facing[m, 0], facing[m, 1], facing[m, 2] = g0 / d, g1 / d, g2 / d
                push[m], _ = normal(law, kind[i], kind[j], overlap, 0.0)
                m += 1
    return m
