"""Bad input: exit code 2, every fault named with file, key and what was expected, and nothing written."""

import shutil

import numpy as np
import pytest
import xarray

from graben.schemas.template import template
from tests.conftest import PIPELINES, command

# Every command that takes a scene: kind, how it is called, a key with a dimension, a value of the wrong dimension.
SCENES = {
    "blocks": (["dem-run"], "rock.young", '"65 m"'),
    "particles": (["dem-run"], "loading.pressure", '"30 s"'),
    "calibrate": (["calibrate"], "length", '"10 GPa"'),
    "fem": (["fem-run"], "mesh.size", '"1 MPa"'),
    "scratch": (["scratch"], "tip.radius", '"50 N"'),
    "wear": (["wear-estimate"], "machine.applied_load", '"130 mm"'),
}


def refuse(folder, *arguments):
    """Run a command that must refuse its input; returns what it said."""
    before = sorted(folder.rglob("*"))
    result = command(*arguments)
    assert result.exit_code == 2, (result.exit_code, result.output)
    assert "Traceback" not in result.output
    assert sorted(folder.rglob("*")) == before, "something was written"
    return result.stderr


def scene_of(kind, folder):
    path = folder / "scene.toml"
    path.write_text(template(kind))
    return path


@pytest.mark.parametrize("kind", SCENES)
class TestScenes:
    def test_unknown_keys_and_wrong_dimensions_are_all_named(self, kind, tmp_path):
        call, key, wrong = SCENES[kind]
        scene = scene_of(kind, tmp_path)
        faults = ["--set", "nonsense=1", "--set", f"{key}={wrong}", "--set", "seed=-4"]
        said = refuse(tmp_path, *call, scene, *faults, "-o", tmp_path / "out.nc")
        assert "nonsense = 1: expected no such key" in said
        assert f"{key} = " in said and "dimension" in said
        assert "seed = -4" in said
        assert said.count(str(scene)) >= 3

    def test_wrong_units_and_missing_units(self, kind, tmp_path):
        call, key, _ = SCENES[kind]
        scene = scene_of(kind, tmp_path)
        for wrong in ('"3 furlongz"', "3.0", '"much"'):
            said = refuse(tmp_path, *call, scene, "--set", f"{key}={wrong}", "-o", tmp_path / "out.nc")
            assert f"{key} = " in said and "expected a quantity in" in said

    def test_missing_scene(self, kind, tmp_path):
        call, _, _ = SCENES[kind]
        assert "existing scene file" in refuse(tmp_path, *call, tmp_path / "none.toml", "-o", tmp_path / "out.nc")

    def test_scene_of_another_kind(self, kind, tmp_path):
        call, _, _ = SCENES[kind]
        other = scene_of("rev-study", tmp_path)
        assert "kind = 'rev-study': expected" in refuse(tmp_path, *call, other, "-o", tmp_path / "out.nc")

    def test_existing_output_is_kept(self, kind, tmp_path):
        call, _, _ = SCENES[kind]
        out = tmp_path / "out.nc"
        out.write_text("precious")
        arguments = [tmp_path / "curves.csv"] if kind == "calibrate" else []
        if arguments:
            shutil.copy(PIPELINES / "upscaling/reference/udec_voronoi_granite_fit.csv", arguments[0])
        said = refuse(tmp_path, *call, scene_of(kind, tmp_path), *arguments, "-o", out)
        assert "--overwrite" in said
        assert out.read_text() == "precious"


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("blocks", "joints.normal_stiffness", '"-10 GPa/m"'),
        ("blocks", "rock.young", '"-65 GPa"'),
        ("particles", "contact.normal_stiffness", '"-1 N/m"'),
        ("fem", "material.parameters.young_modulus", '"-1 GPa"'),
        ("scratch", "material.parameters.young_modulus", '"-210 GPa"'),
    ],
)
def test_negative_stiffness(kind, key, value, tmp_path):
    call = SCENES[kind][0]
    said = refuse(tmp_path, *call, scene_of(kind, tmp_path), "--set", f"{key}={value}", "-o", tmp_path / "out.nc")
    assert key.rpartition(".")[2] in said


def test_an_empty_bed(tmp_path):
    empty = ["--set", 'box.width="0.4 mm"', "--set", 'box.depth="1 um"']
    said = refuse(tmp_path, "dem-run", scene_of("particles", tmp_path), *empty, "-o", tmp_path / "out.nc")
    assert "at least one grain" in said


