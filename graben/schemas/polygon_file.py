"""Polygons read from files: GeoJSON, or any mesh that meshio reads (each plane cell is a polygon)."""

from __future__ import annotations

import contextlib
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from graben.errors import BadInput, Fault
from graben.schemas.reading import read_json

GEOJSON = (".geojson", ".json")

_HOW = "polygons as GeoJSON or as a mesh"
# No coordinate on the earth, in any grid, is farther from zero [m].
_FARTHEST = 1e9
_MOST_FAULTS = 10
# Plane cells; cells of lines and vertices beside them name groups of edges and nodes.
_CELLS = r"triangle|quad|polygon\d*"
_BESIDE = ("line", "vertex")


class Polygons(NamedTuple):
    """Polygons of a file.

    rings : of each (m, 2) [m], the first corner not repeated; sets : of each the sets of joints (m,) of its edges
    names : of each where it stands in the file, for messages; without_geometry : features that have none
    """

    rings: list[np.ndarray]
    sets: list[np.ndarray]
    names: list[str]
    without_geometry: list[str]


def read_polygons(path: Path) -> Polygons:
    """Polygons of a file, coordinates in metres.

    A feature of GeoJSON tells the sets in its property `joint_sets`, one number for each edge of its polygon from the
    first corner on; without it, and in meshes, they are 0. Heights are left out, features without a geometry passed
    over.

    Raises
    ------
    BadInput : unreadable, no polygon in it, coordinates in degrees, anything but polygons, or polygons with holes
    """
    found = _geojson(path) if path.suffix.lower() in GEOJSON else _mesh(path)
    if not found.rings:
        raise BadInput(Fault(str(path), "", "", "at least one polygon"))
    return found


def _geojson(path: Path) -> Polygons:
    data = read_json(path, "map in GeoJSON")
    found = Polygons([], [], [], [])
    faults: list[Fault] = []
    try:
        features = list(_features(data))
    except _Wrong as wrong:
        raise BadInput(Fault(str(path), *wrong.args)) from None
    for name, geometry, properties in features:
        try:
            _add(found, name, geometry, properties)
        except _Wrong as wrong:
            faults.append(Fault(str(path), *wrong.args))
    if not faults:
        try:
            _refuse_degrees(data, found.rings)
        except _Wrong as wrong:
            faults.append(Fault(str(path), *wrong.args))
    if faults:
        more = len(faults) - _MOST_FAULTS
        rest = [Fault(str(path), "", f"{more} more of these", _HOW)] if more > 0 else []
        raise BadInput(faults[:_MOST_FAULTS] + rest)
    return found


class _Wrong(Exception):
    """Key, value and what was expected."""


def _refuse_degrees(data: Any, rings: list[np.ndarray]) -> None:
    """Geographic systems count in degrees: CRS84, and most of EPSG from 4000 to 4999. Some of these are grids in
    metres, whose coordinates are too large for degrees."""
    crs = data.get("crs") if isinstance(data, dict) else None
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = str(properties.get("name")) if isinstance(properties, dict) else crs if isinstance(crs, str) else ""
    known = re.search(r"CRS:?84$|WGS ?84$|EPSG:.*\b(4326|4258|4269|6318|6668|6706|7844)$", name, re.IGNORECASE)
    most = re.search(r"EPSG:.*\b4\d{3}$", name, re.IGNORECASE)
    if known or (most and all((np.abs(ring) <= 360.0).all() for ring in rings)):
        raise _Wrong("crs", name, "a projected grid in metres (this one is in degrees)")


