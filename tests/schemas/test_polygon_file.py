"""Polygons of a file: what has one meaning is read, the rest is refused by feature and place."""

import json

import meshio
import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.polygon_file import read_polygons

SQUARE = [[5, 1], [6, 1], [6, 2], [5, 2], [5, 1]]
BESIDE = [[6, 1], [7, 1], [7, 2], [6, 2], [6, 1]]


def polygon(*rings):
    return {"type": "Polygon", "coordinates": list(rings)}


def feature(geometry, **more):
    return {"type": "Feature", "properties": {"name": "greywacke"}, "geometry": geometry} | more


def read(tmp_path, data, name="map.geojson"):
    path = tmp_path / name
    path.write_text(data if isinstance(data, str) else json.dumps(data))
    return read_polygons(path)


def fault(tmp_path, data, name="map.geojson"):
    with pytest.raises(BadInput) as refused:
        read(tmp_path, data, name)
    return str(refused.value)


@pytest.mark.parametrize(
    "data",
    [
        polygon(SQUARE),
        feature(polygon(SQUARE)),
        {
            "type": "FeatureCollection",
            "features": [feature(polygon(SQUARE))],
            "bbox": [0, 0, 9, 9],
            "author": {"x": []},
        },
        {
            "type": "GeometryCollection",
            "geometries": [{"type": "GeometryCollection", "geometries": [polygon(SQUARE)]}],
        },
        {"type": "MultiPolygon", "coordinates": [[SQUARE]]},
        feature(polygon(SQUARE), crs={"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3067"}}),
        polygon(SQUARE[:-1]),
        polygon([[*p, 35.5] for p in SQUARE]),
        polygon(SQUARE, []),
        feature(polygon(SQUARE), properties=None),
    ],
)
def test_spellings_of_one_polygon(tmp_path, data):
    found = read(tmp_path, data)
    assert [ring.tolist() for ring in found.rings] == [SQUARE[:-1]]
    assert found.without_geometry == []
    assert read(tmp_path, "\ufeff" + json.dumps(data)).rings[0].tolist() == SQUARE[:-1]


@pytest.mark.parametrize(
    "nothing",
    [
        None,
        polygon(),
        {"type": "MultiPolygon", "coordinates": []},
        {"type": "MultiPolygon", "coordinates": [[]]},
        {"type": "GeometryCollection", "geometries": []},
        {"type": "LineString", "coordinates": []},
    ],
)
def test_features_without_geometry_are_passed_over_and_named(tmp_path, nothing):
    data = {"type": "FeatureCollection", "features": [feature(nothing, id=8), feature(polygon(SQUARE))]}
    found = read(tmp_path, data)
    assert len(found.rings) == 1
    assert found.without_geometry == ["feature 0 (id 8, name greywacke)"]
    assert found.names == ["feature 1 (name greywacke)"]
    assert "at least one polygon" in fault(tmp_path, feature(nothing))


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        ({"type": "LineString", "coordinates": [[3.5, 1], [4, 1]]}, "LineString at (3.5, 1)"),
        ({"type": "MultiPoint", "coordinates": [[3.5, 1]]}, "MultiPoint at (3.5, 1)"),
        ({"type": "GeometryCollection", "geometries": [polygon(SQUARE), {"type": "Point", "coordinates": [7, 8]}]},
         "Point at (7, 8)"),
        (polygon(SQUARE, [[5.2, 1.2], [5.4, 1.2], [5.4, 1.4], [5.2, 1.2]]), "a hole at (5.2, 1.2)"),
        (polygon([["5", "1"], ["6", "1"], ["6", "2"]]), "numbers"),
        (polygon([[True, 1], [6, 1], [6, 2]]), "numbers"),
        (polygon([[5], [6], [7]]), "numbers"),
        (polygon([[5, 1], [1e300, 1], [6, 2]]), "below 1e9"),
        (polygon([[5, 1], [10**400, 1], [6, 2]]), "below 1e9"),
        (polygon([[5, 1], [-1e9, 1], [6, 2]]), "finite"),
        (polygon(5), "list of rings"),
        ({"type": "Polygon"}, "list of coordinates"),
        ({"type": "Polygon", "coordinates": {"x": 1}}, "list of coordinates"),
        (["Polygon"], "list of coordinates"),
    ],
)  # fmt: skip
def test_anything_else_is_refused_by_feature_and_place(tmp_path, geometry, words):
    data = {"type": "FeatureCollection", "features": [feature(polygon(BESIDE)), feature(geometry, id="b7")]}
    text = fault(tmp_path, data)
    assert "feature 1 (id b7, name greywacke)" in text
    assert words in text


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ("", "valid JSON"),
        ("[" * 200_000, "nested less deeply"),
        ("[1, 2]", "FeatureCollection"),
        ({"type": "FeatureCollection"}, "a list of features"),
        ({"type": "FeatureCollection", "features": [3]}, "feature 0"),
        ({"type": "Topology", "objects": {}}, "list of coordinates"),
        (feature(polygon(SQUARE), crs={"properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}), "degrees"),
        (feature(polygon(SQUARE), crs={"properties": {"name": "EPSG:4326"}}), "degrees"),
        (feature(polygon(SQUARE), crs={"properties": {"name": "urn:ogc:def:crs:EPSG::4283"}}), "degrees"),
        (feature(polygon(SQUARE), crs={"properties": {"name": "urn:ogc:def:crs:EPSG::7844"}}), "degrees"),
        (feature(polygon(SQUARE), crs="EPSG:4326"), "degrees"),
    ],
)
def test_files_that_are_no_maps(tmp_path, data, words):
    assert words in fault(tmp_path, data)


def test_grids_in_metres_among_the_numbers_of_geographic_systems_are_read(tmp_path):
    grid = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::4647"}}  # UTM 32N with the zone before
    ring = [[32_412_000.0 + x, 5_800_000.0 + y] for x, y in SQUARE]
    assert len(read(tmp_path, feature(polygon(ring), crs=grid)).rings) == 1


def test_every_fault_of_a_map_is_named_but_not_thousands(tmp_path):
    line = {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}
    text = fault(tmp_path, {"type": "FeatureCollection", "features": [feature(line) for _ in range(500)]})
    assert "feature 9" in text
    assert "490 more" in text
    assert len(text.splitlines()) == 11


@pytest.mark.parametrize("name", ["joints.shp", "joints.dxf"])
def test_formats_of_other_programs_are_told_how_to_become_a_map(tmp_path, name):
    assert "ogr2ogr -f GeoJSON joints.geojson" in fault(tmp_path, "0", name)


def test_cells_of_a_mesh_are_polygons_and_nothing_goes_unseen(tmp_path, capfd):
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)], float)
    path = tmp_path / "a.vtu"
    meshio.Mesh(points, [("line", [[0, 1]]), ("triangle", [[0, 1, 2]]), ("triangle", [[0, 2, 3]])]).write(path)
    found = read_polygons(path)
    assert [len(r) for r in found.rings] == [3, 3]
    assert found.names == ["cell 0", "cell 1"]
    for kind, cell in (("tetra", [0, 1, 2, 4]), ("triangle6", [0, 1, 2, 3, 4, 0])):
        meshio.Mesh(points, [("triangle", [[0, 1, 2]]), (kind, [cell])]).write(path)
        with pytest.raises(BadInput, match=kind):
            read_polygons(path)
    assert capfd.readouterr().out == ""
