"""Constant-strain triangles, total Lagrangian, plane strain.

The strain is Green's, E = (F^T F - 1) / 2 with F = dx/dX, and S = lambda tr(E) 1 + 2 mu E: no stress and no drift
under rotation of any size. Nodal forces are -A F S grad N, the Cauchy stress is F S F^T / det F.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.errors import Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span


class ElasticZones(NamedTuple):
    """Elastic zones: triangles (zones, 3), gradient and area as of `shape_gradients`, lam and mu (zones,) [Pa]."""

    triangles: np.ndarray
    gradient: np.ndarray
    area: np.ndarray
    lam: np.ndarray
    mu: np.ndarray


def shape_gradients(position: np.ndarray, triangles: np.ndarray):
    """Gradients of the three shape functions (zones, 3, 2) [1/m] and areas (zones,) [m2]."""
    p = position[triangles]
    edge = np.roll(p, -2, axis=1) - np.roll(p, -1, axis=1)  # opposite each corner
    area = 0.5 * (
        (p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1]) - (p[:, 1, 1] - p[:, 0, 1]) * (p[:, 2, 0] - p[:, 0, 0])
    )
    if np.any(area <= 0.0):
        raise Refused(f"zone {int(np.argmin(area))} is turned over or has no area")
    gradient = np.stack([-edge[..., 1], edge[..., 0]], axis=-1) / (2.0 * area)[:, None, None]
    return np.ascontiguousarray(gradient), area


def lame(young: float, poisson: float) -> tuple[float, float]:
    """Lame's constants lambda and mu [Pa]."""
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))


def stiffness_matrices(gradient: np.ndarray, area: np.ndarray, lam: np.ndarray, mu: np.ndarray) -> np.ndarray:
    """Stiffness (zones, 6, 6) of each zone at rest [N/m per m]; rows are x, y of the three corners in turn."""
    g = gradient
    k = np.einsum("z,zia,zjb->ziajb", lam * area, g, g) + np.einsum("z,zib,zja->ziajb", mu * area, g, g)
    dot = np.einsum("z,zid,zjd->zij", mu * area, g, g)
    for a in range(2):
        k[:, :, a, :, a] += dot
    return k.reshape(len(area), 6, 6)


def row_sums(stiffness: np.ndarray) -> np.ndarray:
    """Largest absolute row sum (zones, 3) of each zone's stiffness, per corner [N/m per m]."""
    return np.abs(stiffness).sum(axis=2).reshape(-1, 3, 2).max(axis=2)


@kernel(error_model="numpy")
def zone_forces(x, triangles, gradient, area, lam, mu, force, begin, end):
    """Add the forces of the zones, rows begin to end, on their vertices to `force` (vertices, 2) [N/m]."""
    for z in span(begin, end):
        a = triangles[z, 0]
        b = triangles[z, 1]
        c = triangles[z, 2]
        ax = gradient[z, 0, 0]
        ay = gradient[z, 0, 1]
        bx = gradient[z, 1, 0]
        by = gradient[z, 1, 1]
        # The gradients add up to nothing, so edge vectors from corner c suffice.
        ux = x[a, 0] - x[c, 0]
        uy = x[a, 1] - x[c, 1]
        wx = x[b, 0] - x[c, 0]
        wy = x[b, 1] - x[c, 1]
        f00 = ux * ax + wx * bx
        f01 = ux * ay + wx * by
        f10 = uy * ax + wy * bx
        f11 = uy * ay + wy * by
        exx = 0.5 * (f00 * f00 + f10 * f10 - 1.0)
        eyy = 0.5 * (f01 * f01 + f11 * f11 - 1.0)
        gxy = f00 * f01 + f10 * f11
        tr = lam[z] * (exx + eyy)
        sxx = (tr + 2.0 * mu[z] * exx) * area[z]
        syy = (tr + 2.0 * mu[z] * eyy) * area[z]
        sxy = mu[z] * gxy * area[z]
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


def zone_state(x: np.ndarray, triangles, gradient, area, lam, mu, plastic: np.ndarray | None = None):
    """Cauchy stress (zones, 4) as xx, yy, zz, xy [Pa], and the strain energy of all zones [J/m].

    plastic : (zones, 4 or more) plastic strain xx, yy, zz and gamma xy, taken off Green's strain
    """
    f = np.einsum("zia,zib->zab", x[triangles], gradient)
    strain = np.zeros((len(area), 3, 3))
    strain[:, :2, :2] = 0.5 * (np.einsum("zka,zkb->zab", f, f) - np.eye(2))
    if plastic is not None:
        for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2))):
            strain[:, i, j] -= plastic[:, k]
        strain[:, 0, 1] -= 0.5 * plastic[:, 3]
        strain[:, 1, 0] -= 0.5 * plastic[:, 3]
    s = 2.0 * mu[:, None, None] * strain
    s[:, [0, 1, 2], [0, 1, 2]] += (lam * np.trace(strain, axis1=1, axis2=2))[:, None]
    energy = 0.5 * np.einsum("z,zab,zab->", area, s, strain)
    determinant = f[:, 0, 0] * f[:, 1, 1] - f[:, 0, 1] * f[:, 1, 0]
    cauchy = np.einsum("zab,zbc,zdc->zad", f, s[:, :2, :2], f) / determinant[:, None, None]
    out = np.column_stack([cauchy[:, 0, 0], cauchy[:, 1, 1], s[:, 2, 2] / determinant, cauchy[:, 0, 1]])
    return out, float(energy)