def _features(data: Any) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Name, geometry and properties of all features; a bare geometry counts as one."""
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "Feature":
        listed = [data]
    elif kind == "FeatureCollection":
        listed = data.get("features")
        if not isinstance(listed, list):
            raise _Wrong("features", _short(listed), "a list of features")
    elif isinstance(kind, str):
        yield "geometry", data, {}
        return
    else:
        raise _Wrong("type", _short(kind), "a file of polygons (GeoJSON: FeatureCollection, Feature or a geometry)")
    for k, feature in enumerate(listed):
        if not isinstance(feature, dict) or feature.get("type") != "Feature":
            raise _Wrong(f"feature {k}", _short(feature), 'an object of type "Feature"')
        properties = feature.get("properties")
        properties = properties if isinstance(properties, dict) else {}
        own = {key: feature.get(key, properties.get(key)) for key in ("id", "name", "fid", "ID", "Name", "FID")}
        known = ", ".join(f"{key} {v}" for key, v in own.items() if isinstance(v, str | int) and str(v))
        yield f"feature {k}" + (f" ({known[:60]})" if known else ""), feature.get("geometry"), properties


def _add(found: Polygons, name: str, geometry: Any, properties: dict[str, Any]) -> None:
    """Add the polygons of one feature."""
    parts: list[Any] = []
    left = [geometry]
    while left:
        item = left.pop(0)
        if item is None:
            continue
        kind = item.get("type") if isinstance(item, dict) else None
        inner = item.get("geometries" if kind == "GeometryCollection" else "coordinates") if kind else None
        if not isinstance(inner, list):
            raise _Wrong(name, _short(item), "a geometry with a list of coordinates")
        if kind == "GeometryCollection":
            left = inner + left
        elif kind == "MultiPolygon":
            parts += inner
        elif kind == "Polygon":
            parts.append(inner)
        elif inner:
            raise _Wrong(name, f"{kind} at {_place(inner)}", "polygons only; lines and points bound no block")
    parts = [p for p in parts if p != []]
    if not parts:
        found.without_geometry.append(name)
    given = properties.get("joint_sets")
    for k, rings in enumerate(parts):
        own = f"{name}, part {k}" if len(parts) > 1 else name
        ring = _ring(own, rings)
        found.rings.append(ring)
        found.sets.append(_sets(own, given, len(ring)))
        found.names.append(own)


def _ring(name: str, rings: Any) -> np.ndarray:
    if not isinstance(rings, list) or not all(isinstance(r, list) for r in rings):
        raise _Wrong(name, _short(rings), "a polygon as a list of rings")
    for ring in rings:
        for p in ring:
            numbers = isinstance(p, list) and len(p) > 1 and all(type(v) in (int, float) for v in p[:2])
            # Compared as they are: a whole number may be too large for a float.
            if not numbers or not all(-_FARTHEST < v < _FARTHEST for v in p[:2]):
                raise _Wrong(name, _short(p), "positions of two or three numbers, in m, finite and below 1e9")
    if any(rings[1:]):
        hole = next(r for r in rings[1:] if r)
        expected = "a polygon without holes: a block is one closed ring; cut it into blocks around the hole"
        raise _Wrong(name, f"a hole at {_place(hole)}", expected)
    ring = np.array([p[:2] for p in rings[0]], dtype=float).reshape(-1, 2)
    # GeoJSON repeats the first corner at the end.
    return ring[:-1] if len(ring) > 1 and np.array_equal(ring[0], ring[-1]) else ring


def _sets(name: str, given: Any, edges: int) -> np.ndarray:
    if given is None:
        return np.zeros(edges, dtype=np.int64)
    whole = isinstance(given, list) and len(given) == edges and all(type(v) is int for v in given)
    if not whole or not all(0 <= v < 10_000 for v in given):
        raise _Wrong("joint_sets", _short(given), f"{name}: {edges} numbers of sets, from 0 on")
    return np.array(given, dtype=np.int64)


def _place(coordinates: Any) -> str:
    """The first position in nested coordinates."""
    while isinstance(coordinates, list) and coordinates and isinstance(coordinates[0], list):
        coordinates = coordinates[0]
    numbers = isinstance(coordinates, list) and all(type(v) in (int, float) for v in coordinates[:2])
    return f"({coordinates[0]:.12g}, {coordinates[1]:.12g})" if numbers and len(coordinates) > 1 else "no place"


def _short(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _mesh(path: Path) -> Polygons:
    import meshio

    if not path.is_file():
        raise BadInput(Fault(str(path), "", "", "an existing file of polygons"))
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            mesh = meshio.read(path)
        points = np.asarray(mesh.points, dtype=float)[:, :2]
    except (Exception, SystemExit) as error:  # meshio raises errors of many kinds, and exits on some
        reason = str(error).strip() or type(error).__name__
        raise BadInput(Fault(str(path), "", "", f"a file of polygons: {_HOW} ({reason}){_cure(path)}")) from error
    rings: list[np.ndarray] = []
    names: list[str] = []
    strange: set[str] = set()
    for block in mesh.cells:
        if block.type.startswith(_BESIDE):
            continue
        if not re.fullmatch(_CELLS, block.type):
            strange.add(block.type)
            continue
        for cell in block.data:
            names.append(f"cell {len(names)}")
            rings.append(points[np.asarray(cell)])
    if strange:
        raise BadInput(Fault(str(path), "cells", ", ".join(sorted(strange)), "triangles, quads and polygons only"))
    for name, ring in zip(names, rings, strict=True):
        if not (np.abs(ring) < _FARTHEST).all():
            raise BadInput(Fault(str(path), name, _short(ring.tolist()), "coordinates in m, finite and below 1e9"))
    return Polygons(rings, [np.zeros(len(ring), dtype=np.int64) for ring in rings], names, [])


def _cure(path: Path) -> str:
    """How formats of other programs become GeoJSON."""
    maps = (".shp", ".dxf", ".gpkg", ".kml", ".gml", ".dwg", ".gdb", ".tab", ".mif")
    if path.suffix.lower() not in maps:
        return ""
    return f"; `ogr2ogr -f GeoJSON {path.stem}.geojson {path.name}` converts this one"
