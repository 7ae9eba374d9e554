"""Polygons read from files: GeoJSON, or any mesh that meshio reads (each plane cell is a polygon)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault
from graben.schemas.reading import read_json

GEOJSON = (".geojson", ".json")


Polygons = tuple[list[np.ndarray], list[np.ndarray]]


def read_polygons(path: Path) -> Polygons:
    """Polygons (m, 2) of a file, coordinates in metres, and the sets of joints (m,) of their edges.

    A feature of GeoJSON tells the sets in its property `joint_sets`, one number for each edge of its polygon from the
    first corner on; without it, and in meshes, they are 0.

    Raises
    ------
    BadInput : unreadable, no polygon in it, or polygons with holes
    """
    try:
        found = _geojson(path) if path.suffix.lower() in GEOJSON else _mesh(path)
    except BadInput:
        raise
    except RecursionError:
        raise BadInput(Fault(str(path), "geometries", "", "collections of geometries nested less deeply")) from None
    except (Exception, SystemExit) as error:  # meshio raises errors of many kinds, and exits on some
        raise BadInput(Fault(str(path), "", "", f"a file of polygons ({error})")) from error
    if not found[0]:
        raise BadInput(Fault(str(path), "", "", "at least one polygon"))
    return found


def _geojson(path: Path) -> Polygons:
    found: list[np.ndarray] = []
    sets: list[np.ndarray] = []

    def visit(item: dict[str, Any], given: list[int] | None = None) -> None:
        kind = item["type"]
        if kind == "FeatureCollection":
            for feature in item["features"]:
                visit(feature)
        elif kind == "Feature":
            visit(item["geometry"], (item.get("properties") or {}).get("joint_sets"))
        elif kind == "GeometryCollection":
            for geometry in item["geometries"]:
                visit(geometry, given)
        elif kind in ("Polygon", "MultiPolygon"):
            for rings in [item["coordinates"]] if kind == "Polygon" else item["coordinates"]:
                if len(rings) != 1:
                    raise BadInput(Fault(str(path), "coordinates", "", f"polygon {len(found)} without holes"))
                ring = np.array(rings[0], dtype=float)[:, :2]
                # GeoJSON repeats the first corner at the end.
                ring = ring[:-1] if np.array_equal(ring[0], ring[-1]) else ring
                own = np.zeros(len(ring), dtype=np.int64) if given is None else np.array(given)
                if own.shape != (len(ring),) or own.dtype.kind != "i" or own.min() < 0:
                    expected = f"polygon {len(found)}: {len(ring)} numbers of sets, from 0 on"
                    raise BadInput(Fault(str(path), "joint_sets", str(given), expected))
                found.append(ring)
                sets.append(own)

    visit(read_json(path, "map in GeoJSON"))
    return found, sets


def _mesh(path: Path) -> Polygons:
    import meshio

    mesh = meshio.read(path)
    plane = ("triangle", "quad", "polygon")
    cells = [c for block in mesh.cells if block.type.startswith(plane) for c in block.data]
    found = [np.asarray(mesh.points, dtype=float)[np.asarray(c), :2] for c in cells]
    return found, [np.zeros(len(ring), dtype=np.int64) for ring in found]
