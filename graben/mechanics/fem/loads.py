"""Loads of a mesh as nodal forces: weight, and tractions on parts of its outline."""

from __future__ import annotations

import numpy as np

from graben.errors import Refused
from graben.mechanics.elements.quad4 import GAUSS, shape_functions
from graben.mechanics.meshes.mesh2d import QuadMesh


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
