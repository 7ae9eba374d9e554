"""dem-run on a scene of kind "particles": artifact, VTU files, faults, determinism."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from graben.cli.dem_run import main
from graben.errors import BadInput
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.dem_run import stage as dem_run

SCENE = """
kind = "particles"
seed = 3
fidelity = "draft"
beds = 2
[box]
width = "0.6 mm"
depth = "0.3 mm"
[[grains]]
name = "coarse"
diameter = "100 um"
share = 0.6
[[grains]]
name = "fine"
diameter = "60 um"
share = 0.4
[contact]
overlap = 0.01
[loading]
pressure = "30 Pa"
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bed")
    (folder / "bed.toml").write_text(SCENE)
    result = CliRunner().invoke(main, [str(folder / "bed.toml"), "-o", str(folder / "bed.nc"), "--json"])
    assert result.exit_code == 0, result.output
    (folder / "bed.json").write_text(result.stdout)
    return folder


def test_artifact_holds_the_bed(made):
    assert check_artifact(made / "bed.nc") == []
    bed = read_artifact(made / "bed.nc", "particles")
    assert bed.sizes["bed"] == 2
    assert bed["state_name"].values.tolist() == ["inserted", "settled", "pressed", "quenched"]
    touching = bed["floor_force"].values > 0.0
    for b in range(2):
        for c in range(2):
            of = touching & (bed["particle_bed"].values == b) & (bed["particle_class"].values == c)
            assert of.sum() == bed["floor_count"].values[b, c] > 0
    density = bed["floor_count"].values.sum(axis=0) / bed["bed_area"].values.sum()
    np.testing.assert_allclose(bed["floor_contacts_per_area"], density)
    assert np.all(bed["floor_contacts_low"] <= density) and np.all(density <= bed["floor_contacts_high"])
    cost = json.loads(bed.attrs["cost"])
    assert cost["steps"] > 0 and cost["energy_error"] < 0.05 and cost["time_step_over_critical"] < 1.0


def test_headline(made):
    headline = json.loads((made / "bed.json").read_text())
    bed = read_artifact(made / "bed.nc", "particles")
    assert [c["name"] for c in headline["classes"]] == ["coarse", "fine"]
    assert headline["wall_share_of_weight"] == 0.0 == bed["bed_wall_share_of_weight"].values.max()
    assert abs(headline["floor_share_of_weight"] - 1.0) < 0.02
    assert headline["classes"][1]["contacts_per_m2"] == bed["floor_contacts_per_area"].values[1]


def test_contacts_point_at_touching_spheres(made):
    bed = read_artifact(made / "bed.nc", "particles")
    first, second = bed["contact_particle"].values.T
    assert np.all(bed["particle_bed"].values[first] == bed["particle_bed"].values[second])
    gap = bed["position"].values[-1][second] - bed["position"].values[-1][first]
    gap[:, :2] -= 6e-4 * np.rint(gap[:, :2] / 6e-4)
    radius = bed["particle_radius"].values
    overlap = radius[first] + radius[second] - np.linalg.norm(gap, axis=1)
    assert overlap.min() > 0.0
    stiffness = bed["class_stiffness"].values[0] / 2.0
    np.testing.assert_allclose(bed["contact_force"].values, stiffness * overlap, rtol=1e-6, atol=1e-15)


def test_vtk_opens_with_the_promised_fields(made):
    import pyvista

    reader = pyvista.get_reader(made / "bed.pvd")
    assert len(reader.time_values) == 4
    reader.set_active_time_value(reader.time_values[-1])
    grid = reader.read()[0]
    bed = read_artifact(made / "bed.nc", "particles")
    first = bed["particle_bed"].values == 0
    assert set(grid.point_data.keys()) >= {"radius", "class", "velocity", "coordination", "floor_force"}
    np.testing.assert_array_equal(grid.points, bed["position"].values[-1][first])
    np.testing.assert_array_equal(grid.point_data["coordination"], bed["coordination"].values[first])


