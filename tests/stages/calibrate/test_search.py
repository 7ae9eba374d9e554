"""calibrate's ways to search: methods, stages, priors, restart, comparison of laws, a cluster that loses workers."""

import os
import signal

import numpy as np
import pytest
import xarray

from graben.errors import BadInput
from graben.schemas.saved import write_saved
from graben.stages.calibrate import stage as calibrate
from graben.stages.tools.check import check
from tests.conftest import PIPELINES

SCENE = PIPELINES / "upscaling/calibrate-udec.toml"
SMALL = ["swarm.particles=8", "swarm.generations=4", "refine.best=1", "refine.iterations=2", "increments=1"]
QUICK = ["swarm.starts=1", *SMALL]
RIVAL = """
kind = "calibrate"
law = "mohr-coulomb"
seed = 99
[fixed]
tensile_strength = "1 kPa"
[free]
young_modulus = { lower = "0.5 GPa", upper = "25 GPa", scale = "log" }
poisson_ratio = { lower = 0.05, upper = 0.45 }
friction_angle = { lower = "40 deg", upper = "62 deg" }
dilation_angle = { lower = "5 deg", upper = "40 deg" }
cohesion = { lower = "1 kPa", upper = "2 MPa", scale = "log" }
"""


def same(a, b):
    """Bitwise the same arrays."""
    with xarray.open_dataset(a) as one, xarray.open_dataset(b) as two:
        assert set(one.variables) == set(two.variables)
        for name in one.variables:
            np.testing.assert_array_equal(one[name].values, two[name].values)


@pytest.mark.parametrize("method", ["dds", "differential-evolution", "cma-es"])
def test_other_searches_fit_the_curves_too(tmp_path, method):
    quick = [*QUICK, f'search="{method}"', "refine.iterations=10"]
    headline = calibrate.run(SCENE, tmp_path / "o.nc", overrides=quick)
    assert headline["rmse_pa"] < 3e6
    with xarray.open_dataset(tmp_path / "o.nc") as data:
        assert (data["value"] >= data["lower"]).all() and (data["value"] <= data["upper"]).all()


def test_the_asynchronous_swarm_gives_the_same_bits_on_processes(tmp_path):
    for name, workers in (("a", 1), ("b", 2)):
        overrides = [*QUICK, 'search="appso"', f"workers={workers}"]
        calibrate.run(SCENE, tmp_path / f"{name}.nc", overrides=overrides)
    same(tmp_path / "a.nc", tmp_path / "b.nc")


@pytest.mark.parametrize("staged", ["false", "true"])
def test_an_interrupted_calibration_goes_on_and_ends_as_a_straight_one(tmp_path, staged):
    overrides = ["swarm.starts=3", *SMALL, "cross_validation=true", f"staged={staged}"]
    straight = calibrate.run(SCENE, tmp_path / "a.nc", overrides=overrides)
    told = []

    def stop(fraction, words):
        told.append(words)
        if words.startswith("start 2 of 3 done") or "without 4 MPa" in words:
            raise KeyboardInterrupt

    out, state = tmp_path / "b.nc", tmp_path / "b.state.npz"
    with pytest.raises(KeyboardInterrupt):
        calibrate.run(SCENE, out, overrides=overrides, progress=stop)
    assert state.is_file() and not out.exists()
    told.clear()
    with pytest.raises(KeyboardInterrupt):
        calibrate.run(SCENE, out, overrides=overrides, restart=True, progress=stop)
    assert [words.split(",")[0] for words in told if words.startswith("start")] == ["start 3 of 3 done"]
    resumed = calibrate.run(SCENE, out, overrides=overrides, restart=True)
    same(tmp_path / "a.nc", out)
    assert resumed["holdout_rmse_pa"] == straight["holdout_rmse_pa"]
    assert not state.exists()


def test_the_state_of_another_scene_is_refused(tmp_path):
    def stop(fraction, words):
        if "done" in words:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=QUICK, progress=stop)
    with pytest.raises(BadInput, match=": restart"):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=[*QUICK, "seed=7"], restart=True)
    (tmp_path / "o.state.npz").write_bytes(b"torn")
    with pytest.raises(BadInput, match=": restart"):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=QUICK, restart=True)
    assert (tmp_path / "o.state.npz").read_bytes() == b"torn"


@pytest.mark.parametrize(
    ("table", "change"),
    [
        ("members", lambda found: found[:, :-1]),
        ("members", lambda found: found[:, :0]),
        ("members", lambda found: found + 2.0),
        ("members", lambda found: found.astype("U8")),
        ("values", lambda found: -found),
        ("values", lambda found: found[:0]),
        ("history", lambda found: found * np.nan),
    ],
)
def test_a_state_whose_tables_are_none_of_the_search_is_refused(tmp_path, table, change):
    def stop(fraction, words):
        if "done" in words:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=QUICK, progress=stop)
    with np.load(tmp_path / "o.state.npz") as data:
        tables = {name: data[name] for name in data.files if name != "sha256"}
    [name] = [name for name in tables if name.endswith(f"0|{table}")]
    write_saved(tmp_path / "o.state.npz", {}, tables | {name: change(tables[name])})
    with pytest.raises(BadInput, match=r"o\.state\.npz: .*\|0\|"):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=QUICK, restart=True)


