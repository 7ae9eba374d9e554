"""Isoparametric elements in plane strain: strain matrices of their points, with mean dilatation (B-bar).

The in-plane volume strain of each point is replaced by its mean over the element, so that nearly
incompressible and plastically isochoric states do not lock. The correction is shared out over xx and yy only:
eps_zz stays exactly zero at every point, as plane strain asks.
Small strains; strain and stress components are (xx, yy, zz, xy), shear strain engineering (gamma_xy).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused


@dataclass(frozen=True)
class PlaneElements:
    """What e elements of one kind, with g points and a nodes, need for their integrals; computed once.

    Attributes
    ----------
    strain_matrix : (e, g, 3, 2 a) rows eps_xx, eps_yy, gamma_xy per point; columns ux0, uy0, ux1, ...
    weight : (e, g) area that each point stands for, m2
    length : (e,) characteristic length sqrt(area), m, handed to the constitutive law
    """

    strain_matrix: np.ndarray
    weight: np.ndarray
    length: np.ndarray


def plane_elements(nodes: np.ndarray, derivatives: np.ndarray, mean_dilatation: bool = True) -> PlaneElements:
    """Strain matrices and weights of elements with points of weight 1.

    Parameters
    ----------
    nodes : (e, a, 2) m
    derivatives : (g, a, 2) of the shape functions at the points, in local coordinates
    mean_dilatation : False gives the plain element (it locks; kept for tests)

    Raises
    ------
    Refused : an element is turned over, or not convex
    """
    jacobian = np.einsum("gai,eaj->egij", derivatives, nodes)  # dx_j / dxi_i
    determinant = np.linalg.det(jacobian)
    if np.any(determinant <= 0):
        bad = int(np.argmin(determinant.min(axis=1)))
        raise Refused(f"element {bad} is turned over or not convex")
    gradient = np.einsum("egij,gaj->egai", np.linalg.inv(jacobian), derivatives)
    matrix = np.zeros((*determinant.shape, 3, 2 * nodes.shape[1]))
    matrix[:, :, 0, 0::2] = gradient[..., 0]
    matrix[:, :, 1, 1::2] = gradient[..., 1]
    matrix[:, :, 2, 0::2] = gradient[..., 1]
    matrix[:, :, 2, 1::2] = gradient[..., 0]
    if mean_dilatation:
        dilatation = matrix[:, :, 0] + matrix[:, :, 1]
        mean = np.einsum("eg,egc->ec", determinant, dilatation) / determinant.sum(axis=1)[:, None]
        correction = 0.5 * (mean[:, None] - dilatation)
        matrix[:, :, 0] += correction
        matrix[:, :, 1] += correction
    return PlaneElements(
        strain_matrix=np.ascontiguousarray(matrix),
        weight=np.ascontiguousarray(determinant),
        length=np.sqrt(determinant.sum(axis=1)),
    )
