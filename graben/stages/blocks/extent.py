"""How large the body of a scene is, known before its blocks are made.

A map lies where it lies and has its own size: the rectangle of [domain] says nothing of it unless the scene asks for
that size. So every check that needs the size of the body takes it from here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.plane.polygons import signed_area
from graben.schemas.polygon_file import Polygons, read_polygons
from graben.schemas.scenes.blocks import BlocksScene


class Extent(NamedTuple):
    """Of the box around the body [m], and its area [m2]; blocks : polygons of a map, None where blocks are made."""

    width: float
    height: float
    area: float
    blocks: int | None = None


def map_of(scene: BlocksScene) -> Polygons | None:
    """The polygons of a scene's file; None where blocks are made."""
    t = scene.tessellation
    return read_polygons(t.file) if t.method == "file" and t.file is not None else None


def extent_of(scene: BlocksScene, given: Polygons | None) -> Extent:
    """Extent of the map, where the domain has no outline; else of the domain.

    Raises
    ------
    BadInput : the scene asks of the map what fits no body of its size
    """
    blocks = None if given is None else len(given.rings)
    if given is None or scene.domain.outline is not None:
        corners = np.array(scene.domain.corners)
        width, height = np.ptp(corners, axis=0).tolist()
        return Extent(width, height, abs(signed_area(corners - corners[0])), blocks)
    points = np.vstack(given.rings)
    width, height = np.ptp(points, axis=0).tolist() if len(points) else (0.0, 0.0)
    area = sum(abs(signed_area(ring - ring[0])) for ring in given.rings if len(ring))
    extent = Extent(width, height, float(area), blocks)
    _refuse_unfit(scene, extent)
    return extent


def _refuse_unfit(scene: BlocksScene, extent: Extent) -> None:
    """What the scene asks of a map whose size nobody knew when the scene was read."""
    t, file, faults = scene.tessellation, str(scene.source.path), []
    side = min(extent.width, extent.height)
    # A map may be a single row of blocks; blocks that are made need room to be made.
    if t.edge > side:
        expected = f"at most the smaller side of the map, {side:.6g} m"
        faults.append(Fault(file, "tessellation.edge", f"{t.edge:.4g} m", expected))
    travel = scene.loading.largest_travel
    if scene.programme is None and travel > 0.5 * extent.height:
        expected = f"loading that shortens the {extent.height:.6g} m of the map by at most one half"
        faults.append(Fault(file, "loading", f"{travel:.4g} m", expected))
    if faults:
        raise BadInput(faults)
