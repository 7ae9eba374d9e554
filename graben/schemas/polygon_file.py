"""Polygons read from files: GeoJSON, or any mesh that meshio reads (each plane cell is a polygon)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from graben.schemas.faults import BadInput, Fault

GEOJSON = (".geojson", ".json")


def read_polygons(path: Path) -> list[np.ndarray]:
    """Polygons (m, 2) of a file, coordinates in metres.

    Raises
    ------
    BadInput : unreadable, no polygon in it, or polygons with holes
    """
    try:
        found = _geojson(path) if path.suffix.lower() in GEOJSON else _mesh(path)
    except BadInput:
        raise
    except (Exception, SystemExit) as error:  # meshio raises errors of many kinds, and exits on some
        raise BadInput(Fault(str(path), "", "", f"a file of polygons ({error})")) from error
    if not found:
        raise BadInput(Fault(str(path), "", "", "at least one polygon"))
    return found


def _geojson(path: Path) -> list[np.ndarray]:
    found: list[np.ndarray] = []

    def visit(item: dict[str, Any]) -> None:
        kind = item["type"]
        if kind == "FeatureCollection":
            for feature in item["features"]:
                visit(feature["geometry"])
        elif kind == "Feature":
            visit(item["geometry"])
        elif kind == "GeometryCollection":
            for geometry in item["geometries"]:
                visit(geometry)
        elif kind in ("Polygon", "MultiPolygon"):
            for rings in [item["coordinates"]] if kind == "Polygon" else item["coordinates"]:
                if len(rings) != 1:
                    raise BadInput(Fault(str(path), "coordinates", "", f"polygon {len(found)} without holes"))
                ring = np.array(rings[0], dtype=float)[:, :2]
                # GeoJSON repeats the first corner at the end.
                found.append(ring[:-1] if np.array_equal(ring[0], ring[-1]) else ring)

    visit(json.loads(path.read_text(encoding="utf-8")))
    return found


def _mesh(path: Path) -> list[np.ndarray]:
    import meshio

    mesh = meshio.read(path)
    plane = ("triangle", "quad", "polygon")
    cells = [c for block in mesh.cells if block.type.startswith(plane) for c in block.data]
    return [np.asarray(mesh.points, dtype=float)[np.asarray(c), :2] for c in cells]
