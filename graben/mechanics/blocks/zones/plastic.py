"""Zones that yield: Mohr-Coulomb with a tension cut-off and dilation, on the stress in the unrotated block.

Green's strain less the plastic strain that the zone keeps gives the stress S by Hooke's law; where S lies outside
the strength, the law of mechanics.materials brings it back, and what it took is plastic strain. S turns with the
block, so rotation of any size does nothing. The strength bounds S, which differs from Cauchy's stress by the stretch
of the zone: at a plastic strain of 1 % by about 1 %.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.zones.elastic import ElasticZones
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.mohr_coulomb import update_mohr_coulomb
from graben.mechanics.unsigned import span

# What a zone does: elastic so far; yields now, by shear or by tension; yielded before; its law found no stress.
ELASTIC, SHEAR, TENSION, PAST, LOST = 0, 1, 2, 3, 4

# Columns of what a zone keeps: plastic strain (shear gamma = 2 eps), and the equivalent plastic strain.
XX, YY, ZZ, GAMMA, EQUIVALENT = range(5)


class Strength(NamedTuple):
    """Mohr-Coulomb strength: angles in rad, stresses in Pa; dilation is at most friction."""

    friction: float
    cohesion: float
    tension: float
    dilation: float = 0.0

    def weaker(self, factor: float) -> Strength:
        """The same with tan(friction), cohesion and tension over a factor; dilation stays at most friction."""
        friction = float(np.arctan(np.tan(self.friction) / factor))
        return Strength(friction, self.cohesion / factor, self.tension / factor, min(self.dilation, friction))


class PlasticZones(NamedTuple):
    """Zones that yield: as ElasticZones, then par of the law, its bounds (`limits`), and what each zone keeps.

    bounds : (4,) sin phi, 2 c cos phi, tensile strength and the slack within which a stress is inside, over its size
    plastic : (zones, 5) plastic strain xx, yy, zz, gamma xy of the unrotated zone, and the equivalent one
    flag : (zones,) int8 of ELASTIC, SHEAR, TENSION, PAST, LOST
    """

    triangles: np.ndarray
    gradient: np.ndarray
    area: np.ndarray
    lam: np.ndarray
    mu: np.ndarray
    par: np.ndarray
    bounds: np.ndarray
    plastic: np.ndarray
    flag: np.ndarray


def plastic_zones(elastic: ElasticZones, young: float, poisson: float, strength: Strength) -> PlasticZones:
    """Zones at rest with a strength; ValueError for values that the law cannot take."""
    par = pack(
        "mohr-coulomb",
        {
            "young_modulus": young,
            "poisson_ratio": poisson,
            "friction_angle": strength.friction,
            "dilation_angle": strength.dilation,
            "cohesion": strength.cohesion,
            "tensile_strength": strength.tension,
        },
    )
    sine, cosine = np.sin(strength.friction), np.cos(strength.friction)
    apex = strength.cohesion * cosine / sine if sine > 0.0 else np.inf
    bounds = np.array([sine, 2.0 * strength.cohesion * cosine, min(strength.tension, apex), 1e-12])
    count = len(elastic.area)
    return PlasticZones(*elastic, par, bounds, np.zeros((count, 5)), np.zeros(count, dtype=np.int8))


@kernel(error_model="numpy")
def _bring_back(z, stress, zones, rest, none):
    """Bring the trial stress (4,) of zone z back to its strength; returns the work taken, per volume [J/m3]."""
    xx, yy, zz, xy = stress[0], stress[1], stress[2], stress[3]
    keep = zones.plastic[z]
    bounds = zones.bounds
    if update_mohr_coulomb(rest, stress, keep[EQUIVALENT:], zones.par, 1.0, none) != 0:
        zones.flag[z] = LOST
        return 0.0
    # Hooke's law the other way round: what the stress lost is plastic strain.
    lost = (xx - stress[0], yy - stress[1], zz - stress[2])
    lam, mu = zones.lam[z], zones.mu[z]
    mean = lam / (3.0 * lam + 2.0 * mu) * (lost[0] + lost[1] + lost[2])
    work = 0.0
    for d in range(3):
        gain = 0.5 * (lost[d] - mean) / mu
        keep[d] += gain
        work += stress[d] * gain
    gain = (xy - stress[3]) / mu
    keep[GAMMA] += gain
    work += stress[3] * gain
    high = 0.5 * (stress[0] + stress[1]) + np.hypot(0.5 * (stress[0] - stress[1]), stress[3])
    high = max(high, stress[2])
    zones.flag[z] = TENSION if high > bounds[2] * (1.0 - 1e-9) - 1e-9 * bounds[1] else SHEAR
    return work


@kernel(error_model="numpy")
def plastic_zone_forces(x, zones, force, begin, end):
    """Add the forces of the zones, rows begin to end, to `force` (vertices, 2) [N/m]; the plastic work [J/m]."""
    triangles, gradient, area = zones.triangles, zones.gradient, zones.area
    lams, mus, plastic, flag = zones.lam, zones.mu, zones.plastic, zones.flag
    sine, term, cut, slack = zones.bounds[0], zones.bounds[1], zones.bounds[2], zones.bounds[3]
    up, down = 1.0 + sine, 1.0 - sine
    stress, rest, none = np.empty(4), np.zeros(4), np.empty((0, 0))
    work = 0.0
    for z in span(begin, end):
        a = triangles[z, 0]
        b = triangles[z, 1]
        c = triangles[z, 2]
        ax = gradient[z, 0, 0]
        ay = gradient[z, 0, 1]
        bx = gradient[z, 1, 0]
        by = gradient[z, 1, 1]
        ux = x[a, 0] - x[c, 0]
        uy = x[a, 1] - x[c, 1]
        wx = x[b, 0] - x[c, 0]
        wy = x[b, 1] - x[c, 1]
        f00 = ux * ax + wx * bx
        f01 = ux * ay + wx * by
        f10 = uy * ax + wy * bx
        f11 = uy * ay + wy * by
        exx = 0.5 * (f00 * f00 + f10 * f10 - 1.0) - plastic[z, XX]
        eyy = 0.5 * (f01 * f01 + f11 * f11 - 1.0) - plastic[z, YY]
        ezz = -plastic[z, ZZ]
        lam, mu = lams[z], mus[z]
        tr = lam * (exx + eyy + ezz)
        sxx = tr + 2.0 * mu * exx
        syy = tr + 2.0 * mu * eyy
        szz = tr + 2.0 * mu * ezz
        sxy = mu * (f00 * f01 + f10 * f11 - plastic[z, GAMMA])
        centre = 0.5 * (sxx + syy)
        half = 0.5 * (sxx - syy)
        radius = np.sqrt(half * half + sxy * sxy)
        high = max(centre + radius, szz)
        low = min(centre - radius, szz)
        if max(high * up - low * down - term, high - cut) > slack * (abs(high) + abs(low) + term):
            stress[0], stress[1], stress[2], stress[3] = sxx, syy, szz, sxy
            work += area[z] * _bring_back(z, stress, zones, rest, none)
            sxx, syy, sxy = stress[0], stress[1], stress[3]
        elif flag[z] == SHEAR or flag[z] == TENSION:
            flag[z] = PAST
        sxx *= area[z]
        syy *= area[z]
        sxy *= area[z]
        p00 = f00 * sxx + f01 * sxy
        p01 = f00 * sxy + f01 * syy
        p10 = f10 * sxx + f11 * sxy
        p11 = f10 * sxy + f11 * syy
        fax = p00 * ax + p01 * ay
        fay = p10 * ax + p11 * ay
        fbx = p00 * bx + p01 * by
        fby = p10 * bx + p11 * by
        force[a, 0] -= fax
        force[a, 1] -= fay
        force[b, 0] -= fbx
        force[b, 1] -= fby
        force[c, 0] += fax + fbx
        force[c, 1] += fay + fby
    return work
