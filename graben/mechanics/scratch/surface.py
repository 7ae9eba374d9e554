"""Exposed faces of the remaining material, and the contact nodes and stiffness that they give."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.elements.hex8 import FACES
from graben.mechanics.scratch.mesh import Floats, HexMesh, Ints


def exposed_faces(mesh: HexMesh, alive: NDArray[np.int64]) -> tuple[Ints, Ints]:
    """Faces (m, 4) that belong to one living element and are free to be touched, and their elements (m,).

    Faces on held boundaries and on the plane of symmetry are left out. Nodes run counter-clockwise seen from
    outside.
    """
    living = np.flatnonzero(alive)
    faces = mesh.cells[living][:, FACES].reshape(-1, 4)
    owners = np.repeat(living, 6)
    key = np.sort(faces, axis=1)
    n = np.int64(len(mesh.points))
    # the first three sorted nodes of a brick's face name it
    code = (key[:, 0] * n + key[:, 1]) * n + key[:, 2]
    _, first, counts = np.unique(code, return_index=True, return_counts=True)
    single = np.sort(first[counts == 1])
    faces, owners = faces[single], owners[single]
    held = (mesh.free[faces] == 0.0).all(axis=1).any(axis=1)
    return np.ascontiguousarray(faces[~held]), np.ascontiguousarray(owners[~held])


def bared_supports(mesh: HexMesh, alive: NDArray[np.int64]) -> Ints:
    """Faces (m, 4) of removed elements on held boundaries, turned towards the void: with the exposed faces they
    close the surface of a specimen that is worn through."""
    if alive.all():
        return np.empty((0, 4), dtype=np.int64)
    faces = mesh.cells[alive == 0][:, FACES].reshape(-1, 4)
    held = (mesh.free[faces] == 0.0).all(axis=(1, 2))
    key = np.sort(faces[held], axis=1)
    _, first, counts = np.unique(key, axis=0, return_index=True, return_counts=True)
    return np.ascontiguousarray(faces[held][np.sort(first[counts == 1])][:, ::-1])


def contact_stiffness(
    mesh: HexMesh, faces: Ints, owners: Ints, volumes: Floats, modulus: float, factor: float
) -> tuple[Ints, Floats]:
    """Contact nodes (c,) and penalty stiffness (c,) N/m: factor * modulus * area^2 / volume per face, spread evenly.

    Areas and volumes are those of the first shape, so that the penalty is a potential.
    """
    p = mesh.points[faces]
    normal = 0.5 * np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    area = np.linalg.norm(normal, axis=1)
    share = 0.25 * factor * modulus * area**2 / volumes[owners]
    total = np.zeros(len(mesh.points))
    np.add.at(total, faces.ravel(), np.repeat(share, 4))
    nodes = np.flatnonzero(total > 0.0).astype(np.int64)
    return nodes, np.ascontiguousarray(total[nodes])