def test_stages_begin_the_search_nearer_to_the_optimum(tmp_path):
    """The last search begins with what the stages found: its first generation is already a fit."""
    first = {}
    for staged in ("false", "true"):
        out = tmp_path / f"{staged}.nc"
        calibrate.run(
            SCENE, out, overrides=[*QUICK, "swarm.particles=16", "swarm.generations=15", f"staged={staged}"]
        )
        with xarray.open_dataset(out) as data:
            first[staged] = float(data["history"].values[0])
    assert first["true"] < 0.5 * first["false"]


def test_a_prior_pulls_its_parameter_and_narrows_its_error(tmp_path):
    def fit(name, *more):
        quick = [*QUICK, "refine.iterations=25", "swarm.generations=20"]
        headline = calibrate.run(SCENE, tmp_path / f"{name}.nc", overrides=[*quick, *more])
        return headline["parameters"]["poisson_ratio"], headline["standard_errors"]["poisson_ratio"]

    def prior(deviation):
        return f"free.poisson_ratio={{lower=0.05,upper=0.45,prior={{mean=0.3,deviation={deviation}}}}}"

    value, error = fit("strong", prior(0.002))
    assert value == pytest.approx(0.3, abs=0.004) and error <= 0.0025
    free, _error = fit("free")
    loose, _error = fit("weak", prior(100.0))
    assert loose == pytest.approx(free, abs=0.02)
    assert abs(free - 0.3) > 0.02


@pytest.mark.parametrize(
    ("prior", "key"),
    [
        ("{mean=0.6,deviation=0.1}", "poisson_ratio.prior.mean"),
        ("{mean=0.2,deviation=0.0}", "poisson_ratio.prior.deviation"),
        ('{mean="1 Pa",deviation=0.1}', "poisson_ratio.prior.mean"),
    ],
)
def test_a_bad_prior_is_named(tmp_path, prior, key):
    override = f"free.poisson_ratio={{lower=0.05,upper=0.45,prior={prior}}}"
    with pytest.raises(BadInput, match=key):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=[override])


def test_laws_are_compared_by_curves_they_were_not_fitted_to(tmp_path):
    from graben.stages.tools import picture

    rival, out = tmp_path / "mohr.toml", tmp_path / "o.nc"
    rival.write_text(RIVAL)
    quick = [*QUICK, "swarm.generations=20", "refine.iterations=10"]
    headline = calibrate.run(SCENE, out, overrides=quick, compare=[rival, rival])
    table = headline["comparison"]
    assert {row["name"] for row in table} == {"calibrate-udec", "mohr", "mohr 2"}
    assert table[0]["law"] == "drucker-prager" and table[0]["parameters"] == 11 and table[1]["parameters"] == 5
    assert table[1]["cross_validation_rmse_pa"] == table[2]["cross_validation_rmse_pa"]
    assert table[0]["cross_validation_rmse_pa"] == headline["cross_validation_rmse_pa"]
    assert [r["cross_validation_rmse_pa"] for r in table] == sorted(r["cross_validation_rmse_pa"] for r in table)
    assert check(out) == []
    picture.run(out, tmp_path / "o.png")
    assert (tmp_path / "o.png").stat().st_size > 20_000


@pytest.fixture(scope="module")
def cluster():
    import distributed

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", memory_limit=0
    ) as local:
        yield local


@pytest.mark.parametrize("method", ["appso", "swarm"])
def test_a_cluster_that_loses_a_worker_gives_the_same_bits(cluster, method, tmp_path):
    """A worker is killed in the middle; the scheduler gives its tasks to another."""
    from distributed import Client

    overrides = ["swarm.starts=3", *SMALL, "swarm.generations=10", f'search="{method}"']
    calibrate.run(SCENE, tmp_path / "here.nc", overrides=overrides)
    killed = []

    def kill_one(fraction, words):
        if not killed:
            with Client(cluster.scheduler_address) as client:
                killed.append(sorted(client.run(os.getpid).values())[0])
            os.kill(killed[0], signal.SIGKILL)

    out = tmp_path / "there.nc"
    calibrate.run(SCENE, out, overrides=overrides, cluster=cluster.scheduler_address, progress=kill_one)
    assert killed
    same(tmp_path / "here.nc", out)


def test_no_cluster_is_a_fault(tmp_path, monkeypatch):
    monkeypatch.setattr("graben.stages.calibrate.workers.PATIENCE_S", 1.0)
    with pytest.raises(BadInput, match=r"^cluster"):
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=QUICK, cluster="tcp://127.0.0.1:9")


@pytest.mark.parametrize("scene", sorted((PIPELINES / "upscaling/laws").glob("*.toml")), ids=lambda p: p.stem)
def test_the_laws_to_compare_are_without_fault_and_fit(scene, tmp_path):
    assert check(scene) == []
    curves = [PIPELINES / "upscaling/reference/udec_voronoi_granite_fit.csv"]
    headline = calibrate.run(scene, tmp_path / "o.nc", curves=curves, overrides=[*QUICK, "staged=true"])
    assert headline["rmse_pa"] < 5e6
