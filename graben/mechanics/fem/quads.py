"""4-node plane-strain quadrilateral with 2 x 2 Gauss points and mean dilatation (B-bar).

The in-plane volume strain of each point is replaced by its mean over the element, so that nearly
incompressible and plastically isochoric states do not lock. The correction is shared out over xx and yy only:
eps_zz stays exactly zero at every point, as plane strain asks.
Small strains; strain and stress components are (xx, yy, zz, xy), shear strain engineering (gamma_xy).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.meshes.mesh2d import QuadMesh

_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
GAUSS = _CORNERS / np.sqrt(3.0)


@dataclass(frozen=True)
class QuadElements:
    """What a mesh of quads needs for its integrals; small strain, so computed once.

    Attributes
    ----------
    strain_matrix : (e, 4, 3, 8) rows eps_xx, eps_yy, gamma_xy per Gauss point; columns ux0, uy0, ux1, ...
    weight : (e, 4) area that each Gauss point stands for, m2
    length : (e,) characteristic length sqrt(area), m, handed to the constitutive law
    dofs : (e, 8) degrees of freedom of each element
    """

    strain_matrix: np.ndarray
    weight: np.ndarray
    length: np.ndarray
    dofs: np.ndarray


def shape_functions(local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (g, 4) and local derivatives (g, 4, 2) of the bilinear shape functions at local points (g, 2)."""
    a, b = 1.0 + local[:, None, 0] * _CORNERS[:, 0], 1.0 + local[:, None, 1] * _CORNERS[:, 1]
    derivatives = 0.25 * np.stack([_CORNERS[:, 0] * b, _CORNERS[:, 1] * a], axis=-1)
    return 0.25 * a * b, derivatives


def quad_elements(mesh: QuadMesh, mean_dilatation: bool = True) -> QuadElements:
    """Strain matrices and weights; `mean_dilatation=False` gives the plain element (it locks; kept for tests)."""
    corners = mesh.points[mesh.quads]  # (e, 4, 2)
    _, local = shape_functions(GAUSS)
    jacobian = np.einsum("gai,eaj->egij", local, corners)  # dx_j / dxi_i
    determinant = np.linalg.det(jacobian)
    if np.any(determinant <= 0):
        bad = int(np.argmin(determinant.min(axis=1)))
        raise Refused(f"element {bad} is turned over or not convex")
    gradient = np.einsum("egij,gaj->egai", np.linalg.inv(jacobian), local)
    matrix = np.zeros((len(corners), 4, 3, 8))
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
    dofs = np.stack([2 * mesh.quads, 2 * mesh.quads + 1], axis=-1).reshape(-1, 8)
    return QuadElements(
        strain_matrix=np.ascontiguousarray(matrix),
        weight=np.ascontiguousarray(determinant),
        length=np.sqrt(determinant.sum(axis=1)),
        dofs=np.ascontiguousarray(dofs, dtype=np.int64),
    )


def body_force(mesh: QuadMesh, density: float, acceleration: np.ndarray) -> np.ndarray:
    """Nodal forces (2 n,), N/m, of a body force density * acceleration (2,), m/s2; consistent with the shapes."""
    values, local = shape_functions(GAUSS)
    corners = mesh.points[mesh.quads]
    determinant = np.linalg.det(np.einsum("gai,eaj->egij", local, corners))
    nodal_mass = density * np.einsum("ga,eg->ea", values, determinant)
    force = np.zeros((len(mesh.points), 2))
    for axis in range(2):
        force[:, axis] = np.bincount(
            mesh.quads.ravel(), (nodal_mass * acceleration[axis]).ravel(), minlength=len(mesh.points)
        )
    return force.ravel()


def edge_traction(
    mesh: QuadMesh, start: np.ndarray, end: np.ndarray, traction: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """Nodal forces (2 n,), N/m, of a uniform load on the part of the outline that lies on a segment.

    Element edges that the segment's ends cut are loaded on their covered part only, so the mesh need not have
    nodes at the ends.

    Parameters
    ----------
    start, end : (2,) ends of the segment, m
    traction : (2,) traction, Pa; None for a unit pressure (1 Pa, pushing into the material)

    Returns
    -------
    force (2 n,) and the loaded length, m

    Raises
    ------
    Refused : the outline covers less than the whole segment
    """
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    span = float(np.hypot(*(end - start)))
    if not span > 0:
        raise Refused("a loaded segment needs two different ends")
    direction = (end - start) / span
    edges = mesh.boundary_edges()
    a, b = mesh.points[edges[:, 0]] - start, mesh.points[edges[:, 1]] - start
    tolerance = 1e-6 * mesh.diameter()

    def offset(p: np.ndarray) -> np.ndarray:
        return np.abs(p[:, 0] * direction[1] - p[:, 1] * direction[0])

    s, t = a @ direction, b @ direction
    low, high = np.clip(np.minimum(s, t), 0.0, span), np.clip(np.maximum(s, t), 0.0, span)
    loaded = np.flatnonzero((offset(a) < tolerance) & (offset(b) < tolerance) & (high - low > tolerance))
    covered = float((high - low)[loaded].sum())
    if abs(covered - span) > 1e-6 * span + 2 * tolerance:
        raise Refused(
            f"the outline covers {covered:.6g} m of the {span:.6g} m between "
            f"({start[0]:g}, {start[1]:g}) and ({end[0]:g}, {end[1]:g})"
        )
    force = np.zeros((len(mesh.points), 2))
    for k in loaded:
        i, j = edges[k]
        edge = mesh.points[j] - mesh.points[i]
        length = np.hypot(*edge)
        # Material lies on the left of an edge, so its inward normal is the edge turned left.
        pull = np.array([-edge[1], edge[0]]) / length if traction is None else np.asarray(traction, dtype=float)
        x = np.sort((np.array([low[k], high[k]]) - s[k]) / (t[k] - s[k]))
        share_j = 0.5 * (x[1] ** 2 - x[0] ** 2) * length
        force[j] += share_j * pull
        force[i] += ((x[1] - x[0]) * length - share_j) * pull
    return force.ravel(), covered
