"""dem-run on blocks with in-situ stress and excavation: the artifact, what reads it, and stopped runs."""

import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact
from graben.stages.dem_run import stage as dem_run
from graben.stages.homogenize import stage as homogenize
from graben.stages.tools import picture
from tests.stages.blocks.test_loading import stopped_and_straight

TUNNEL = """
kind = "blocks"
seed = 4
[domain]
outline = [["0 m","0 m"],["4 m","0 m"],["4 m","4 m"],["0 m","4 m"]]
[in_situ]
k0 = 0.7
syy = "-0.5 MPa"
[numerics]
steps = 3000
[programme]
save_every = "40 s"
[[programme.supports]]
start = ["0 m","0 m"]
end = ["4 m","0 m"]
fix = "y"
[[programme.supports]]
start = ["0 m","0 m"]
end = ["0 m","4 m"]
fix = "x"
[[programme.supports]]
start = ["4 m","0 m"]
end = ["4 m","4 m"]
fix = "x"
[[programme.loads]]
start = ["0 m","4 m"]
end = ["4 m","4 m"]
pressure = "0.5 MPa"
[[programme.excavations]]
name = "heading"
polygon = [["1.2 m","1.8 m"],["2.8 m","1.8 m"],["2.8 m","2.8 m"],["1.2 m","2.8 m"]]
time = "20 s"
relax_over = "30 s"
[[programme.excavations]]
name = "bench"
polygon = [["1.2 m","1.2 m"],["2.8 m","1.2 m"],["2.8 m","1.8 m"],["1.2 m","1.8 m"]]
time = "60 s"
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("digging") / "tunnel.toml"
    path.write_text(TUNNEL)
    return path


@pytest.fixture(scope="module")
def dug(scene):
    # Stopped while the forces of the heading fade.
    return stopped_and_straight(scene, 0.45)


def test_two_stages_of_digging(scene, dug):
    d, headline = dug
    assert not headline["failed"]
    assert headline["failure_load_pa"] is None
    removed = d.block_removed.values
    assert removed[0].sum() == 0
    assert headline["blocks_removed"] == removed[-1].sum() > 8
    assert np.all(np.diff(removed.astype(int), axis=0) >= 0)
    assert len(np.unique(removed.sum(axis=1))) == 3
    # Rest came at once: the stress was in balance.
    assert np.abs(d.displacement.values[d.load_time.values <= 20.0]).max() < 1e-9
    gone = removed[:, d.zone_block.values] == 1
    assert not d.zone_stress.values[gone].any()
    assert not d.velocity.values[-1][removed[-1, d.vertex_block.values] == 1].any()
    assert headline["energy_error"] < 0.02
    assert d.energy_excavated.values[-1] > d.energy_excavated.values[0] == 0.0
    # Weight and load still reach the ground, less what was taken out.
    left = 2700 * 9.81 * float(d.block_area.values[removed[-1] == 0].sum())
    supports = d.boundary_force.values[-1, :, 1].sum()
    assert supports == pytest.approx(left, abs=0.02 * 0.5e6 * 4.0)
    # Walls come in.
    middle = d.vertex_position.values[:, 0] < 1.3
    near = middle & (np.abs(d.vertex_position.values[:, 1] - 2.0) < 0.5) & (d.vertex_position.values[:, 0] > 0.6)
    assert d.displacement.values[-1, near, 0].mean() > 0.0


def test_what_reads_it_leaves_out_what_is_gone(scene, dug):
    import pyvista

    output = scene.with_suffix(".a.nc")
    series = pyvista.get_reader(output.with_suffix(".pvd"))
    cells = []
    for time in (series.time_values[0], series.time_values[-1]):
        series.set_active_time_value(time)
        cells.append(series.read()[0].n_cells)
    removed = dug[0].block_removed.values[-1]
    assert cells[0] - cells[1] == removed[dug[0].zone_block.values].sum()
    picture.run(output, scene.with_suffix(".png"))
    corner = scene.with_name("corner.nc")
    homogenize.run([output], corner, radii=[0.4], centre=(0.6, 3.4))
    stress = read_artifact(corner, "curves").stress.values[0]
    assert stress[0, :2] == pytest.approx([-0.36e6, -0.515e6], rel=0.05)
    with pytest.raises(BadInput, match="clear of blocks that are taken out"):
        homogenize.run([output], scene.with_name("never.nc"), radii=[0.8])


@pytest.mark.parametrize(
    ("setting", "key", "word"),
    [
        (
            'programme.excavations=[{polygon=[["9 m","9 m"],["10 m","9 m"],["9 m","10 m"]]}]',
            "programme.excavations.0",
            "middle of a block",
        ),
        ('programme.excavations=[{polygon=[["9 m","9 m"],["10 m","9 m"]]}]', "polygon", "3"),
        (
            'programme.excavations=[{polygon=[["1 m","1 m"],["2 m","1 m"],["1 m","2 m"]],time="-1 s"}]',
            "time",
            "greater than or equal",
        ),
        ('rock.zones="rigid"', "", "no in_situ"),
        ('rock.zones="rigid"', "", "no programme.excavations"),
        ('in_situ.sxx="-1 MPa"', "in_situ", "either k0 or sxx"),
        ('in_situ.syy="-1 MPa/m"', "in_situ.syy", "Pa"),
        ('in_situ.syy="-100 GPa"', "", "5 %"),
    ],
)
def test_bad_scenes_are_refused(scene, setting, key, word):
    with pytest.raises(BadInput) as refused:
        dem_run.run(scene, scene.with_name("never.nc"), overrides=[setting])
    assert any(key in f.key and word in str(f) for f in refused.value.faults), refused.value.faults


def test_k0_wants_weight_and_compression_starts_from_in_situ_stress(tmp_path):
    scene = tmp_path / "square.toml"
    scene.write_text(
        'kind = "blocks"\n[domain]\nwidth = "2 m"\nheight = "2 m"\n[in_situ]\nsxx = "-0.5 MPa"\nsyy = "-0.25 MPa"\n'
        '[loading]\nstates = 3\nspeed = "0.1 mm/s"\n[numerics]\nsteps = 1000\n[output]\nvtk = false\n'
    )
    dem_run.run(scene, tmp_path / "a.nc")
    d = read_artifact(tmp_path / "a.nc", "blocks")
    assert np.abs(d.vertex_position.values - d.vertex_position.values.round(12)).max() < 1e-9
    assert d.zone_stress.values[0, :, 0] == pytest.approx(-0.5e6, rel=1e-6)
    with pytest.raises(BadInput, match="which has weight"):
        dem_run.run(scene, tmp_path / "b.nc", overrides=["in_situ={k0=0.5}"])
