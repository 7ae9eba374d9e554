"""fem-run: artifact, VTU files, faults, exit codes, determinism, materials from files, meshes from files."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from graben.cli.fem_run import main
from graben.errors import BadInput
from graben.mechanics.fem.collapse import LoadCurve
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.fem_run import stage as fem_run

# A block of 4 m x 3 m of cohesive rock (von Mises), pressed on its left half.
SCENE = """
kind = "fem"
[mesh]
size = "0.5 m"
corners = [["0 m", "0 m"], ["2 m", "0 m"], ["4 m", "0 m"], ["0 m", "3 m"], ["2 m", "3 m"], ["4 m", "3 m"]]
patches = [[0, 1, 4, 3], [1, 2, 5, 4]]
refine = []
[material]
law = "drucker-prager"
[material.parameters]
young_modulus = "1 GPa"
poisson_ratio = 0.3
friction_angle = "0 deg"
hardening = "linear"
initial_yield = "1 MPa"
[[supports]]
name = "left"
start = ["0 m", "0 m"]
end = ["0 m", "3 m"]
fix = "x"
[[supports]]
name = "base"
start = ["0 m", "0 m"]
end = ["4 m", "0 m"]
fix = "both"
[[loads]]
name = "press"
start = ["0 m", "3 m"]
end = ["2 m", "3 m"]
rate = "0.25 MPa/s"
[stepping]
save_every = "2 s"
smallest = "0.05 s"
"""


def invoke(folder: Path, *arguments: str, text: str = SCENE, name: str = "run"):
    scene = folder / f"{name}.toml"
    scene.write_text(text)
    return CliRunner().invoke(main, [str(scene), "-o", str(folder / f"{name}.nc"), *arguments])


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("fem")
    result = invoke(folder, "--json", "-q")
    assert result.exit_code == 0, result.output
    (folder / "run.json").write_text(result.stdout)
    return folder


def test_the_failure_load_is_the_result_and_lies_within_its_bounds(made):
    headline = json.loads((made / "run.json").read_text())
    # lower bound: the column under the load; upper bound: Prandtl's wedge on half a strip, with room for the mesh
    tau = 1e6 / np.sqrt(3)
    assert 2 * tau < headline["failure_load_pa"] < 1.1 * (2 + np.pi) * tau
    assert headline["failed"] and headline["failure_load_pa"] == headline["largest_load_pa"]
    assert headline["compliance_ratio"] > 3 and headline["stiffness_ratio"] < 0.3
    assert headline["energy_error"] < 1e-6
    assert headline["stabilisation_share"] == 0.0


def test_artifact_is_whole_and_its_parts_agree(made):
    assert check_artifact(made / "run.nc") == []
    data = read_artifact(made / "run.nc", "fem")
    assert data["mesh"].attrs["cf_role"] == "mesh_topology"
    assert data["stress"].dims == ("time", "face", "component")
    np.testing.assert_array_equal(data["displacement"][0], 0.0)
    assert data["gravity_displacement"].values[:, 1].min() < 0
    times, pressure = data["time"].values, data["pressure"].values[:, 0]
    np.testing.assert_allclose(pressure, 0.25e6 * times)
    assert times[1] == 2.0 and times[-1] == data["step_time"].values[-1]
    weight = 2700 * 9.81 * 12.0
    np.testing.assert_allclose(data["reaction"].values[:, 1], weight + 2.0 * pressure, rtol=1e-5)
    np.testing.assert_allclose(
        data["step_settlement"].values[-1], -data["surface_displacement"].values[-1, :5, 1].mean(), rtol=0.1
    )
    surface = data["surface_node"].values
    assert (data["node_x"].values[surface[0]], data["node_y"].values[surface[0]]) == (0.0, 3.0)
    assert "drucker-prager" in data.attrs["scene"]
    assert json.loads(data.attrs["cost"])["elements"] == data.sizes["face"] == 48


def test_vtk_opens_the_series_with_the_promised_fields(made):
    import pyvista

    reader = pyvista.get_reader(made / "run.pvd")
    times = read_artifact(made / "run.nc", "fem")["time"].values
    np.testing.assert_allclose(reader.time_values, times)
    reader.set_active_time_value(reader.time_values[-1])
    grid = reader.read()[0]
    assert set(grid.point_data.keys()) >= {"displacement", "gravity_displacement"}
    assert set(grid.cell_data.keys()) >= {
        "stress",
        "strain",
        "mean_stress",
        "von_mises_stress",
        "plastic_strain",
        "damage",
    }
    assert grid.cell_data["stress"].shape == (48, 6)
    # B-bar: yield holds at the Gauss points; element means lie within it
    assert grid.cell_data["von_mises_stress"].max() < 1.001e6


def test_the_same_scene_twice_is_bitwise_the_same(made):
    assert invoke(made, "-q", name="again").exit_code == 0
    one, two = (read_artifact(made / f"{n}.nc", "fem") for n in ("run", "again"))
    for name in one.variables:
        assert np.array_equal(one[name].values, two[name].values), name


def test_a_material_file_replaces_the_scenes(made, tmp_path):
    (tmp_path / "weak.material.toml").write_text(
        'law = "drucker-prager"\n[parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.3\n'
        'friction_angle = "0 deg"\nhardening = "linear"\ninitial_yield = "0.5 MPa"\n'
    )
    result = invoke(
        tmp_path,
        "--json",
        "-q",
        "--material",
        str(tmp_path / "weak.material.toml"),
        "--set",
        'gravity.density="0 kg/m^3"',
    )
    assert result.exit_code == 0, result.output
    strong = json.loads((made / "run.json").read_text())["failure_load_pa"]
    np.testing.assert_allclose(json.loads(result.stdout)["failure_load_pa"], strong / 2, rtol=0.05)
    assert "weak.material.toml" in read_artifact(tmp_path / "run.nc", "fem").attrs["inputs"]


def test_a_mesh_from_a_file_gives_the_same_answer(made, tmp_path):
    import meshio

    data = read_artifact(made / "run.nc", "fem")
    points = np.stack([data["node_x"].values, data["node_y"].values, 0 * data["node_x"].values], axis=1)
    meshio.Mesh(points, [("quad", data["face_node"].values)]).write(tmp_path / "block.vtu")
    result = invoke(tmp_path, "--json", "-q", "--set", 'mesh.method="file"', "--set", 'mesh.file="block.vtu"')
    assert result.exit_code == 0, result.output
    before = json.loads((made / "run.json").read_text())["failure_load_pa"]
    np.testing.assert_allclose(json.loads(result.stdout)["failure_load_pa"], before, rtol=0.02)


def test_a_paved_mesh_gives_a_similar_answer(made, tmp_path):
    outline = '[["0 m","0 m"],["4 m","0 m"],["4 m","3 m"],["2 m","3 m"],["0 m","3 m"]]'
    result = invoke(
        tmp_path,
        "--json",
        "-q",
        "--set",
        'mesh.method="paved"',
        "--set",
        f"mesh.outline={outline}",
        "--set",
        'mesh.size="0.35 m"',
    )
    assert result.exit_code == 0, result.output
    before = json.loads((made / "run.json").read_text())["failure_load_pa"]
    np.testing.assert_allclose(json.loads(result.stdout)["failure_load_pa"], before, rtol=0.1)


def test_stabilisation_is_booked_and_ends_by_overload(tmp_path):
    result = invoke(tmp_path, "--json", "-q", "--set", 'stepping.relaxation="5 ms"')
    assert result.exit_code == 0, result.output
    headline = json.loads(result.stdout)
    assert "viscous" in headline["reason"] and 0 < headline["stabilisation_share"] < 0.05
    assert headline["failure_load_pa"] < headline["largest_load_pa"]


def test_no_failure_before_the_end_is_said_so(tmp_path):
    result = invoke(tmp_path, "--json", "-q", "--set", 'stepping.end="2 s"')
    headline = json.loads(result.stdout)
    assert headline["failure_load_pa"] is None and not headline["failed"] and headline["largest_load_pa"] == 5e5


def test_failing_where_the_end_is_the_goal_is_exit_3_and_keeps_the_last_state(tmp_path):
    result = invoke(tmp_path, "-q", "--set", 'stepping.goal="end"')
    assert result.exit_code == 3
    assert "no equilibrium beyond load time" in result.output and "run.last-good.nc" in result.output
    assert not (tmp_path / "run.nc").exists()
    assert check_artifact(tmp_path / "run.last-good.nc") == []


def test_failing_under_gravity_is_exit_3_and_keeps_the_last_state(tmp_path):
    result = invoke(tmp_path, "-q", "--set", 'gravity.vertical="-1 km/s^2"')
    assert result.exit_code == 3
    assert "% of gravity" in result.output and "its own weight" in result.output
    assert not (tmp_path / "run.nc").exists()
    kept = read_artifact(tmp_path / "run.last-good.nc", "fem")
    assert kept.sizes["time"] == 1
    assert 0 < kept["reaction"].values[0, 1] < 2700 * 1000 * 12  # part of the weight


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('rate = "0.25 MPa/s"', 'rate = "0.25 MPa"'), ["loads.0.rate", "Pa/s"]),
        (('start = ["0 m", "3 m"]', 'start = ["0 m", "3.5 m"]'), ["loads.0", "a segment of the outline"]),
        (('fix = "both"', 'fix = "x"'), ["supports", "no rigid motion"]),
        (("[1, 2, 5, 4]]", "[1, 2, 5, 9]]"), ["mesh.patches", "corners 0 to 5"]),
        (("[1, 2, 5, 4]]", "[1, 5, 2, 4]]"), ["mesh.patches", "patch 1 is not a convex"]),
        (('size = "0.5 m"', 'size = "-0.5 m"'), ["mesh.size", "greater than 0"]),
        (('size = "0.5 m"', 'size = "0.1 mm"'), ["mesh.size", "at most"]),
        (("poisson_ratio = 0.3", "poisson_ratio = 0.6"), ["material.parameters.poisson_ratio"]),
        (("poisson_ratio = 0.3\n", ""), ["material.parameters.poisson_ratio", "required"]),
        (('law = "drucker-prager"', 'law = "granite"'), ["material"]),
        (('rate = "0.25 MPa/s"', 'rate = "0 Pa/s"'), ["positive rate"]),
        (("[stepping]", "[stepping]\nfrist = 3"), ["stepping.frist", "no such key"]),
        (('smallest = "0.05 s"', 'smallest = "5 s"'), ["smallest <= first"]),
        (('name = "base"', 'name = "base"\nstar = 1'), ["supports.1.star"]),
        (("[mesh]", '[mesh]\nmethod = "file"'), ["mesh", "a mesh file"]),
    ],
)
def test_bad_input_is_exit_2_with_the_key_named_and_nothing_written(change, words, tmp_path):
    text = SCENE.replace(*change)
    assert text != SCENE
    result = invoke(tmp_path, "-q", text=text)
    assert result.exit_code == 2, result.output
    for word in words:
        assert word in result.output
    assert [p.name for p in tmp_path.iterdir()] == ["run.toml"]


def test_faults_of_supports_and_loads_come_together(tmp_path):
    text = SCENE.replace('end = ["0 m", "3 m"]', 'end = ["-1 m", "0 m"]').replace(
        'start = ["0 m", "0 m"]', 'start = ["-2 m", "-2 m"]'
    )
    text = text.replace('end = ["2 m", "3 m"]', 'end = ["2 m", "9 m"]')
    result = invoke(tmp_path, "-q", text=text)
    assert result.exit_code == 2
    assert "supports.0" in result.output and "loads.0" in result.output


def test_an_existing_output_is_kept(made):
    result = invoke(made, "-q")
    assert result.exit_code == 2 and "--overwrite" in result.output


def test_bad_mesh_files_are_named(tmp_path):
    import meshio

    (tmp_path / "broken.vtu").write_text("not xml")
    meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])]).write(tmp_path / "triangles.vtu")
    for name, words in (("broken.vtu", "meshio reads"), ("triangles.vtu", "4-node quads")):
        result = invoke(tmp_path, "-q", "--set", 'mesh.method="file"', "--set", f'mesh.file="{name}"')
        assert result.exit_code == 2 and words in result.output, result.output


def test_a_bad_material_file_is_named(tmp_path):
    (tmp_path / "a.material.toml").write_text('law = "elastic"\n[parameters]\nyoung_modulus = "1 m"\n')
    result = invoke(tmp_path, "-q", "--material", str(tmp_path / "a.material.toml"))
    assert result.exit_code == 2
    assert "a.material.toml" in result.output and "young_modulus" in result.output


def test_an_interrupted_run_leaves_a_checkpoint_and_no_output(tmp_path, monkeypatch):
    (tmp_path / "run.toml").write_text(SCENE)
    calls = []

    def interrupt(fraction, message):
        calls.append(fraction)
        if len(calls) > 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fem_run.run(tmp_path / "run.toml", tmp_path / "run.nc", progress=interrupt)
    assert {p.name for p in tmp_path.iterdir()} == {"run.toml", "run.checkpoint.npz"}


def test_the_slope_of_the_pipeline_is_a_good_scene(tmp_path):
    """Mesh, supports and loads of the shipped scene fit together; the run itself is in the chain."""
    scene = Path(__file__).parents[3] / "pipelines/upscaling/slope.toml"
    shutil.copy(scene, tmp_path / "slope.toml")
    settings = ["fidelity=draft", 'stepping.end="2 s"']
    headline = fem_run.run(tmp_path / "slope.toml", tmp_path / "slope.nc", overrides=settings)
    assert 600 <= headline["elements"] <= 900 and headline["largest_load_pa"] == 5e5
    with pytest.raises(BadInput):
        fem_run.run(tmp_path / "slope.toml", tmp_path / "slope.nc", overrides=settings)


def test_the_picture_is_drawn(made):
    from graben.stages.tools import picture

    picture.run(made / "run.nc", made / "run.png")
    assert (made / "run.png").stat().st_size > 20_000


def test_a_softening_width_slows_or_speeds_damage_as_the_failure_displacement_does(tmp_path):
    # Elements of 0.5 m that soften as zones of 2 m: damage grows four times as fast, Y (2.34).
    softens = """damage = "ductile"
