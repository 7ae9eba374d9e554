"""dem-run on blocks from polygon files and from joint sets."""

import json

import meshio
import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact
from graben.schemas.polygon_file import read_polygons
from graben.schemas.scenes.blocks import Joints
from graben.stages.blocks.joints import joints_of_sets
from graben.stages.dem_run import stage as dem_run

BRICKS = [(x, y) for y in (0.0, 1.0, 2.0, 3.0) for x in (0.0, 1.0, 2.0, 3.0)]

SCENE = """
kind = "blocks"
[domain]
width = "4 m"
height = "4 m"
[tessellation]
rounding = "0.02 m"
[joints]
dilation = "0 deg"
[loading]
speed = "20 um/s"
states = 3
[numerics]
steps = 1500
[output]
vtk = false
"""


ONE_SET = ['tessellation.method="joint-sets"', 'tessellation.sets=[{dip="0 deg",spacing="1 m"}]']


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "bricks.toml"
    path.write_text(SCENE)
    return path


def geojson(path):
    rings = [[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]] for x, y in BRICKS]
    features = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [r]}} for r in rings
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


def mesh(path):
    points = np.array([(x, y) for y in range(5) for x in range(5)], dtype=float)
    quads = [(5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5) for j in range(4) for i in range(4)]
    meshio.Mesh(np.column_stack([points, np.zeros(25)]), [("quad", np.array(quads))]).write(path)


@pytest.mark.parametrize(("name", "write"), [("bricks.geojson", geojson), ("bricks.vtu", mesh)])
def test_a_stack_of_bricks_from_a_file_is_as_stiff_as_its_joints(scene, name, write):
    write(scene.with_name(name))
    output = scene.with_name(name + ".nc")
    settings = ['tessellation.method="file"', f'tessellation.file="{name}"']
    headline = dem_run.run(scene, output, overrides=settings)
    assert headline["blocks"] == 16
    d = read_artifact(output, "blocks")
    top = np.abs(d.vertex_position.values[:, 1] - 4.0) < 0.01
    bottom = np.abs(d.vertex_position.values[:, 1]) < 0.01
    strain = -(d.displacement.values[-1, top, 1].mean() - d.displacement.values[-1, bottom, 1].mean()) / 4.0
    stress = -(d.wall_reaction.values[-1, 2, 1] - d.wall_reaction.values[0, 2, 1]) / 4.0
    # Three joints of kn = 10 GPa/m in 4 m, less the cut corners, in series with the rock (E / (1 - nu^2)).
    per_joint = 10e9 * 0.96
    expected = 1.0 / (0.75 / per_joint + (1.0 - 0.2**2) / 65e9)
    assert stress / strain == pytest.approx(expected, rel=0.03)


def test_joint_sets_from_a_scene(scene):
    output = scene.with_name("sets.nc")
    sets = '[{dip="20 deg",spacing="0.9 m",dip_scatter="5 deg"},{dip="-70 deg",spacing="0.8 m",persistence=0.7}]'
    settings = ['tessellation.method="joint-sets"', f"tessellation.sets={sets}"]
    headline = dem_run.run(scene, output, overrides=settings)
    assert headline["blocks"] > 15
    d = read_artifact(output, "blocks")
    assert float(d.block_area.sum()) == pytest.approx(16.0, rel=1e-6)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        (['tessellation.method="file"'], "tessellation.file"),
        (['tessellation.method="joint-sets"'], "tessellation.sets"),
        (['tessellation.method="file"', 'tessellation.file="bricks.toml"'], "file of polygons"),
        (["joints.sets=[{set=1}]"], "joint-sets"),
        ([*ONE_SET, "joints.sets=[{set=1},{set=1}]"], "one entry"),
        ([*ONE_SET, "joints.sets=[{set=2}]"], "the 1 sets"),
        ([*ONE_SET, 'joints.sets=[{set=1,friction="5 m"}]'], "joints.sets"),
    ],
)
def test_missing_or_foreign_polygons_are_refused(scene, settings, word):
    with pytest.raises(BadInput) as refused:
        dem_run.run(scene, scene.with_name("never.nc"), overrides=settings)
    assert any(word in str(f) for f in refused.value.faults)


def test_joints_of_one_set_from_a_scene(scene):
    # Bricks of two sets: the horizontal joints, set 1, decide the vertical stiffness.
    settings = [
        'tessellation.method="joint-sets"',
        'tessellation.sets=[{dip="0 deg",spacing="1 m"},{dip="90 deg",spacing="1 m"}]',
    ]
    runs, rise = {}, {}
    for name, sets in (
        ("same", "[]"),
        ("soft", '[{set=1,normal_stiffness="2 GPa/m"}]'),
        ("other", '[{set=2,normal_stiffness="2 GPa/m"}]'),
    ):
        output = scene.with_name(f"{name}.nc")
        headline = dem_run.run(scene, output, overrides=[*settings, f"joints.sets={sets}", "output.vtk=true"])
        rise[name] = headline["peak_wall_stress_pa"] + 0.25e6
        runs[name] = read_artifact(output, "blocks")
    # Of 5 m at 2 mm: rock 4 m / E' and four joints 1 / kn in series, before and after.
    assert rise["soft"] / rise["same"] == pytest.approx((4 / 67.7 + 0.4) / (4 / 67.7 + 2.0), rel=0.05)
    assert rise["other"] / rise["same"] == pytest.approx(1.0, abs=0.05)
    assert "contact_set" not in runs["same"]
    soft = runs["soft"]
    along = np.abs(soft.contact_tangent.values[:, 0])
    assert set(np.unique(soft.contact_set)) <= {0, 1, 2}
    assert np.all(soft.contact_set.values[along > 0.9] == 1)
    assert np.all(soft.contact_set.values[along < 0.1] == 2)
    import pyvista

    joints = pyvista.get_reader(scene.with_name("soft-joints.pvd")).read()[0]
    assert set(np.unique(joints["set"])) <= {0, 1, 2}


def test_where_edges_of_two_sets_meet_the_weaker_decides():
    rough = {"friction": "40 deg"}
    joints = Joints.model_validate(
        {"sets": [rough | {"set": 1}, {"set": 2, "friction": "20 deg"}, {"set": 3, "cohesion": "50 kPa"}]}
    )
    found, between = joints_of_sets(joints, np.array([0, 1, 3]))
    assert [round(float(np.degrees(np.arctan(j.friction)))) for j in found] == [32, 40, 20, 32]
    assert between.tolist() == [[0, 0, 2, 3], [0, 1, 2, 3], [2, 2, 2, 2], [3, 3, 2, 3]]


def test_sets_of_edges_from_a_file(tmp_path):
    path = tmp_path / "a.geojson"
    square = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    feature = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [square]}}
    path.write_text(json.dumps(feature | {"properties": {"joint_sets": [0, 1, 2, 0]}}))
    assert read_polygons(path)[1][0].tolist() == [0, 1, 2, 0]
    for wrong in ([0, 1], [0, 1, 2, -1], [0.5, 1, 2, 3]):
        path.write_text(json.dumps(feature | {"properties": {"joint_sets": wrong}}))
        with pytest.raises(BadInput, match="joint_sets"):
            read_polygons(path)


def test_multipolygons_and_holes(tmp_path):
    path = tmp_path / "a.geojson"
    square = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    path.write_text(json.dumps({"type": "MultiPolygon", "coordinates": [[square], [square]]}))
    assert len(read_polygons(path)[0]) == 2
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [square, square]}))
    with pytest.raises(BadInput, match="without holes"):
        read_polygons(path)
