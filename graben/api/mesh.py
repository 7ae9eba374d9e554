"""Meshes of quads for `plane_analysis`: a rectangle, mapped patches, any polygon, or a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from graben.api.units import si
from graben.errors import BadInput, Fault, Refused
from graben.mechanics.meshes.mapped import mapped_mesh
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.meshes.paved import paved_mesh
from graben.mechanics.meshes.sizing import SizeField

__all__ = ["QuadMesh", "mapped", "paved", "read", "rectangle"]

Refinements = Sequence[Mapping[str, Any]]


def rectangle(width: float | str, height: float | str, size: float | str, refine: Refinements = ()) -> QuadMesh:
    """An upright rectangle with its lower left corner at (0, 0).

    Parameters
    ----------
    width, height, size : sides and element size, numbers in m or text with a unit
    refine : as in `mapped`

    Raises
    ------
    BadInput : lengths that make no mesh
    """
    w, h = si(width, "m", "width"), si(height, "m", "height")
    return mapped([(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)], [(0, 1, 2, 3)], size, refine)


def mapped(
    corners: ArrayLike, patches: Sequence[Sequence[int]], size: float | str, refine: Refinements = ()
) -> QuadMesh:
    """Structured grids in convex quadrilateral patches, which meet along whole sides.

    Parameters
    ----------
    corners : (c, 2) corner points, m
    patches : (p, 4) corner numbers from 0, in order around each patch
    size : element size away from refinements
    refine : smaller elements near segments: tables of start (x, y), end (x, y), size, and growth (0.1) of the size
        per metre of distance

    Returns
    -------
    a mesh with ``points`` (n, 2) m and ``quads`` (e, 4), counter-clockwise

    Raises
    ------
    BadInput : patches that cannot be meshed
    """
    try:
        return mapped_mesh(np.array(corners, dtype=float), np.array(patches, dtype=np.int64), _field(size, refine))
    except Refused as error:
        raise BadInput(Fault("", "patches", "", f"a domain that can be meshed ({error})", True)) from None


def paved(outline: ArrayLike, size: float | str, refine: Refinements = ()) -> QuadMesh:
    """Quads in any simple polygon, graded by size.

    Parameters
    ----------
    outline : (c, 2) corner points in order, m
    size, refine : as in `mapped`

    Raises
    ------
    BadInput : an outline that crosses itself or cannot be followed
    """
    try:
        return paved_mesh(np.array(outline, dtype=float), _field(size, refine))
    except Refused as error:
        raise BadInput(Fault("", "outline", "", f"a domain that can be meshed ({error})", True)) from None


def read(path: str | Path) -> QuadMesh:
    """The quads of a file that meshio reads, coordinates in m; BadInput where they are no body of plane quads."""
    from graben.stages.fem_run.mesh import read_quads

    return read_quads(Path(path))[0]


def _field(size: float | str, refine: Refinements) -> SizeField:
    ends = np.array([[r["start"], r["end"]] for r in refine], dtype=float).reshape(-1, 2, 2)
    near = np.array([si(r["size"], "m", "refine.size") for r in refine], dtype=float)
    growth = np.array([float(r.get("growth", 0.1)) for r in refine], dtype=float)
    try:
        return SizeField(si(size, "m", "size"), ends, near, growth)
    except Refused as error:
        raise BadInput(Fault("", "size", "", f"sizes above zero ({error})", True)) from None