def test_same_scene_same_bits(made, tmp_path):
    dem_run.run(made / "bed.toml", tmp_path / "again.nc")
    first, second = (read_artifact(p, "particles") for p in (made / "bed.nc", tmp_path / "again.nc"))
    for name in first.variables:
        assert first[name].values.tobytes() == second[name].values.tobytes(), name


def test_picture(made, tmp_path):
    from graben.stages.tools import picture

    picture.run(made / "bed.nc", tmp_path / "bed.png")
    assert (tmp_path / "bed.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ('box.depth="1 nm"', "at least one grain"),
        ('contact.normal_stiffness="-5 N/m"', "normal_stiffness"),
        ('contact.normal_stiffness="5 Pa"', "N/m"),
        ('loading.pressure="-30 Pa"', "pressure"),
        ('box.width="0.2 mm"', "three of its largest grains"),
        ("contact.frction=0.1", "frction"),
        ("numerics.safety=1.5", "safety"),
    ],
)
def test_faults_are_named_and_nothing_is_written(made, tmp_path, setting, words):
    with pytest.raises(BadInput, match=words):
        dem_run.run(made / "bed.toml", tmp_path / "out.nc", overrides=[setting])
    assert list(tmp_path.iterdir()) == []


def test_existing_output_is_kept(made):
    before = (made / "bed.nc").read_bytes()
    result = CliRunner().invoke(main, [str(made / "bed.toml"), "-o", str(made / "bed.nc")])
    assert result.exit_code == 2
    assert (made / "bed.nc").read_bytes() == before


def test_failed_numerics_exit_with_3_and_keep_the_last_good_state(made, tmp_path):
    import pyvista

    arguments = [str(made / "bed.toml"), "-o", str(tmp_path / "out.nc")]
    never = ["--set", "numerics.max_steps=5000", "--set", "numerics.balance=1e-15"]
    result = CliRunner().invoke(main, arguments + never)
    assert result.exit_code == 3
    assert "come to rest" in result.stderr
    grid = pyvista.read(tmp_path / "out.last-good.vtu")
    assert np.isfinite(grid.points).all() and set(grid.point_data.keys()) == {"radius", "class", "velocity"}
    assert not (tmp_path / "out.nc").exists()


def test_saved_contact_forces_hold_every_grain(made):
    """At rest the contact forces of each grain carry its weight; those of the floor and the last state agree."""
    bed = read_artifact(made / "bed.nc", "particles")
    count = bed["state_contact_count"].values
    ends = np.cumsum(count.ravel()).reshape(count.shape)
    assert ends[-1, -1] == bed.sizes["force"]
    last = np.concatenate([np.arange(ends[b, -1] - count[b, -1], ends[b, -1]) for b in range(2)])
    pair, force = bed["state_contact_particle"].values[last], bed["state_contact_force"].values[last]
    total = np.zeros((bed.sizes["particle"], 3))
    np.add.at(total, pair[:, 0], force)
    np.add.at(total, pair[pair[:, 1] >= 0, 1], -force[pair[:, 1] >= 0])
    kind, radius = bed["particle_class"].values, bed["particle_radius"].values
    total[:, 2] -= 9.81 * 4.0 / 3.0 * np.pi * radius**3 * bed["class_density"].values[kind]
    assert np.abs(total).sum(axis=1).mean() < 0.02 * np.linalg.norm(force, axis=1).mean()
    spheres = pair[:, 1] >= 0
    assert np.array_equal(pair[spheres], bed["contact_particle"].values)
    along = -np.einsum("ij,ij->i", force[spheres], bed["contact_normal"].values)
    np.testing.assert_allclose(along, bed["contact_force"], rtol=1e-9, atol=1e-18)
    floor = (~spheres) & (force[:, 2] > 0.0)
    np.testing.assert_allclose(force[floor, 2].sum(), bed["floor_force"].values.sum(), rtol=1e-12)
