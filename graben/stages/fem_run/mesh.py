"""The mesh that a fem scene asks for: mapped, paved, or read from a file."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.meshes.mapped import mapped_mesh
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.meshes.one_body import NotOneBody, one_body
from graben.mechanics.meshes.paved import paved_mesh
from graben.mechanics.meshes.sizing import SizeField
from graben.schemas.mesh_file import read_plane_mesh
from graben.schemas.scenes.fem import FemScene
from graben.stages.shared.fidelity import factor_of

_log = logging.getLogger(__name__)


def mesh_of(scene: FemScene) -> tuple[QuadMesh, list[str]]:
    """Build or read the mesh; the notes say what of a file was left out or mended.

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
            return paved_mesh(shape, size), []
        return mapped_mesh(shape, np.array(mesh.patches, dtype=np.int64), size), []
    except Refused as error:
        raise BadInput(Fault(file, key, "", f"a domain that can be meshed ({error})")) from None


def size_field(scene: FemScene) -> SizeField:
    """Element sizes that the scene asks for, at its fidelity."""
    mesh = scene.mesh
    factor = factor_of(scene, "mesh.size")
    return SizeField(
        size=factor * mesh.size,
        segments=np.array([[r.start, r.end] for r in mesh.refine], dtype=float).reshape(-1, 2, 2),
        near_size=factor * np.array([r.size for r in mesh.refine], dtype=float),
        growth=np.array([r.growth for r in mesh.refine], dtype=float),
    )


def read_quads(path: Path) -> tuple[QuadMesh, list[str]]:
    """The body of quads in a mesh file, and notes on what was left out or mended.

    Raises
    ------
    BadInput : not readable, cells of another kind, not plane, or not one body of convex quads
    """
    found = read_plane_mesh(path)
    try:
        mesh, mended = one_body(found.points, found.quads, found.numbers)
    except NotOneBody as error:
        raise BadInput(
            [Fault(str(path), "cells", "", f"one body of quads ({fault})") for fault in error.faults]
        ) from None
    notes = [*found.notes, *mended]
    for note in notes:
        _log.info("%s: %s", path.name, note)
    return mesh, notes
