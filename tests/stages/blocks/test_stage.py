"""dem-run on blocks: the artifact, its VTK files, determinism, and what a failed run leaves."""

import json

import numpy as np
import pytest
import xarray

from graben.errors import BadInput, NumericsFailed
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.dem_run import stage as dem_run
from graben.stages.homogenize import stage as homogenize
from graben.stages.tools import picture

SCENE = """
kind = "blocks"
seed = 2
[domain]
width = "2 m"
height = "2 m"
[loading]
confining_pressure = "0.5 MPa"
speed = "0.2 mm/s"
states = 6
[numerics]
steps = 4000
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("blocks") / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def finished(scene):
    output = scene.with_name("run.nc")
    told = []
    headline = dem_run.run(scene, output, progress=lambda f, m: told.append((f, m)))
    return output, headline, told


def test_artifact_holds_what_its_layout_says(finished):
    output, headline, told = finished
    assert check_artifact(output) == []
    d = read_artifact(output, "blocks")
    assert d.sizes["time"] == 6
    assert d.sizes["vertex"] == d.sizes["corner"] == int(d.block_corner_count.sum())
    assert d.sizes["contact"] == int(d.contact_count.sum())
    assert float(d.time[-1]) == pytest.approx(100.0)
    assert float(d.confining_stress) == -0.5e6
    assert float(d.block_area.sum()) == pytest.approx(4.0)
    assert not d.displacement[0].values.any()
    # At the start the specimen carries the consolidation stress.
    area_mean = np.average(d.zone_stress[0], axis=0, weights=_zone_area(d))
    assert area_mean[:2] == pytest.approx([-0.5e6, -0.25e6], rel=0.03)
    assert float(d.wall_reaction[0, 0, 1]) == pytest.approx(0.25e6 * 2.0, rel=0.02)
    assert set(np.unique(d.contact_state)) <= {0, 1, 2, 3}
    cost = json.loads(d.attrs["cost"])
    assert cost["zone_steps"] > 0
    assert cost["energy_error"] < 0.02
    assert headline["blocks"] == d.sizes["block"]
    assert headline["peak_wall_stress_pa"] < -1e6
    json.dumps(headline)
    fractions = [f for f, _ in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0


def _zone_area(d):
    p = d.vertex_position.values[d.zone_vertex.values]
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def test_averaged_stress_equals_boundary_forces(finished):
    d = read_artifact(finished[0], "blocks")
    for k in (0, 3):
        x = d.vertex_position.values + d.displacement.values[k]
        by_forces = np.einsum("vi,vj->ij", x, d.boundary_force.values[k])
        by_zones = np.einsum("z,zc->c", _zone_area(d), d.zone_stress.values[k])
        assert by_forces[1, 1] == pytest.approx(by_zones[1], rel=0.05)
        assert by_forces[0, 0] == pytest.approx(by_zones[0], rel=0.05)


def test_artifact_closes_the_balance_with_inertia(scene):
    output, curves = scene.with_name("balance.nc"), scene.with_name("curves.nc")
    settings = ["output.balance=true", "output.vtk=false", "numerics.steps=1500", "loading.states=4"]
    dem_run.run(scene, output, overrides=settings)
    homogenize.run([output], curves, radii=[0.7])
    with xarray.open_dataset(curves) as c:
        # Stress by zones and by forces: equal with inertia, some per cent apart without.
        assert float(c.balance_residual.max()) < 1e-12
        assert float(abs(c.stress - c.stress_boundary).max()) > 1e-3 * float(abs(c.stress).max())
    with xarray.open_dataset(output) as d:
        x = (d.vertex_position + d.displacement[-1]).values
        force = (d.body_force[-1] + d.boundary_force[-1]).values
        last = slice(int(d.contact_count[:-1].sum()), None)
        push, at, along, bent = (
            d[k].values[last]
            for k in ("contact_force", "contact_position", "contact_tangent", "contact_force_moment")
        )
        block = d.contact_block.values[last]
        own = d.vertex_block.values
        total = np.zeros((d.sizes["block"], 3))
        np.add.at(total, own, np.column_stack([force, _cross(x, force)]))
        row = np.column_stack([push, _cross(at, push) + _cross(along, bent)])
        np.add.at(total, block[:, 0], row)
        np.add.at(total, block[:, 1], -row)
        assert np.abs(total).max() < 1e-12 * np.abs(push).max()


def _cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def test_far_beyond_the_peak_with_loose_blocks(scene):
    # 15 % strain at the steps a state of draft fidelity, smooth joints: blocks are pressed out and fly.
    settings = ["output.vtk=false", "loading.states=31", "numerics.steps=9000", 'loading.speed="3 mm/s"']
    runs = {}
    for stop in ("false", "true"):
        output = scene.with_name(f"loose-{stop}.nc")
        headline = dem_run.run(scene, output, overrides=[*settings, f"numerics.stop_loose_blocks={stop}"])
        runs[stop] = read_artifact(output, "blocks")
        assert headline["energy_error"] < 0.05
        assert headline["loose_blocks"] == int(runs[stop].loose_blocks.max()) > 0
        assert np.isfinite(runs[stop].displacement.values).all()
    # Blocks that were stopped shake on in themselves, which is little beside their flight.
    flight, shaking = (runs[stop].energy_kinetic_loose.values.max() for stop in ("false", "true"))
    assert shaking < 0.1 * flight


def test_vtk_opens_with_the_promised_fields(finished):
    import pyvista

    output = finished[0]
    zones = pyvista.get_reader(output.with_suffix(".pvd"))
    assert len(zones.time_values) == 6
    zones.set_active_time_value(zones.time_values[-1])
    grid = zones.read()[0]
    assert {"displacement", "velocity", "boundary_force"} <= set(grid.point_data)
    assert {"stress", "stress_major_compressive", "stress_minor_compressive", "block"} <= set(grid.cell_data)
    assert np.all(grid["stress_major_compressive"] <= grid["stress_minor_compressive"])
    joints = pyvista.get_reader(output.with_name("run-joints.pvd"))
    joints.set_active_time_value(joints.time_values[-1])
    lines = joints.read()[0]
    assert {"state", "slip", "opening", "normal_stress", "shear_stress", "force"} <= set(lines.cell_data)


def test_same_scene_same_arrays(scene, finished):
    again = scene.with_name("again.nc")
    dem_run.run(scene, again, overrides=["output.vtk=false"])
    assert not again.with_suffix(".pvd").exists()
    with xarray.open_dataset(finished[0]) as a, xarray.open_dataset(again) as b:
        for name in a.variables:
            assert np.array_equal(a[name].values, b[name].values), name


@pytest.mark.parametrize(
    ("setting", "stronger"),
    [
        ('joints.residual_friction="15 deg"', False),
        ('joints.residual_cohesion="0 Pa"', False),
        ('joints.closure="0.2 mm"', True),
    ],
)
def test_options_of_joints_reach_the_model(scene, finished, setting, stronger):
    output = scene.with_name("option.nc")
    run = dem_run.run(scene, output, overrides=["output.vtk=false", setting], overwrite=True)
    # Compression is negative.
    assert (run["peak_wall_stress_pa"] < finished[1]["peak_wall_stress_pa"]) == stronger


def test_weak_rock_yields(scene, finished):
    import pyvista

    output = scene.with_name("weak.nc")
    settings = ["states=3", 'zones="mohr-coulomb"', 'cohesion="2 MPa"', 'tension="0.5 MPa"', 'dilation="5 deg"']
    tables = ["loading", *["rock"] * 4]
    run = dem_run.run(scene, output, overrides=[f"{t}.{s}" for t, s in zip(tables, settings, strict=True)])
    assert finished[1]["peak_wall_stress_pa"] < run["peak_wall_stress_pa"] < -0.5e6
    d = read_artifact(output, "blocks")
    yielded = d.zone_state.values[-1] > 0
    assert yielded.sum() > 0
    assert np.array_equal(d.zone_plastic_strain.values[-1] > 0.0, yielded)
    assert float(d.energy_plastic[-1]) > 0.0
    grid = pyvista.get_reader(output.with_name("weak.pvd"))
    grid.set_active_time_value(grid.time_values[-1])
    assert {"plastic_strain", "state"} <= set(grid.read()[0].cell_data)


def test_rigid_blocks_from_scene_to_averages(scene, tmp_path):
    import pyvista

    from graben.stages.homogenize import stage as homogenize

    output = tmp_path / "rigid.nc"
    settings = ['rock.zones="rigid"', 'domain.width="4 m"', 'domain.height="4 m"', "loading.states=3"]
    run = dem_run.run(scene, output, overrides=settings)
    assert run["peak_wall_stress_pa"] < -0.5e6
    assert run["energy_error"] < 0.02
    d = read_artifact(output, "blocks")
    assert d.sizes["zone"] == 0
    assert d.block_stress.dims == ("time", "block", "plane")
    mean = np.average(d.block_stress[0], axis=0, weights=d.block_area)
    assert mean[:2] == pytest.approx([-0.5e6, -0.25e6], rel=0.05)
    grid = pyvista.get_reader(output.with_suffix(".pvd"))
    grid.set_active_time_value(grid.time_values[-1])
    cells = grid.read()[0]
    assert np.unique(cells["block"]).size == d.sizes["block"]
    picture.run(output, tmp_path / "rigid.png")
    # The averages of the whole body are what the walls say.
    homogenize.run([output], tmp_path / "curves.nc", radii=[1.5])
    curves = read_artifact(tmp_path / "curves.nc", "curves")
    assert "forces" in curves.attrs["stress_from"]
    assert curves.stress[0, 0, [0, 1]].values == pytest.approx([-0.5e6, -0.25e6], rel=0.1)
    assert float(curves.strain[0, -1, 1]) == pytest.approx(-0.0002 * 100 / 4, rel=0.3)


def test_threads_change_nothing(scene, finished):
    output = scene.with_name("threads.nc")
    dem_run.run(scene, output, overrides=["output.vtk=false", "numerics.threads=2"])
    with xarray.open_dataset(finished[0]) as a, xarray.open_dataset(output) as b:
        assert np.array_equal(a.displacement.values, b.displacement.values)


def test_picture(finished):
    output = finished[0].with_name("run.png")
    picture.run(finished[0], output)
    assert output.stat().st_size > 10_000


def test_failed_run_keeps_its_last_states(scene):
    output = scene.with_name("failed.nc")
    with pytest.raises(NumericsFailed, match="energy error"):
        dem_run.run(scene, output, overrides=["numerics.energy_limit=1e-9"])
    assert not output.exists()
    with xarray.open_dataset(output.with_name("failed.partial.nc")) as d:
        assert d.sizes["time"] >= 1


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        ('joints.normal_stiffness="-1 GPa/m"', "joints.normal_stiffness"),
        ('rock.young="65 GPa/m"', "rock.young"),
        ('tessellation.edge="3 m"', "tessellation.edge"),
        ('tessellation.rounding="0.3 m"', "tessellation.rounding"),
        ('loading.speed="1 m/s"', "one half"),
        ("loading.sped=1", "loading.sped"),
        ('rock.zones="plastic"', "rock.zones"),
        ('rock.cohesion="1 MPa"', "cohesion"),
        ('rock={zones="mohr-coulomb",friction="20 deg",dilation="21 deg"}', "dilation"),
        ('rock={zones="rigid",tension="1 MPa"}', "tension"),
    ],
)
def test_bad_scenes_are_refused(scene, setting, key):
    output = scene.with_name("never.nc")
    with pytest.raises(BadInput) as refused:
        dem_run.run(scene, output, overrides=[setting])
    assert any(key in str(f) for f in refused.value.faults)
    assert not output.exists()


def test_template_and_pipeline_scene_are_valid(tmp_path):
    from pathlib import Path

    from graben.schemas.scene import load_scene
    from graben.schemas.template import template

    path = tmp_path / "template.toml"
    path.write_text(template("blocks"))
    load_scene(path, "blocks")
    granite = load_scene(
        Path(__file__).parents[3] / "pipelines/upscaling/voronoi-granite.toml",
        "blocks",
        ['loading.confining_pressure="2 MPa"'],
    )
    assert granite.loading.confining_pressure == 2e6
    assert granite.loading.states == 51