initiation_strain_050 = 1e-3
initiation_strain_060 = 1e-3
failure_displacement = """
    base = SCENE.replace('initial_yield = "1 MPa"\n', 'initial_yield = "1 MPa"\n' + softens + '"FAIL m"\n')
    wide = base.replace("FAIL", "0.08").replace('kind = "fem"', 'kind = "fem"\nsoftening_width = "2 m"')
    loads = {}
    for name, text in (
        ("wide", wide),
        ("quick", base.replace("FAIL", "0.02")),
        ("slow", base.replace("FAIL", "0.08")),
    ):
        result = invoke(tmp_path, "--json", text=text, name=name)
        assert result.exit_code == 0, result.output
        loads[name] = json.loads(result.stdout)["failure_load_pa"]
    assert loads["wide"] == pytest.approx(loads["quick"], rel=1e-6)
    assert loads["wide"] < 0.99 * loads["slow"]


def test_a_negative_softening_width_is_refused(tmp_path):
    text = SCENE.replace('kind = "fem"', 'kind = "fem"\nsoftening_width = "-1 m"')
    result = invoke(tmp_path, text=text)
    assert result.exit_code == 2
    assert "softening_width" in result.output


def test_a_march_that_stops_without_a_collapse_has_no_failure_load(tmp_path, monkeypatch):
    """Compliance 3.8 and stiffness .42, as seen at half of a limit load."""
    monkeypatch.setattr(LoadCurve, "compliance_ratio", lambda self: 3.8)
    ratios = iter([1.0, 0.42])
    monkeypatch.setattr(fem_run, "softest_stiffness", lambda *arguments: next(ratios))
    headline = json.loads(invoke(tmp_path, "--json", "-q").stdout)
    assert headline["failed"] and headline["failure_load_pa"] is None and headline["last_load_pa"] > 1e5
    assert "that is no collapse" in headline["reason"] and "not known" in headline["warnings"][0]


@pytest.mark.parametrize(("compliance", "stiffness"), [(3.8, 0.1), (16.0, 0.42)])
def test_either_evidence_is_enough_for_a_collapse(tmp_path, monkeypatch, compliance, stiffness):
    monkeypatch.setattr(LoadCurve, "compliance_ratio", lambda self: compliance)
    ratios = iter([1.0, stiffness])
    monkeypatch.setattr(fem_run, "softest_stiffness", lambda *arguments: next(ratios))
    headline = json.loads(invoke(tmp_path, "--json", "-q").stdout)
    assert headline["failure_load_pa"] == headline["last_load_pa"] > 1e5 and headline["warnings"] == []
