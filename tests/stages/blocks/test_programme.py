"""dem-run on blocks of any outline: weight, rising pressure, failure; stopped runs go on bitwise."""

import json

import numpy as np
import pytest
import xarray

from graben.errors import BadInput
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.dem_run import stage as dem_run
from graben.stages.tools import picture

SLOPE = """
kind = "blocks"
seed = 2
[domain]
outline = [["0 m","0 m"],["8 m","0 m"],["8 m","5 m"],["4 m","5 m"],["3 m","2 m"],["0 m","2 m"]]
[tessellation]
edge = "0.5 m"
[numerics]
steps = 10000
[output]
vtk = false
[programme]
save_every = "8 s"
falling = true
[[programme.supports]]
start = ["0 m","0 m"]
end = ["0 m","2 m"]
fix = "x"
[[programme.supports]]
start = ["8 m","0 m"]
end = ["8 m","5 m"]
fix = "x"
[[programme.supports]]
start = ["0 m","0 m"]
end = ["8 m","0 m"]
fix = "y"
[[programme.loads]]
start = ["5.1 m","5 m"]
end = ["6.1 m","5 m"]
rate = "0.25 MPa/s"
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("slope") / "slope.toml"
    path.write_text(SLOPE)
    return path


@pytest.fixture(scope="module")
def finished(scene):
    output = scene.with_name("straight.nc")
    return output, dem_run.run(scene, output)


def same(a, b):
    with xarray.open_dataset(a) as left, xarray.open_dataset(b) as right:
        assert set(left.variables) == set(right.variables)
        for name in left.variables:
            assert np.array_equal(left[name].values, right[name].values), name


def test_a_loaded_slope_fails_after_it_stood(finished):
    output, headline = finished
    assert check_artifact(output) == []
    assert headline["failed"]
    assert (
        1e6 < headline["failure_load_low_pa"] < headline["failure_load_pa"] < headline["failure_load_high_pa"] < 25e6
    )
    assert headline["failure_load_pa"] < headline["largest_load_pa"] < headline["failure_load_high_pa"]
    assert headline["true_time_s"] > 0.0
    assert 0.0 < headline["failure_settlement_m"] <= headline["settlement_m"] * 1.5
    assert headline["energy_error"] < 0.05
    d = read_artifact(output, "blocks")
    # The base and the weight at the first state, then the load as well.
    weight = 9.81 * 2700.0 * float(d.block_area.sum())
    vertical = d.boundary_force.values[..., 1].sum(axis=1)
    assert vertical[0] == pytest.approx(weight, rel=0.01)
    load = 0.25e6 * d.load_time.values[1]
    assert abs(vertical[1] - weight) < 0.2 * load
    assert 0.0 < headline["inertia_over_load"] < 0.2
    assert d.load_time.values[0] == 0.0
    # Past the failure the load falls with the ground, which goes on as far again; what is at rest is never more.
    assert d.look_load_time.values[-1] < d.look_load_time.values.max()
    assert d.look_settlement.values[-1] > 1.8 * headline["settlement_m"]
    assert (d.look_load_at_rest <= d.look_load_time).all()
    surface = d.vertex_position.values[d.surface_vertex.values]
    assert surface[:, 1].max() == pytest.approx(5.0, abs=0.02)
    assert not np.any((surface[:, 1] < 1.9) & (surface[:, 0] > 0.1))
    assert headline["settlement_max_m"] == pytest.approx(-d.surface_carried_displacement.values[:, 1].min(), rel=0.5)


def test_picture_of_a_slope(finished):
    output = finished[0].with_name("slope.png")
    picture.run(finished[0], output)
    assert output.stat().st_size > 10_000


def test_interrupted_and_restarted_is_bitwise_the_straight_run(scene, finished):
    output = scene.with_name("stopped.nc")

    def stop(fraction, message):
        if fraction > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dem_run.run(scene, output, progress=stop)
    kept = output.with_name("stopped.checkpoint.npz")
    assert kept.is_file()
    assert not output.exists()
    dem_run.run(scene, output, restart=True)
    same(finished[0], output)
    assert not kept.exists()


def test_compression_restarts_bitwise(scene):
    text = 'kind = "blocks"\n[domain]\nwidth = "2 m"\nheight = "2 m"\n[numerics]\nsteps = 1500\n'
    text += '[loading]\nstates = 6\nspeed = "0.1 mm/s"\n[output]\nvtk = false\n'
    path = scene.with_name("square.toml")
    path.write_text(text)
    straight, stopped = path.with_name("a.nc"), path.with_name("b.nc")
    dem_run.run(path, straight)
    for stop_at in (0.0, 0.6):

        def stop(fraction, message, stop_at=stop_at):
            if message.startswith("state") and fraction >= stop_at:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            dem_run.run(path, stopped, progress=stop, overwrite=True)
        dem_run.run(path, stopped, restart=True, overwrite=True)
        same(straight, stopped)


def test_restart_wants_a_checkpoint_of_this_scene(scene):
    output = scene.with_name("none.nc")
    with pytest.raises(BadInput, match="a checkpoint"):
        dem_run.run(scene, output, restart=True)

    def stop(fraction, message):
        if fraction > 0.01:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dem_run.run(scene, output, progress=stop)
    with pytest.raises(BadInput, match="another scene"):
        dem_run.run(scene, output, restart=True, overrides=["seed=3"])
    kept = scene.with_name("none.checkpoint.npz")
    whole = kept.read_bytes()
    for data in (whole[: len(whole) // 2], b""):
        kept.write_bytes(data)
        with pytest.raises(BadInput, match="saved states") as error:
            dem_run.run(scene, output, restart=True)
        assert error.value.faults[0].file == str(kept)


def test_a_body_that_does_not_stand_is_a_failure_of_the_run(scene):
    slippery = [
        'joints.friction="0 deg"',
        'joints.cohesion="0 Pa"',
        'joints.dilation="0 deg"',
        "programme.falling=false",
    ]
    headline = dem_run.run(scene, scene.with_name("falls.nc"), overrides=slippery)
    assert headline["failed"] and headline["failure_load_pa"] is None
    assert headline["fallen_blocks"] > 0 and headline["first_fallen_step"] > 0
    assert check_artifact(scene.with_name("falls.nc")) == []


@pytest.mark.parametrize(
    ("setting", "word"),
    [
        ('programme.loads=[{start=["5 m","4 m"],end=["6 m","4 m"]}]', "outline"),
        ('programme.supports=[{start=["5 m","4 m"],end=["6 m","4 m"]}]', "outline"),
        ("programme.supports=[]", "support"),
        ("programme.strength_reduction=true", "do not change"),
        (
            'programme={bracket=0.1,excavations=[{polygon=[["4 m","1 m"],["5 m","1 m"],["5 m","2 m"]]}]}',
            "no excavations with a bracket",
        ),
        ("numerics.stop_loose_blocks=true", "stop_loose_blocks"),
        ('loading.speed="1 mm/s"', "either"),
        ('domain.outline=[["0 m","0 m"],["8 m","5 m"],["8 m","0 m"],["0 m","5 m"]]', "cross"),
    ],
)
def test_bad_programmes_are_refused(scene, setting, word):
    with pytest.raises(BadInput) as refused:
        dem_run.run(scene, scene.with_name("never.nc"), overrides=[setting])
    assert any(word in str(f) for f in refused.value.faults)


def test_loads_and_strength_are_bracketed(scene):
    output = scene.with_name("bracket.nc")
    load = 'programme.loads=[{start=["5.1 m","5 m"],end=["6.1 m","5 m"],rate="1 MPa/s"}]'
    fast = ["programme.falling=false", load]
    headline = dem_run.run(scene, output, overrides=["programme.bracket=0.2", *fast])
    low, load, high = (headline[f"failure_load_{name}pa"] for name in ("low_", "", "high_"))
    assert headline["failed"] and 0.0 < low < load < high < 1.3 * low
    assert "factor_of_safety" not in headline
    assert check_artifact(output) == []
    dead = ['programme.loads=[{start=["5.1 m","5 m"],end=["6.1 m","5 m"],pressure="1 MPa"}]']
    safety = dem_run.run(
        scene,
        scene.with_name("safety.nc"),
        overrides=[*dead, "programme.strength_reduction=true", "programme.bracket=0.2"],
    )
    assert safety["failed"] and safety["failure_load_pa"] is None
    assert 1.0 < safety["factor_of_safety_low"] < safety["factor_of_safety"] < safety["factor_of_safety_high"]
    assert check_artifact(scene.with_name("safety.nc")) == []
    with xarray.open_dataset(scene.with_name("safety.nc")) as dataset:
        assert safety["factor_of_safety"] < dataset["load_time"].values[-1] < safety["factor_of_safety_high"]


KEY = """
kind = "blocks"
fidelity = "draft"
[domain]
holes = [[["1 m","0 m"],["2 m","0 m"],["2 m","0.05 m"],["1 m","0.05 m"]]]
[tessellation]
method = "file"
file = "key.geojson"
edge = "1 m"
shortest_edge = "5 mm"
thinnest = "5 mm"
rounding = "1 cm"
[rock]
young = "20 GPa"
density = "2500 kg/m^3"
[joints]
friction = "0 deg"
cohesion = "20 kPa"
dilation = "0 deg"
[output]
vtk = false
[programme]
end = "10 s"
supports = [
  {start = ["0 m","-0.5 m"], end = ["3 m","-0.5 m"]},
  {start = ["0 m","0 m"], end = ["0 m","1.05 m"], fix = "x"},
  {start = ["3 m","0 m"], end = ["3 m","1.05 m"], fix = "x"},
]
"""


@pytest.mark.parametrize("bracket", ["", "programme.bracket=0.05"], ids=["rise", "bracket"])
def test_a_key_block_that_drops_under_a_load_that_jumps_and_rests_has_failed(tmp_path, bracket):
    """2 c (h - 2 r) less the weight, 14.7 kPa, lies inside the jump; times in the artifact are those of the scene."""
    rings = [(0, 0, 1, 1.05), (1, 0.05, 2, 1.05), (2, 0, 3, 1.05), (0, -0.5, 3, 0)]
    shapes = [[[[a, b], [c, b], [c, d], [a, d], [a, b]]] for a, b, c, d in rings]
    features = [{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": shape}} for shape in shapes]
    (tmp_path / "key.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    path, output = tmp_path / "key.toml", tmp_path / "key.nc"
    course = '[["0 s","0 Pa"],["5 s","0 Pa"],["5 s","60 kPa"],["10 s","60 kPa"]]'
    path.write_text(KEY + f'loads = [{{start = ["1 m","1.05 m"], end = ["2 m","1.05 m"], course = {course}}}]\n')
    headline = dem_run.run(path, output, overrides=[bracket] if bracket else [])
    exact = 2.0 * 20e3 * 0.98 - 2500.0 * 9.81
    assert headline["failed"] and headline["failure_load_pa"] == pytest.approx(exact, rel=0.05)
    assert 0.99 * headline["failure_load_low_pa"] < exact < 1.01 * headline["failure_load_high_pa"]
    assert headline["failure_load_high_pa"] - headline["failure_load_low_pa"] < 0.2 * exact
    times = read_artifact(output, "blocks").look_load_time.values
    assert times.min() >= 0.0 and times.max() <= 5.0 + 1e-9


def test_a_wide_bracket_is_told_with_what_makes_it_narrower(tmp_path):
    """A block pushed along its joint, bracketed to 30 %."""
    push = KEY.replace("key.geojson", "push.geojson").replace('friction = "0 deg"', 'friction = "20 deg"')
    a, b, c = push.index("[domain]"), push.index("[tessellation]"), push.index("supports = [")
    shapes = [[[[x, y], [x + 2, y], [x + 2, y + h], [x, y + h], [x, y]]] for x, y, h in ((0, -0.5, 0.5), (0, 0, 1))]
    features = [{"type": "Feature", "geometry": {"type": "Polygon", "coordinates": shape}} for shape in shapes]
    (tmp_path / "push.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    path = tmp_path / "push.toml"
    path.write_text(
        push[:a] + push[b:c] + 'bracket = 0.3\nsupports = [{start = ["0 m","-0.5 m"], end = ["2 m","-0.5 m"]}]\n'
        'loads = [{start = ["0 m","0 m"], end = ["0 m","1 m"], rate = "10 kPa/s"}]\n'
    )
    headline = dem_run.run(path, tmp_path / "push.nc")
    assert headline["failed"]
    (warning,) = headline["warnings"]
    assert "interval of the failure load" in warning and "programme.bracket" in warning
