"""calibrate as a stage and as a command: the UDEC curves, the same bits twice, faults, outputs that feed others."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray
from click.testing import CliRunner

from graben.cli.calibrate import main
from graben.errors import BadInput
from graben.stages.calibrate import stage as calibrate
from graben.stages.shared.material import pack_material
from graben.stages.tools.check import check

ROOT = Path(__file__).parents[3]
SCENE = ROOT / "pipelines/upscaling/calibrate-udec.toml"
REFERENCE = ROOT / "pipelines/upscaling/reference/udec_voronoi_granite_fit.csv"
QUICK = ["swarm.starts=1", "swarm.particles=8", "swarm.generations=3", "refine.best=1", "refine.iterations=2"]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("calibrate")
    return folder / "udec.nc", calibrate.run(SCENE, folder / "udec.nc", overrides=["fidelity=draft"])


def test_udec_curves_are_fitted_better_than_by_yetisir(fitted):
    """Y 4.2 reports a vertical-stress RMSE of 1.03 MPa; the draft search already stays below."""
    _path, headline = fitted
    assert headline["rmse_pa"] < 1.03e6
    assert headline["incomplete"] == []


def test_artifact_is_whole_and_says_what_it_does_not_know(fitted):
    path, headline = fitted
    assert check(path) == []
    with xarray.open_dataset(path) as data:
        model, measured = data["stress"].values[..., 1], data["stress_measured"].values[..., 1]
        assert np.sqrt(np.nanmean((model - measured) ** 2)) == pytest.approx(headline["rmse_pa"], rel=1e-12)
        assert (data["value"] >= data["lower"]).all() and (data["value"] <= data["upper"]).all()
        free = data["at_bound"].values == 0
        assert np.isfinite(data["standard_error"].values[free & (data["identifiable"].values == 1)]).all()
        correlation = data["correlation"].values[np.ix_(free, free)]
        np.testing.assert_allclose(np.diag(correlation)[np.isfinite(np.diag(correlation))], 1.0)
    names = set(headline["parameters"])
    assert set(headline["at_bounds"]) | set(headline["not_identifiable"]) <= names


def test_material_file_feeds_the_next_stage(fitted):
    path, headline = fitted
    record, _par, values = pack_material(path.with_suffix(".material.toml"), "scene")
    assert record.name == "drucker-prager"
    assert all(values[n] == v for n, v in headline["parameters"].items())
    _record, _par, again = pack_material(path, "scene")
    assert again == values


def test_picture_is_drawn(fitted, tmp_path):
    from graben.stages.tools import picture

    picture.run(fitted[0], tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 20_000


def test_parameters_that_are_all_held_by_a_bound_make_a_sound_artifact(tmp_path):
    """Their standard errors are no numbers, and the stages that follow take them."""
    scene = {
        "kind": "calibrate", "curves": [str(REFERENCE)], "law": "mohr-coulomb", "length": "7.1 m",
        "free": {"young_modulus": {"lower": "0.5 GPa", "upper": "0.6 GPa"}},
        "fixed": {"poisson_ratio": 0.2, "friction_angle": "50 deg", "dilation_angle": "9 deg", "cohesion": "9 kPa"},
    }  # fmt: skip
    headline = calibrate.run(scene, tmp_path / "bound.nc", overrides=QUICK)
    assert headline["at_bounds"] == ["young_modulus"]
    assert check(tmp_path / "bound.nc") == []
    assert (
        pack_material(tmp_path / "bound.nc", "scene")[2]["young_modulus"] == headline["parameters"]["young_modulus"]
    )


def test_same_scene_and_seed_give_the_same_bits_whatever_the_workers(tmp_path):
    headlines = []
    for name, workers in (("a", 1), ("b", 2)):
        headlines.append(calibrate.run(SCENE, tmp_path / f"{name}.nc", overrides=[*QUICK, f"workers={workers}"]))
    with xarray.open_dataset(tmp_path / "a.nc") as a, xarray.open_dataset(tmp_path / "b.nc") as b:
        for name in a.variables:
            np.testing.assert_array_equal(a[name].values, b[name].values)
    assert headlines[0]["parameters"] == headlines[1]["parameters"]


def test_command_prints_json_and_validates_on_curves_it_did_not_fit(tmp_path):
    text = REFERENCE.read_text().splitlines()
    part, rest = tmp_path / "part.csv", tmp_path / "rest.csv"
    part.write_text("\n".join([text[0], *(r for r in text[1:] if not r.startswith("2000000"))]) + "\n")
    rest.write_text("\n".join([text[0], *(r for r in text[1:] if r.startswith("2000000"))]) + "\n")
    out = tmp_path / "o.nc"
    arguments = [str(SCENE), str(part), "--validate", str(rest), "-o", str(out), "--json", "-q"]
    result = CliRunner().invoke(main, [*arguments, *(part for q in QUICK for part in ("--set", q))])
    assert result.exit_code == 0, result.output
    headline = json.loads(result.stdout)
    assert set(headline["curve_rmse_pa"]) == {"0.5 MPa", "1 MPa", "4 MPa"}
    assert set(headline["validation_curve_rmse_pa"]) == {"2 MPa"}
    assert headline["validation_rmse_pa"] > 0
    assert 0.0 <= headline["validation_inside_95_band"] <= 1.0
    with xarray.open_dataset(out) as data:
        assert data["role"].values.tolist() == ["fit", "fit", "fit", "validation"]
        band = data["axial_stress_error"].values
        assert (band[np.isfinite(band)] >= headline["rmse_pa"]).all()
        assert np.isfinite(band).sum(axis=1).tolist() == data["step_count"].values.tolist()


def test_cross_validation_reports_each_curve(tmp_path):
    headline = calibrate.run(SCENE, tmp_path / "o.nc", overrides=[*QUICK, "cross_validation=true"])
    assert set(headline["holdout_rmse_pa"]) == {"0.5 MPa", "1 MPa", "2 MPa", "4 MPa"}
    assert headline["cross_validation_rmse_pa"] > 0


@pytest.mark.parametrize(
    ("override", "key"),
    [
        ('free.young_modulus={lower="5 GPa",upper="2 GPa"}', "free.young_modulus.lower"),
        ('free.young_modulus={lower="1 GPa",upper="2 GPa",initial="3 GPa"}', "free.young_modulus.initial"),
        ('free.young_modulus={lower="1 m",upper="2 m"}', "free.young_modulus"),
        ("free.young_modulus={lower=1e9,upper=2e9}", "free.young_modulus"),
        ("free.poisson_ratio={lower=0.1,upper=0.6}", "free.poisson_ratio.upper"),
        ("free.colour={lower=0.1,upper=0.6}", "free.colour"),
        ('fixed.poisson_ratio="0.2"', "poisson_ratio"),
        ("fixed.poisson_ratio=0.2", "either free or fixed"),
        ('law="granite"', "law"),
        ("swarm.particles=0", "swarm.particles"),
        ('fixed.hardening="barcelona"', "peak_yield"),
        ('length="3"', "length"),
    ],
)
def test_faults_of_the_scene_are_named_and_nothing_is_written(tmp_path, override, key):
    with pytest.raises(BadInput) as error:
        calibrate.run(SCENE, tmp_path / "o.nc", overrides=[override])
    assert key in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_existing_output_and_missing_curves_are_refused(tmp_path):
    out = tmp_path / "o.nc"
    out.write_text("mine")
    with pytest.raises(BadInput, match="overwrite"):
        calibrate.run(SCENE, out)
    assert out.read_text() == "mine"
    with pytest.raises(BadInput, match="curves"):
        calibrate.run(ROOT / "pipelines/upscaling/calibrate.toml", tmp_path / "p.nc")
    result = CliRunner().invoke(main, [str(SCENE), str(tmp_path / "absent.csv"), "-o", str(tmp_path / "q.nc")])
    assert result.exit_code == 2 and "absent.csv" in result.output
