"""The mesh that a fem scene asks for: mapped, paved, or read from a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.continuum.mapped import mapped_mesh
from graben.mechanics.continuum.mesh2d import QuadMesh, orient
from graben.mechanics.continuum.paved import paved_mesh
from graben.mechanics.continuum.sizing import SizeField
from graben.schemas.scenes.fem import FemScene


def mesh_of(scene: FemScene) -> QuadMesh:
    """Build or read the mesh.

    Raises
    ------
    BadInput : patches or outline cannot be meshed, or the file holds no plane quads
    """
    mesh, file = scene.mesh, str(scene.source.path)
    size = size_field(scene)
    if mesh.method == "file":
        assert mesh.file is not None  # the scene's own check
        return read_quads(mesh.file)
    shape = np.array(mesh.outline if mesh.method == "paved" else mesh.corners, dtype=float)
    key = "mesh.outline" if mesh.method == "paved" else "mesh.patches"
    try:
        if mesh.method == "paved":
            return paved_mesh(shape, size)
        return mapped_mesh(shape, np.array(mesh.patches, dtype=np.int64), size)
    except Refused as error:
        raise BadInput(Fault(file, key, "", f"a domain that can be meshed ({error})")) from None


def size_field(scene: FemScene) -> SizeField:
    """Element sizes that the scene asks for, at its fidelity."""
    mesh = scene.mesh
    factor = {"draft": mesh.draft_factor, "standard": 1.0, "reference": mesh.reference_factor}[scene.fidelity]
    return SizeField(
        size=factor * mesh.size,
        segments=np.array([[r.start, r.end] for r in mesh.refine], dtype=float).reshape(-1, 2, 2),
        near_size=factor * np.array([r.size for r in mesh.refine], dtype=float),
        growth=np.array([r.growth for r in mesh.refine], dtype=float),
    )


def read_quads(path: Path) -> QuadMesh:
    """4-node quads of a mesh file in any format that meshio reads; other cells are ignored.

    Raises
    ------
    BadInput : not readable, no quads, not plane, or elements that are not convex
    """
    import meshio

    try:
        read = meshio.read(path)
    except (SystemExit, Exception) as error:  # meshio raises many kinds, and exits on an unknown suffix
        raise BadInput(Fault(str(path), "", "", f"a mesh file that meshio reads ({error})")) from None
    blocks = [cells.data for cells in read.cells if cells.type == "quad"]
    if not blocks:
        found = ", ".join(sorted({c.type for c in read.cells})) or "no cells"
        raise BadInput(Fault(str(path), "cells", found, "4-node quads"))
    points = np.asarray(read.points, dtype=float)
    if points.shape[1] == 3 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points[:, :2], axis=0).max():
        raise BadInput(Fault(str(path), "points", "z varies", "a plane mesh in x and y"))
    try:
        return orient(points, np.concatenate(blocks))
    except Refused as error:
        raise BadInput(Fault(str(path), "cells", "", f"convex quads ({error})")) from None
