"""Scenes are judged by the size of their own body: that of a map is the map's, not that of the default domain."""

import json

import pytest

from graben.errors import BadInput
from graben.schemas.scene import load_scene
from graben.stages.blocks.extent import Extent, extent_of, map_of
from graben.stages.blocks.sizes import sizes_of, steps_of
from graben.stages.blocks.stage import prepare


def scene(folder, size, *, edge=None, loading="", more="", domain=""):
    """A map of 3 x 2 squares of a third of the width `size` [m]."""
    a = size / 3.0
    features = []
    for x, y in ((x, y) for y in (0, 1) for x in (0, 1, 2)):
        ring = [[a * (x + dx), a * (y + dy)] for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]
        geometry = {"type": "Polygon", "coordinates": [ring]}
        features.append({"type": "Feature", "properties": {}, "geometry": geometry})
    (folder / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    path = folder / "scene.toml"
    path.write_text(f"""
kind = "blocks"
fidelity = "draft"
{domain}
[tessellation]
method = "file"
file = "map.geojson"
edge = "{edge or a} m"
rounding = "{0.01 * a} m"
{more}
{loading}
""")
    return path


PRESSED = '[loading]\nspeed = "{} m/s"\nduration = "100 s"'
PROGRAMME = """[programme]
supports = [{{start = ["0 m", "0 m"], end = ["{0} m", "0 m"]}}]
loads = []"""


@pytest.mark.parametrize("size", [0.03, 3.0, 3000.0])
@pytest.mark.parametrize("kind", [PRESSED, PROGRAMME], ids=["loading", "programme"])
def test_a_map_of_any_size_is_a_good_scene(tmp_path, size, kind):
    """The edge is a third of the width; the zones are a ninth of it; the strain is a third."""
    body = kind.format(size if kind is PROGRAMME else 1e-2 * size / 4.5)
    zones = f'zone_edge = "{size / 9.0} m"'
    prepared = prepare(load_scene(scene(tmp_path, size, loading=body, more=zones), "blocks"))
    assert prepared.ground.blocks.size == 6
    count = {estimate.name: estimate.count for estimate in prepared.sizes}
    assert count["blocks"] == 6.0 and count["zones"] == pytest.approx(54.0)


def test_a_map_may_be_one_row_of_blocks(tmp_path):
    path = scene(tmp_path, 3.0, edge=2.0, loading=PROGRAMME.format(3.0))
    assert prepare(load_scene(path, "blocks")).ground.blocks.size == 6


@pytest.mark.parametrize("size", [0.03, 3.0, 3000.0])
def test_what_does_not_fit_the_map_is_refused_by_key_and_size(tmp_path, size):
    path = scene(tmp_path, size, edge=0.67 * size, loading=PRESSED.format(0.4e-2 * size))
    with pytest.raises(BadInput) as refused:
        prepare(load_scene(path, "blocks"))
    found = {fault.key: fault.expected for fault in refused.value.faults}
    height = f"{2.0 * size / 3.0:.6g} m"
    assert set(found) == {"tessellation.edge", "loading"}
    assert height in found["tessellation.edge"] and height in found["loading"]


def test_an_outline_is_the_body_also_of_a_map(tmp_path):
    corners = '[["0 m","0 m"],["3 m","0 m"],["3 m","2 m"],["0 m","2 m"]]'
    path = scene(tmp_path, 3.0, loading=PROGRAMME.format(3.0), domain=f"[domain]\noutline = {corners}")
    loaded = load_scene(path, "blocks")
    assert extent_of(loaded, map_of(loaded)) == Extent(3.0, 2.0, 6.0, 6)
    with pytest.raises(BadInput, match="at most half the domain"):
        load_scene(path, "blocks", ['tessellation.edge="1.1 m"'])


def test_steps_follow_the_strain_of_the_map(tmp_path):
    """The same strain of a map ten times as large takes the same steps."""
    steps = []
    for size in (3.0, 30.0):
        loaded = load_scene(scene(tmp_path, size, loading=PRESSED.format(2.6e-3 * size)), "blocks")
        extent = extent_of(loaded, map_of(loaded))
        steps.append((steps_of(loaded, extent, 6.0), sizes_of(loaded, extent)[3].count))
    assert steps[0] == steps[1] and steps[0][0] > 12_500
