"""Plane meshes of 4-node quads read from files: Abaqus decks, and every format that meshio reads."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.schemas.abaqus_deck import Block, read_deck
from graben.schemas.reading import read_bytes

# Formats whose own programs number cells from 0; the others number from 1.
_FROM_ZERO = (".vtu", ".vtk", ".xdmf", ".xmf")
_CURES = {
    "triangle": "triangles are not computed yet: recombine them to quads "
    "(Gmsh: Recombine Surface, with Mesh.SubdivisionAlgorithm = 1 none are left)",
    "quad": "quads of second order are not computed yet: write the mesh in first order (Gmsh: Mesh.ElementOrder = 1)",
    "CAX": "an axisymmetric body is not one in plane strain",
}
_CORNERS = {"quad": [0, 1, 2, 3], "polygon4": [0, 1, 2, 3], "pixel": [0, 1, 3, 2]}


@dataclass(frozen=True)
class PlaneMesh:
    """Quads of a file as they stand in it.

    points : (n, 2) m
    quads : (e, 4) rows of the points
    numbers : (e,) the elements' numbers in the file: labels, or places in the file's own count
    notes : what was left out or read otherwise than the file says
    """

    points: np.ndarray
    quads: np.ndarray
    numbers: np.ndarray
    notes: list[str]


def read_plane_mesh(path: Path) -> PlaneMesh:
    """All 4-node quads of a mesh file; lines and points of its outline are left out with a note.

    Raises
    ------
    BadInput : not readable, cells of another kind (named with count and place), no quads, or not in the x-y plane
    """
    points, blocks, notes = read_deck(path) if path.suffix.lower() == ".inp" else _by_meshio(path)
    faults, quads = [], []
    for block in blocks:
        if block.kind in _CORNERS:
            if len(block.corners) and block.corners.shape[1] <= max(_CORNERS[block.kind]):
                expected = f"at least {max(_CORNERS[block.kind]) + 1} corners a cell"
                faults.append(
                    Fault(str(path), "cells", f"{block.name} of {block.corners.shape[1]} corners", expected)
                )
            quads.append(block)
        elif block.kind.startswith(("vertex", "line")):
            notes.append(f"{len(block.corners)} cells of kind {block.name} are left out")
        elif len(block.corners):
            faults.append(_other_kind(path, points, block))
    if faults:
        raise BadInput(faults)
    corners = [b.corners[:, _CORNERS[b.kind]] for b in quads if len(b.corners)]
    if not corners:
        found = ", ".join(sorted({b.name for b in blocks})) or "no cells"
        raise BadInput(Fault(str(path), "cells", found, "4-node quads"))
    connected = np.concatenate(corners)
    if connected.min() < 0 or connected.max() >= len(points):
        bad = f"node {connected.min() if connected.min() < 0 else connected.max()} (from 0)"
        raise BadInput(Fault(str(path), "cells", bad, f"corners among the {len(points)} nodes of the file"))
    _refuse_other_planes(path, points[np.unique(connected)])
    return PlaneMesh(points[:, :2], connected, np.concatenate([b.numbers for b in quads if len(b.corners)]), notes)


def read_by_meshio(path: Path) -> Any:
    """A file as meshio reads it; what meshio prints goes into the error, not to stdout.

    Raises
    ------
    BadInput : unknown suffix, or not what the suffix says
    """
    import meshio

    said = io.StringIO()
    try:
        head = read_bytes(path, "mesh file")[:64]
        if not head:
            raise BadInput(Fault(str(path), "", "", "a mesh file (this one is empty)"))
        form = "gmsh" if head.lstrip().startswith(b"$MeshFormat") else None
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path, file_format=form)
    except BadInput:
        raise
    except (SystemExit, Exception) as error:  # meshio raises many kinds, and prints before it exits
        told = [line for line in said.getvalue().splitlines() if line.strip() and not line.startswith("Error:")]
        told += [] if isinstance(error, SystemExit) else [str(error)]
        reason = (
            " ".join(" ".join(told).split()) or f"its content is not that of a {path.suffix} file, or it is damaged"
        )
        raise BadInput(Fault(str(path), "", "", f"a mesh file that meshio reads ({reason})")) from None


def _by_meshio(path: Path) -> tuple[np.ndarray, list[Block], list[str]]:
    read = read_by_meshio(path)
    points = np.asarray(read.points, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise BadInput(Fault(str(path), "points", f"shape {points.shape}", "points with two or three coordinates"))
    if points.shape[1] == 2:
        points = np.pad(points, ((0, 0), (0, 1)))
    blocks: list[Block] = []
    number = 0 if path.suffix.lower() in _FROM_ZERO else 1
    for cells in read.cells:
        count = len(cells.data)
        kind, corners = str(cells.type), np.asarray(cells.data) if count else np.zeros((0, 1), dtype=np.int64)
        kind = f"polygon{corners.shape[1]}" if kind == "polygon" else kind
        blocks.append(Block(kind, kind, corners, number + np.arange(count)))
        number += count
    return points, _joined(blocks), []


def _joined(blocks: list[Block]) -> list[Block]:
    """One block for each kind, so that each is named once."""
    joined = []
    for kind in dict.fromkeys(b.kind for b in blocks):
        same = [b for b in blocks if b.kind == kind and len(b.corners)]
        if same:
            corners, numbers = (np.concatenate([getattr(b, n) for b in same]) for n in ("corners", "numbers"))
            joined.append(Block(kind, kind, corners, numbers))
    return joined


def _other_kind(path: Path, points: np.ndarray, block: Block) -> Fault:
    cure = next(
        (text for start, text in _CURES.items() if block.kind.startswith(start)), "a plane mesh holds no others"
    )
    first = np.asarray(block.corners[0], dtype=np.int64)
    where = ""
    if len(first) and first.min() >= 0 and first.max() < len(points):
        x, y, _ = points[first].mean(axis=0)
        where = f" near ({x:.6g}, {y:.6g})"
    found = f"{len(block.corners)} of kind {block.name}, the first number {block.numbers[0]}{where}"
    return Fault(str(path), "cells", found, f"4-node quads only; {cure}")


def _refuse_other_planes(path: Path, points: np.ndarray) -> None:
    """Points (n, 3) that are used must be finite and lie in a plane of constant z."""
    if not np.all(np.isfinite(points)):
        raise BadInput(Fault(str(path), "points", "nan or infinity", "finite coordinates"))
    extent = np.ptp(points, axis=0)
    if extent[2] <= 1e-6 * extent.max():
        return
    flat = [axis for axis, size in zip("xyz", extent) if size <= 1e-6 * extent.max()]
    found = (
        f"a mesh in the plane of constant {flat[0]}"
        if flat
        else f"z from {points[:, 2].min():g} to {points[:, 2].max():g}"
    )
    raise BadInput(Fault(str(path), "points", found, "a plane mesh in x and y, with y upwards and constant z"))
