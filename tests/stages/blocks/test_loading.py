"""dem-run on blocks whose loading runs over time: courses, damping; what is refused; stopped runs go on bitwise."""

import json

import numpy as np
import pytest
import xarray

from graben.errors import BadInput
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.dem_run import stage as dem_run

SQUARE = """
kind = "blocks"
seed = 2
[domain]
width = "2 m"
height = "2 m"
[loading]
speed_course = [["0 s","0 mm/s"],["2 s","0.2 mm/s"],["50 s","0.2 mm/s"],["50 s","-0.2 mm/s"],["70 s","-0.2 mm/s"],
    ["70 s","0.2 mm/s"]]
confining_course = [["0 s","0.5 MPa"],["30 s","0.5 MPa"],["60 s","0.8 MPa"]]
states = 6
[numerics]
steps = 2000
[output]
vtk = false
"""
BENCH = """
kind = "blocks"
seed = 2
[domain]
outline = [["0 m","0 m"],["2 m","0 m"],["2 m","2 m"],["0 m","2 m"]]
[numerics]
steps = 4000
consolidation_tolerance = 1e-2
[output]
vtk = false
[programme]
save_every = "20 s"
[[programme.supports]]
start = ["0 m","0 m"]
end = ["2 m","0 m"]
[[programme.loads]]
start = ["0 m","2 m"]
end = ["2 m","2 m"]
course = [["0 s","0.1 MPa"],["40 s","0.5 MPa"],["60 s","0.5 MPa"],["90 s","0.2 MPa"]]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("loading")
    (path / "square.toml").write_text(SQUARE)
    (path / "bench.toml").write_text(BENCH)
    return path


def same(a, b):
    with xarray.open_dataset(a) as left, xarray.open_dataset(b) as right:
        assert set(left.variables) == set(right.variables)
        for name in left.variables:
            assert np.array_equal(left[name].values, right[name].values), name


def stopped_and_straight(scene, at, overrides=()):
    """Outputs of a run that was stopped and went on, with two threads, and of one that was not."""
    straight, stopped = scene.with_suffix(".a.nc"), scene.with_suffix(".b.nc")
    headline = dem_run.run(scene, straight, overrides=overrides, overwrite=True)

    def stop(fraction, message):
        if fraction >= at:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dem_run.run(scene, stopped, overrides=overrides, progress=stop, overwrite=True)
    dem_run.run(scene, stopped, overrides=overrides, restart=True, overwrite=True)
    same(straight, stopped)
    assert check_artifact(straight) == []
    return read_artifact(straight, "blocks"), headline


def test_compression_with_unloading_and_rising_confinement(folder):
    d, headline = stopped_and_straight(folder / "square.toml", 0.5)
    assert d.confining_stress_then.values == pytest.approx([-5e5, -5e5, -6e5, -8e5, -8e5, -8e5])
    side = d.wall_reaction.values[:, 1, 0] / 2.0
    assert side == pytest.approx(d.confining_stress_then.values, rel=1e-3)
    # 49 s down, 20 s up, 30 s down at 0.2 mm/s.
    top = d.vertex_position.values[:, 1] > 1.999
    moved = -d.displacement.values[:, top, 1].mean(axis=1)
    assert moved[[3, 5]] == pytest.approx(np.array([39.0, 59.0]) * 2e-4, rel=2e-2)
    assert headline["strain_at_peak"] == pytest.approx(-59.0 * 1e-4)
    assert 0.9 < headline["lateral_over_applied_stress"] < 1.5
    dem_run.run(folder / "square.toml", folder / "two.nc", overrides=["numerics.threads=2"])
    with xarray.open_dataset(folder / "two.nc") as two:
        assert np.array_equal(two.displacement.values, d.displacement.values)


def test_a_force_check_drives_the_pace(folder):
    steady = ['loading={speed="0.1 mm/s", states=6}', "numerics.steps=1000"]
    check = [*steady, "numerics.force_check=0.05", "numerics.most_steps=6000"]
    d, headline = stopped_and_straight(folder / "square.toml", 0.5, check)
    cost = json.loads(d.attrs["cost"])
    assert 1000 < cost["loading_steps"] <= 6100
    assert headline["loading_steps"] == cost["loading_steps"]
    assert 0.0 < cost["force_check_mean"] < cost["force_check_worst"]
    # States are those of the scene's time, whatever the steps.
    assert d.time.values == pytest.approx(np.linspace(0.0, 100.0, 6))
    top = d.vertex_position.values[:, 1] > 1.999
    assert d.displacement.values[-1, top, 1].mean() == pytest.approx(-0.1e-3 * 99.5, rel=1e-6)
    plain = dem_run.run(folder / "square.toml", folder / "plain.nc", overrides=steady)
    assert "force_check_mean" not in plain
    assert abs(headline["kinetic_over_stored_energy"]) < plain["kinetic_over_stored_energy"]
    # Loose tolerance, and leave to be faster: it is.
    fast = [*steady, "numerics.force_check=0.9", "numerics.least_steps=500"]
    assert dem_run.run(folder / "square.toml", folder / "fast.nc", overrides=fast)["loading_steps"] < 1000


def test_a_pressure_that_falls_again(folder):
    d, headline = stopped_and_straight(folder / "bench.toml", 0.5)
    assert not headline["failed"]
    assert headline["failure_load_pa"] is None
    assert headline["largest_load_pa"] == 0.5e6
    load = -np.interp(d.load_time.values, [0, 40, 60, 90, 100], [1e5, 5e5, 5e5, 2e5, 2e5]) * 2.0
    total = d.boundary_force.values[:, :, 1].sum(axis=1)
    weight = 2700 * 9.81 * 4.0
    assert total == pytest.approx(np.full(len(total), weight), abs=0.05 * abs(load).max())
    top = d.vertex_position.values[:, 1] > 1.99
    assert d.boundary_force.values[:, top, 1].sum(axis=1) == pytest.approx(load, rel=2e-2)
    sunk = d.look_settlement.values
    assert sunk[-1] < sunk.max()
    assert headline["energy_error"] < 0.02


@pytest.mark.parametrize(
    "damping",
    [
        ['numerics.damping="local"', "numerics.damping_share=0.5"],
        ['numerics.damping="viscous"', 'numerics.damping_coefficient="2 1/s"'],
    ],
)
def test_other_dampings_damp_and_close_the_ledger(folder, damping):
    output = folder / "damped.nc"
    headline = dem_run.run(folder / "square.toml", output, overrides=damping, overwrite=True)
    d = read_artifact(output, "blocks")
    assert headline["energy_error"] < 0.02
    assert d.energy_damping.values[-1] > 0.0
    dem_run.run(folder / "square.toml", folder / "adaptive.nc", overwrite=True)
    assert not np.array_equal(
        d.displacement.values, read_artifact(folder / "adaptive.nc", "blocks").displacement.values
    )


@pytest.mark.parametrize(
    ("scene", "setting", "key", "word"),
    [
        ("square", 'loading.speed="1 mm/s"', "loading", "either speed or speed_course"),
        ("square", 'loading.speed_course=[["1 s","1 mm/s"],["0 s","1 mm/s"]]', "loading", "do not fall"),
        ("square", 'loading.speed_course=[["-1 s","1 mm/s"]]', "loading", "from 0 s on"),
        ("square", 'loading.speed_course=[["0 s","0 mm/s"]]', "loading", "other than 0"),
        ("square", 'loading.speed_course=[["0 s","1 m/s"],["50 s","-1 m/s"]]', "", "one half"),
        ("square", 'loading.confining_course=[["0 s","1 MPa"]]', "loading", "begins at 0 s"),
        ("square", 'loading.confining_course=[["0 s","0.5 MPa"],["5 s","-1 MPa"]]', "loading", "positive"),
        ("square", 'loading.confining_course=[["0 s","0.5 m"]]', "confining_course", "Pa"),
        ("square", 'numerics.damping="local"', "numerics", "damping_share"),
        ("square", 'numerics.damping="viscous"', "numerics", "damping_coefficient"),
        ("square", "numerics.force_check=0", "numerics.force_check", "greater than or equal to"),
        ("square", "numerics.most_steps=1000", "numerics", "force_check for most_steps"),
        ("bench", "numerics.force_check=0.1", "", "[loading] only"),
        ("square", "numerics.damping_share=0.5", "numerics", 'damping = "local"'),
        (
            "bench",
            'programme.loads=[{start=["0 m","2 m"],end=["2 m","2 m"],rate="1 Pa/s",course=[["0 s","1 Pa"]]}]',
            "programme.loads",
            "either course",
        ),
    ],
)
def test_bad_loading_is_refused(folder, scene, setting, key, word):
    with pytest.raises(BadInput) as refused:
        dem_run.run(folder / f"{scene}.toml", folder / "never.nc", overrides=[setting])
    assert any(key in f.key and word in str(f) for f in refused.value.faults), refused.value.faults


def test_two_dampings_and_too_strong_a_drag_are_refused(folder):
    both = ['numerics.damping="local"', "numerics.damping_share=0.5", "numerics.damping_ratio=0.5"]
    with pytest.raises(BadInput, match='damping = "adaptive"'):
        dem_run.run(folder / "square.toml", folder / "never.nc", overrides=both)
    strong = ['numerics.damping="viscous"', 'numerics.damping_coefficient="21 1/s"']
    with pytest.raises(BadInput, match=r"damping_coefficient.*at most"):
        dem_run.run(folder / "square.toml", folder / "never.nc", overrides=strong)