@pytest.fixture
def broken(small_blocks, tmp_path):
    """name -> a file that is no good artifact of blocks."""
    files = {name: tmp_path / f"{name}.nc" for name in ("missing", "truncated", "foreign", "text", "nan")}
    whole = small_blocks.read_bytes()
    files["truncated"].write_bytes(whole[: len(whole) // 2])
    xarray.Dataset({"t": ("x", [1.0])}).to_netcdf(files["foreign"])
    files["text"].write_text("time,stress\n")
    with xarray.open_dataset(small_blocks, decode_times=False) as data:
        data = data.load()
    data["zone_stress"] = data["zone_stress"] * np.nan
    data["zone_stress"].attrs["units"] = "Pa"
    data.to_netcdf(files["nan"])
    return files


EXPECTED = {
    "missing": "existing",
    "truncated": "NetCDF-4",
    "foreign": "not an artifact",
    "text": "NetCDF-4",
    "nan": "zone_stress",
}


@pytest.mark.parametrize("fault", EXPECTED)
@pytest.mark.parametrize(
    "call",
    [
        ("homogenize", "{}", "--radius", "1 m", "-o", "{out}"),
        ("rev-study", "{}", "-o", "{out}"),
        ("show", "{}", "-o", "{out}.png"),
        ("check", "{}"),
    ],
    ids=lambda call: call[0],
)
def test_artifacts_that_are_none(call, fault, broken, tmp_path):
    arguments = [a.format(broken[fault], out=tmp_path / "out.nc") for a in call]
    said = refuse(tmp_path, *arguments)
    assert str(broken[fault]) in said
    assert EXPECTED[fault] in said


def test_curves_bed_and_grooves_of_the_wrong_kind(small_blocks, tmp_path):
    out = tmp_path / "out.nc"
    assert "'curves'" in refuse(tmp_path, "calibrate", scene_of("calibrate", tmp_path), small_blocks, "-o", out)
    wear = PIPELINES / "wear/own-bed-and-groove.toml"
    assert "'particles'" in refuse(tmp_path, "wear-estimate", wear, "--bed", small_blocks, "-o", out)
    assert "'scratch'" in refuse(tmp_path, "wear-estimate", wear, "--scratch", f"grains={small_blocks}", "-o", out)
    assert "'calibration'" in refuse(
        tmp_path, "fem-run", scene_of("fem", tmp_path), "--material", small_blocks, "-o", out
    )


@pytest.mark.parametrize("where", [["--radius", "2 m"], ["--radius", "1 m", "--centre", "0.2 m,1.5 m"]])
def test_an_rev_outside_the_domain(where, small_blocks, tmp_path):
    said = refuse(tmp_path, "homogenize", small_blocks, *where, "-o", tmp_path / "out.nc")
    assert "inside" in said or "within" in said


def test_radii_need_units(small_blocks, tmp_path):
    said = refuse(tmp_path, "homogenize", small_blocks, "--radius", "1", "-o", tmp_path / "out.nc")
    assert "--radius" in said


@pytest.mark.parametrize(
    "wrong",
    [
        ("homogenize", "--radius", "1,0 m"),
        ("homogenize", "--radius", "1 000 mm"),
        ("homogenize", "--radius", "9**9**9 m"),
        ("homogenize", "--radius", "1e-300 m"),
        ("homogenize", "--radius", "1 m", "--centre", "1,5 m,1,5 m"),
        ("homogenize", "--polygon", "0.5 m,0.5 m; 2,5 m,0.5 m; 1 m,2 m"),
        ("rev-study", "--radius", "0,5 m", "--radius", "1 m"),
        ("rev-study", "--radius", '0.5 m", "0.6 m', "--radius", "1 m"),
    ],
)
def test_lengths_of_options_are_one_number_and_one_unit(wrong, small_blocks, tmp_path):
    tool, *options = wrong
    said = refuse(tmp_path, tool, small_blocks, *options, "-o", tmp_path / "out.nc")
    assert "quantity in m" in said or "two lengths" in said


def test_pictures_of_unknown_format(small_blocks, tmp_path):
    assert ".png" in refuse(tmp_path, "show", small_blocks, "-o", tmp_path / "a.bmp")


def test_a_report_needs_artifacts(tmp_path):
    assert "artifacts" in refuse(tmp_path, "report", tmp_path, "-o", tmp_path / "a.html")
