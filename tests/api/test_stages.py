"""graben.run, graben.homogenize, graben.open, graben.scene, graben.check: stages from Python."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import graben
from graben.cli.homogenize import main as homogenize_command
from graben.schemas.artifact import read_artifact
from tests.conftest import PIPELINES, command

WEAR = {
    "kind": "wear",
    "machine": {"applied_load": "100 N", "contact_area": "50 mm^2"},
    "grains": [
        {"name": "coarse sand", "diameter": "0.6 mm", "grooves": [
            {"force": "0.5 N", "area": "80 um^2", "degree_of_wear": 0.3}]},
    ],
    "mixtures": [{"name": "all", "shares": {"coarse sand": 1.0}}],
    "load": {"mode": "given"},
}  # fmt: skip


def test_import_is_quick_and_names_are_public():
    script = (
        "import sys, time; t = time.perf_counter(); import graben; d = time.perf_counter() - t\n"
        "heavy = {'numpy','scipy','numba','xarray','pyvista','matplotlib','pydantic','pint','click'}\n"
        "print(d, sorted(heavy & set(sys.modules))); assert set(graben.__all__) == set(dir(graben))\n"
        "for name in graben.__all__: getattr(graben, name)\n"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    seconds, heavy = out.split(" ", 1)
    assert heavy.strip() == "[]" and float(seconds) < 5.0  # loose: the machine may be busy
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = graben.nonsense


def test_every_public_name_says_what_it_is():
    for name in graben.__all__:
        if name != "__version__":
            assert (getattr(graben, name).__doc__ or "").strip(), name


def test_tables_run_as_the_file_with_the_same_keys(tmp_path):
    result = graben.run(WEAR)
    folder = result.output.parent
    data = result.open()
    assert data["wear_rate"].values[0] == result["mixtures"][0]["wear_rate_m3_per_s"] > 0.0
    assert list(result) == ["mixtures"] and result.warnings and "warning: " in repr(result)

    about = graben.provenance(data)
    assert about.scene == graben.provenance(result.output).scene == WEAR
    assert (about.kind, about.version, about.seed, about.inputs) == ("wear", graben.__version__, 0, {})
    assert about.cost["mixtures"] == 1 and about.warnings == result.warnings

    path = tmp_path / "scene.toml"
    path.write_text(about.scene_text, encoding="utf-8")
    named = graben.run(path, tmp_path / "named.nc", set={"title": "from a file", "seed": np.int64(4)})
    assert named.output == tmp_path / "named.nc"
    np.testing.assert_array_equal(named.open()["wear_rate"], data["wear_rate"])
    assert graben.provenance(named.output).scene == {**WEAR, "title": "from a file", "seed": 4}
    assert graben.provenance(named.output).seed == 4

    del result
    assert not folder.exists()


def test_paths_in_tables_are_relative_to_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tables = {"kind": "fem", "material": {"file": "rock.material.toml"}}
    assert ["material.file" in f.key for f in graben.check(tables)] == [True]
    Path("rock.material.toml").write_text(
        'law = "elastic"\n[parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.2\n'
    )
    assert graben.check(tables, fidelity="draft") == []
    assert graben.check("rock.material.toml") == []


def test_a_scene_is_checked_once_and_may_be_changed():
    scene = graben.scene("particles", grains=[{"name": "g", "diameter": "100 um"}], set={"box.width": "1 mm"})
    assert (scene.kind, scene.box.width, scene.seed) == ("particles", 1e-3, 0)
    assert graben.scene(scene) is scene
    other = graben.scene(scene, seed=3)
    assert (other.seed, other.box.width) == (3, 1e-3) and other.source.sha256 != scene.source.sha256
    faults = graben.check(scene, {"box.width": 3, "box.depth": "1 furlong"})
    assert [f.key for f in faults] == ["box.width", "box.depth"] and "no unit" in faults[0].expected
    assert [f.file for f in graben.check({"kind": "nothing"})] == ["(scene)"]
    assert "not object" in graben.check({"kind": "fem", "title": object()})[0].expected


def test_inputs_may_be_results_and_strange_ones_are_refused(small_bed):
    tables = {
        "kind": "wear",
        "machine": {"applied_load": "100 N", "contact_area": "50 mm^2"},
        "counts": {"source": "bed"},
        "load": {"mode": "given"},
    }
    bed = graben.open(small_bed)
    name, diameter = str(bed["class_name"].values[0]), float(bed["class_diameter"].values[0])
    groove = {"force": "0.5 mN", "area": "2 um^2", "degree_of_wear": 0.3}
    tables["grains"] = [{"name": name, "diameter": f"{diameter!r} m", "grooves": [groove]}]
    tables["mixtures"] = [{"name": "bed", "shares": {name: 1.0}}]
    result = graben.run(tables, bed=small_bed)
    assert list(graben.provenance(result.output).inputs) == [str(small_bed)]
    with pytest.raises(graben.BadInput, match=r"bed: expected no such input of a scene of kind 'particles'"):
        graben.run(PIPELINES / "wear/bed.toml", bed=small_bed)
    with pytest.raises(graben.BadInput, match="inputs: expected at least one run of blocks"):
        graben.run("rev-study")
    with pytest.raises(graben.BadInput, match="here or as `bed`"):
        graben.run(tables)


def test_homogenize_takes_numbers_and_text_and_several_of_each(small_blocks, small_curves):
    result = graben.homogenize(small_blocks, radius=1.0)
    with_units = graben.homogenize([small_blocks], radius=["100 cm", 0.9], centre=("1.5 m", 1.5))
    here, there = result.open(), read_artifact(small_curves, "curves")
    for name in there.variables:
        np.testing.assert_array_equal(here[name], there[name])
    assert with_units.open()["radius"].values.tolist() == [1.0, 0.9]
    square = [(0.8, 0.8), (2.2, 0.8), (2.2, 2.2), (0.8, 2.2)]
    assert len(graben.homogenize(small_blocks, radius=None, polygon=square)["paths"]) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"radius": 1.0, "centre": (1.0, 1.0, 1.0)}, "centre = 3 lengths: expected x, y for blocks"),
        ({}, "radius: expected either a `radius` or a `polygon`"),
        ({"radius": "1 kg"}, "radius = '1 kg': expected a number in m"),
        ({"radius": 1.0, "chosen_at": 99}, "chosen_at = 99: expected a saved state"),
        ({"radius": 9.0}, "radius = circle of radius 9 m"),
    ],
)
def test_messages_speak_of_arguments_in_python_and_of_options_on_the_command_line(
    arguments, said, small_blocks, tmp_path
):
    with pytest.raises(graben.BadInput, match=re.escape(said)) as caught:
        graben.homogenize(small_blocks, tmp_path / "out.nc", **arguments)
    assert "--" not in str(caught.value)
    options = {"radius": "--radius", "centre": "--centre", "chosen_at": "--chosen-at"}
    given = {
        "radius": lambda v: v if isinstance(v, str) else f"{v} m",
        "centre": lambda v: ",".join(f"{c} m" for c in v),
        "chosen_at": str,
    }
    flags = [part for name, value in arguments.items() for part in (options[name], given[name](value))]
    shown = command("homogenize", small_blocks, *flags, "-o", tmp_path / "out.nc")
    name = re.search(r"(radius|centre|chosen_at)", said)[1]
    assert shown.exit_code == 2 and options[name] in shown.stderr and "`" not in shown.stderr
    assert homogenize_command.name == "homogenize"


def test_an_output_that_exists_is_kept_and_what_to_say_is_an_argument(tmp_path):
    graben.run(WEAR, tmp_path / "rate.nc")
    with pytest.raises(graben.BadInput, match=r"\(or `overwrite`\)") as caught:
        graben.run(WEAR, tmp_path / "rate.nc")
    assert "--" not in str(caught.value)
    graben.run(WEAR, tmp_path / "rate.nc", overwrite=True)


def test_what_a_failed_run_kept_lives_as_long_as_its_error():
    scene = {
        "kind": "fem", "fidelity": "draft", "material": {"law": "j2", "parameters": {
            "young_modulus": "1 GPa", "poisson_ratio": 0.3, "hardening": [[0.0, "1 MPa"], [1.0, "1 MPa"]]}},
        "mesh": {"size": "0.5 m", "corners": [["0 m", "0 m"], ["1 m", "0 m"], ["1 m", "1 m"], ["0 m", "1 m"]],
                 "patches": [[0, 1, 2, 3]], "refine": []},
        "supports": [{"start": ["0 m", "0 m"], "end": ["1 m", "0 m"], "fix": "both"}],
        "loads": [{"start": ["0 m", "1 m"], "end": ["1 m", "1 m"], "rate": "1 MPa/s"}],
        "stepping": {"goal": "end", "end": "10 s", "first": "0.5 s"},
    }  # fmt: skip
    with pytest.raises(graben.NumericsFailed) as caught:
        graben.run(scene)
    kept = Path(re.search(r"is in (\S+)", caught.value.__notes__[0])[1])
    assert kept.is_file() and graben.provenance(kept).partial
