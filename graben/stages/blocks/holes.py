"""Holes of a domain: blocks go whole, by their middle, so a hole takes out more or less than its own area."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.mechanics.plane.polygons import areas_and_centroids, inside
from graben.mechanics.plane.rings import place
from graben.schemas.scenes.blocks import BlocksScene

_log = logging.getLogger(__name__)

# What a hole takes out, and what was open there, may miss its area by this share without a word.
_MISSED = 0.2
# A void of less than this share of a hole is a misfit of coordinates.
_VOID = 1e-3


def taken_by_holes(
    scene: BlocksScene, shapes: Sequence[np.ndarray], outline: np.ndarray, origin: np.ndarray
) -> dict[str, Any]:
    """Headline numbers on what the holes took out of blocks (m, 2) that fill an outline (n, 2), voids aside [m].

    Raises
    ------
    BadInput : a hole that holds neither the middle of a block nor a void
    """
    import shapely

    holes = [np.array(hole) for hole in scene.domain.holes]
    if not holes:
        return {}
    start = np.cumsum([0, *map(len, shapes)])
    area, middle = areas_and_centroids(np.vstack(list(shapes)), start, np.arange(start[-1]))
    area = np.abs(area)
    blocks = np.array([shapely.Polygon(shape) for shape in shapes])
    tree, domain = shapely.STRtree(blocks), shapely.Polygon(outline)
    out, faults, asked = np.zeros(len(area), dtype=bool), [], []
    for k, hole in enumerate(holes):
        polygon = shapely.intersection(shapely.Polygon(hole), domain)
        near = tree.query(polygon, predicate="intersects")
        void = shapely.difference(polygon, shapely.union_all(blocks[near])).area
        held = inside(middle, hole)
        at = place(hole.mean(axis=0), origin)
        if not held.any() and void <= _VOID * polygon.area:
            nearest = int(np.argmin(np.hypot(*(middle - hole.mean(axis=0)).T)))
            expected = (
                f"a polygon that holds the middle of a block, or a void of the map (the nearest block, of "
                f"{area[nearest]:.3g} m2, has its middle at {place(middle[nearest], origin)})"
            )
            faults.append(Fault(str(scene.source.path), f"domain.holes[{k}]", f"at {at}", expected))
            continue
        taken = float(area[held].sum()) + void
        if abs(taken - polygon.area) > _MISSED * polygon.area:
            _log.warning(
                "%s: domain.holes[%d] at %s has %.3g m2, and %d blocks of %.3g m2 are left out for it: blocks go "
                "whole; smaller blocks come closer, and a map can have its edges",
                scene.source.path, k, at, polygon.area, held.sum(), area[held].sum(),
            )  # fmt: skip
        out |= held
        asked.append(polygon)
    if faults:
        raise BadInput(faults)
    return {
        "left_out_blocks": int(out.sum()),
        "left_out_area_m2": float(area[out].sum()),
        "holes_area_m2": float(shapely.union_all(asked).area),
    }
