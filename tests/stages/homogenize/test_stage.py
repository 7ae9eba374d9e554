"""homogenize and rev-study as stages: files in, one file out, every fault named."""

import importlib.util
import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact, write_artifact
from graben.schemas.layouts.blocks import LAYOUT
from graben.schemas.provenance import Record
from graben.stages.homogenize import stage as homogenize
from graben.stages.rev_study import stage as rev_study
from graben.stages.shared.default_scene import default_scene

HERE = Path(__file__).parents[2] / "mechanics" / "averaging"
STRAIN = np.array([[1e-3, 4e-4], [0.0, -3e-3]])


@cache
def load(name):
    spec = importlib.util.spec_from_file_location(f"averaging_{name}", HERE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def blocks_arrays(seed=11, confining=-0.5e6):
    """Elastic blocks held by springs, squeezed to the peak at three quarters of the time and let go a little."""
    synthetic, elastic = load("synthetic"), load("elastic")
    model = synthetic.from_polygons(synthetic.voronoi_polygons(110, 6.0, seed=seed))
    x = model.position
    held = ((x < 1e-9) | (x > 6.0 - 1e-9)).any(axis=1)
    s = elastic.solve(model, held, STRAIN)
    factor = np.concatenate([np.linspace(0.0, 1.0, 7), [0.8, 0.7]])
    t, m = factor.size, s.pair.shape[0]

    def over_time(array):
        return factor.reshape(-1, *[1] * array.ndim) * array

    arrays = {
        "time": np.arange(t) * 2.0,
        "vertex_position": x,
        "vertex_block": model.vertex_block,
        "zone_vertex": model.zone_vertex,
        "zone_block": model.zone_block,
        "block_area": np.ones(model.block_count),
        "block_corner_count": model.corner_count,
        "block_corner": model.corner,
        "displacement": over_time(s.displacement),
        "velocity": np.zeros((t, *x.shape)),
        "zone_stress": over_time(s.zone_stress),
        "boundary_force": over_time(s.outer_force),
        "wall_reaction": np.zeros((t, 4, 2)),
        "confining_stress": confining,
        "outline": np.array([[0, 0], [6, 0], [6, 6], [0, 6.0]]),
        "contact_count": np.full(t, m),
        "contact_block": np.tile(model.vertex_block[s.pair], (t, 1)),
        "contact_position": np.tile(x[s.pair[:, 0]], (t, 1)),
        "contact_tangent": np.tile([1.0, 0.0], (t * m, 1)),
        "contact_force": over_time(s.spring_force).reshape(-1, 2),
        "contact_length": np.full(t * m, 0.1),
        "contact_state": np.zeros(t * m),
    }
    for name, variable in LAYOUT.variables.items():
        if name not in arrays and not variable.optional:
            arrays[name] = np.zeros([{"time": t, "contact": t * m}[d] for d in variable.dims])
    return model, arrays


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """dem.nc and four more of other seeds; wet.nc at another lateral stress."""
    path = tmp_path_factory.mktemp("dem")
    for k, seed in enumerate((11, 12, 13)):
        write_artifact(path / f"dem{k}.nc", LAYOUT, blocks_arrays(seed)[1], Record.begin())
    write_artifact(path / "other.nc", LAYOUT, blocks_arrays(11, -2e6)[1], Record.begin())
    return path


def test_curves_of_two_runs_and_two_radii(folder, tmp_path):
    out = tmp_path / "curves.nc"
    headline = homogenize.run([folder / "dem0.nc", folder / "dem1.nc"], out, radii=[1.2, 1.9])
    data = read_artifact(out, "curves")
    assert data["path_name"].values.tolist() == ["dem0 r=1.2 m", "dem0 r=1.9 m", "dem1 r=1.2 m", "dem1 r=1.9 m"]
    assert data["step_count"].values.tolist() == [9] * 4
    assert np.allclose(data["confining_stress"], -0.5e6)
    last = data.isel(step=6)
    # Held all round, the average strain is near that of the walls, and exactly elastic.
    assert np.allclose(last["strain"].values[:, :2], [STRAIN[0, 0], STRAIN[1, 1]], atol=8e-4)
    assert np.allclose(data["strain"][:, 7].values, 0.8 * last["strain"].values, atol=1e-15)
    assert np.allclose(last["stress"], last["stress_boundary"], rtol=1e-7, atol=10.0)
    assert float(np.abs(data["force_imbalance"]).max()) < 1e-9
    assert np.allclose(last["strain_blocks"] + last["strain_joints"], last["strain"], atol=1e-15)
    assert (last["strain_joints"].values[:, 1] < 0).all()
    assert len(headline["paths"]) == 4
    assert headline["paths"][1]["peak_stress_pa"] == pytest.approx(-float(last["stress"][1, 1]))
    assert json.loads(data.attrs["inputs"]).keys() == {str(folder / "dem0.nc"), str(folder / "dem1.nc")}


def test_same_input_gives_the_same_arrays(folder, tmp_path):
    for name in ("a", "b"):
        homogenize.run([folder / "dem0.nc"], tmp_path / f"{name}.nc", radii=[2.0], deformed=True, chosen_at=3)
    a, b = (read_artifact(tmp_path / f"{n}.nc", "curves") for n in "ab")
    assert a.identical(b.assign_attrs(a.attrs))


def test_deformed_shape(folder, tmp_path):
    """In the current shape an affine displacement gradient G shows as G (1 + G)^-1."""
    _, arrays = blocks_arrays()
    factor = np.linspace(0.0, 1.0, 9)
    gradient = np.array([[0.05, 0.02], [-0.01, -0.04]])
    arrays["displacement"] = factor[:, None, None] * (arrays["vertex_position"] @ gradient.T)
    arrays["zone_stress"][:] = [-1e6, -3e6, -1e6, 2e5]
    write_artifact(tmp_path / "affine.nc", LAYOUT, arrays, Record.begin())
    homogenize.run([tmp_path / "affine.nc"], tmp_path / "c.nc", radii=[1.5], deformed=True)
    data = read_artifact(tmp_path / "c.nc", "curves")
    spatial = gradient @ np.linalg.inv(np.eye(2) + gradient)
    expected = [spatial[0, 0], spatial[1, 1], 0.0, 0.5 * (spatial[0, 1] + spatial[1, 0])]
    assert np.allclose(data["strain"].values[0, -1], expected, atol=1e-14)
    assert np.allclose(data["stress"].values[0], [-1e6, -3e6, -1e6, 2e5], rtol=1e-12)
    assert np.allclose(data["current_area"][0, -1] / data["area"][0], np.linalg.det(np.eye(2) + gradient), rtol=1e-12)


def test_polygon_and_the_picture_of_the_steps(folder, tmp_path):
    corners = [(1.0, 1.0), (5.0, 1.0), (5.0, 4.0), (1.0, 4.0)]
    homogenize.run([folder / "dem0.nc"], tmp_path / "p.nc", polygon=corners, steps_picture=tmp_path / "steps.png")
    assert float(read_artifact(tmp_path / "p.nc", "curves")["area"][0]) > 12.0
    assert (tmp_path / "steps.png").stat().st_size > 20_000


def test_outlines_for_paraview(folder, tmp_path):
    import pyvista

    homogenize.run([folder / "dem0.nc", folder / "dem1.nc"], tmp_path / "c.nc", radii=[1.5], vtk=True)
    data = read_artifact(tmp_path / "c.nc", "curves")
    reader = pyvista.get_reader(str(tmp_path / "c.pvd"))
    assert np.allclose(reader.time_values, data["time"][0])
    reader.set_active_time_value(reader.time_values[6])
    grid = reader.read()[0]
    assert set(grid.cell_data) == {"path", "stress", "strain"}
    assert np.allclose(grid.cell_data["stress"][-1, :4], data["stress"][1, 6])
    length = np.linalg.norm(np.diff(grid.points[grid.cells.reshape(-1, 3)[:, 1:]], axis=1), axis=-1).sum()
    assert 2 * 2 * np.pi * 1.5 < length < 2 * 2 * np.pi * 3.0


def test_every_fault_is_named_and_nothing_written(folder, tmp_path):
    out = tmp_path / "x.nc"
    with pytest.raises(BadInput, match="inside the model") as caught:
        homogenize.run([folder / "dem0.nc", folder / "dem1.nc"], out, radii=[3.5, 2.0, 9.0])
    assert len(caught.value.faults) == 4
    with pytest.raises(BadInput, match="inside the model"):
        homogenize.run([folder / "dem0.nc"], out, radii=[1.0], centre=(5.5, 3.0))
    with pytest.raises(BadInput, match="positive radius"):
        homogenize.run([folder / "dem0.nc"], out, radii=[-1.0])
    with pytest.raises(BadInput, match="simple"):
        homogenize.run([folder / "dem0.nc"], out, polygon=[(1, 1), (2, 2), (2, 1), (1, 2)])
    with pytest.raises(BadInput, match="saved state"):
        homogenize.run([folder / "dem0.nc"], out, radii=[1.0], chosen_at=40)
    with pytest.raises(BadInput, match="either a `radius`"):
        homogenize.run([folder / "dem0.nc"], out)
    with pytest.raises(BadInput, match="existing artifact"):
        homogenize.run([folder / "none.nc"], out, radii=[1.0])
    assert not list(tmp_path.iterdir())
    out.write_bytes(b"x")
    with pytest.raises(BadInput, match="does not exist yet"):
        homogenize.run([folder / "dem0.nc"], out, radii=[1.0])


def test_a_run_that_stopped_at_its_first_state(tmp_path):
    """What an interrupted run leaves: one state, no contact."""
    _, arrays = blocks_arrays()
    for name, variable in LAYOUT.variables.items():
        if name in arrays and variable.dims[:1] == ("time",):
            arrays[name] = arrays[name][:1]
        elif name in arrays and variable.dims[:1] == ("contact",):
            arrays[name] = arrays[name][:0]
    arrays["contact_count"] = np.zeros(1)
    write_artifact(tmp_path / "short.nc", LAYOUT, arrays, Record.begin())
    homogenize.run([tmp_path / "short.nc"], tmp_path / "c.nc", radii=[1.5])
    data = read_artifact(tmp_path / "c.nc", "curves")
    assert data["step_count"].values.tolist() == [1] and not data["strain"].values.any()
    with pytest.raises(BadInput, match="three saved states"):
        rev_study.run([tmp_path / "short.nc"], small_scene(), tmp_path / "r.nc")


def test_broken_artifacts_are_refused(folder, tmp_path):
    whole = (folder / "dem0.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(whole[: len(whole) // 2])
    _, arrays = blocks_arrays()
    arrays["contact_count"][0] += 1
    arrays["zone_vertex"] = arrays["zone_vertex"] + 10_000
    write_artifact(tmp_path / "odd.nc", LAYOUT, arrays, Record.begin())
    with pytest.raises(BadInput) as caught:
        homogenize.run([tmp_path / "cut.nc", tmp_path / "odd.nc"], tmp_path / "x.nc", radii=[1.0])
    text = str(caught.value)
    assert "cut.nc" in text and "contact_count" in text and "zone_vertex" in text
    assert not (tmp_path / "x.nc").exists()


def test_command_line(folder, tmp_path):
    from graben.cli.homogenize import main

    out = tmp_path / "c.nc"
    call = [str(folder / "dem0.nc"), "--radius", "150 cm", "--centre", "3 m, 2.8 m", "-o", str(out), "--json", "-q"]
    result = CliRunner().invoke(main, call)
    assert result.exit_code == 0, result.output
    assert json.loads(result.output)["paths"][0]["area_m2"] > 7.0
    bad = CliRunner().invoke(main, [*call[:1], "--radius", "4 MPa", "-o", str(tmp_path / "y.nc")])
    assert bad.exit_code == 2 and "--radius" in bad.output and not (tmp_path / "y.nc").exists()
    for option, text in (("--polygon", ""), ("--polygon", "1 m,1 m; 9 m,1 m"), ("--centre", "")):
        bad = CliRunner().invoke(main, [*call[:3], option, text, "-o", str(tmp_path / "y.nc")])
        assert bad.exit_code == 2 and option in bad.output  # an empty one is no option left out
    assert CliRunner().invoke(main, call).exit_code == 2


def small_scene(*overrides):
    return default_scene("rev-study", ['samples.radii=["0.8 m", "1.4 m", "2 m"]', "samples.grid=2", *overrides])


def test_rev_study_over_runs(folder, tmp_path):
    runs = [folder / f"dem{k}.nc" for k in range(3)]
    headline = rev_study.run(runs, small_scene("processes=1"), tmp_path / "one.nc")
    data = read_artifact(tmp_path / "one.nc", "rev-study")
    assert data["peak_stress"].shape == (3, 4, 3)
    # The sample of one radius, centre and run is that of homogenize.
    x, y = data["centre_position"].values[1, 2]
    homogenize.run([runs[1]], tmp_path / "c.nc", radii=[1.4], centre=(float(x), float(y)))
    curve = read_artifact(tmp_path / "c.nc", "curves")
    assert np.array_equal(curve["stress"].values[0], data["stress"].values[1, 2, 1])
    assert data["peak_stress"].values[1, 2, 1] == -curve["stress"].values[0, :, 1].min()
    assert headline["samples"] == 36 and data.attrs["bootstrap_over"] == "runs"
    assert (
        data["secant_modulus_low"].values[2]
        <= data["secant_modulus_mean"].values[2]
        <= data["secant_modulus_high"].values[2]
    )
    # Two worker processes: the same arrays, bit by bit.
    rev_study.run(runs, small_scene("processes=2"), tmp_path / "two.nc")
    two = read_artifact(tmp_path / "two.nc", "rev-study")
    assert data.identical(two.assign_attrs(data.attrs))


def test_rev_study_on_a_cluster(folder, tmp_path):
    """The samples of a Dask cluster are those of this process, bit by bit."""
    distributed = pytest.importorskip("distributed")
    rev_study.run([folder / "dem0.nc"], small_scene("processes=1"), tmp_path / "one.nc")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit=0
    ) as local:
        rev_study.run([folder / "dem0.nc"], small_scene(), tmp_path / "two.nc", cluster=local.scheduler_address)
    one, two = (read_artifact(tmp_path / f"{n}.nc", "rev-study") for n in ("one", "two"))
    assert one.identical(two.assign_attrs(one.attrs))


def test_rev_study_faults(folder, tmp_path):
    out = tmp_path / "r.nc"
    with pytest.raises(BadInput, match="one study per lateral stress"):
        rev_study.run([folder / "dem0.nc", folder / "other.nc"], small_scene(), out)
    with pytest.raises(BadInput, match="leaves room"):
        rev_study.run([folder / "dem0.nc"], default_scene("rev-study"), out)
    with pytest.raises(BadInput, match="inside the model"):
        rev_study.run([folder / "dem0.nc"], small_scene('samples.centres=[["1 m", "1 m"]]'), out)
    with pytest.raises(BadInput, match="larger than the one before"):
        default_scene("rev-study", ['samples.radii=["2 m", "1 m"]'])
    with pytest.raises(BadInput, match="existing"):
        rev_study.run([folder / "none.nc"], small_scene(), out)
    assert not out.exists()


def test_pictures(folder, tmp_path):
    from graben.stages.tools import picture

    homogenize.run([folder / "dem0.nc"], tmp_path / "c.nc", radii=[1.0, 2.0])
    rev_study.run([folder / "dem0.nc"], small_scene("processes=1"), tmp_path / "r.nc")
    for name in "cr":
        picture.run(tmp_path / f"{name}.nc", tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_rev_study_command_line(folder, tmp_path):
    from graben.cli.rev_study import main

    call = [str(folder / "dem0.nc"), "--radius", "0.8 m", "--radius", "1.5 m", "--grid", "2", "--processes", "1"]
    result = CliRunner().invoke(main, [*call, "-o", str(tmp_path / "r.nc"), "--json", "-q"])
    assert result.exit_code == 0, result.output
    assert "reason" in json.loads(result.output)
    bad = CliRunner().invoke(main, [*call, "--set", "tests.tolerance=2", "-o", str(tmp_path / "s.nc")])
    assert bad.exit_code == 2 and "tests.tolerance" in bad.output
