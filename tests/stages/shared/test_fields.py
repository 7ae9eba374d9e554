"""output.fields: what is asked for is written as ever, other fields are absent, later stages find what they need."""

import numpy as np
import pytest
import xarray

from graben.stages.shared.fields import kept
from tests.conftest import SMALL_BED, SMALL_BLOCKS, command, made, settings


def test_variables_of_other_fields_and_those_of_none_are_kept():
    arrays, spare = {"a": 1, "b": 2, "c": 3}, {"a": "first", "b": "second"}
    assert kept(None, arrays, spare) == arrays
    assert kept(["first"], arrays, spare) == {"a": 1, "c": 3}
    assert kept([], arrays, spare) == {"c": 3}


def run(kind, small, folder, name, fields=None):
    scene = folder / f"{kind}.toml"
    scene.write_text(command("scene", kind).output)
    asked = [] if fields is None else [f"output.fields={fields}"]
    tool = {"fem": "fem-run", "scratch": "scratch"}.get(kind, "dem-run")
    made(tool, scene, *settings([*small, *asked]), "-o", folder / name, "-q")
    return folder / name


def fields_of(artifact, tag=""):
    import pyvista

    grid = pyvista.get_reader(artifact.with_name(f"{artifact.stem}{tag}.pvd")).read()[0]
    return {*grid.point_data.keys(), *grid.cell_data.keys()}


def compared(full, part):
    """Variables that only the full artifact has; those of both are the same."""
    with xarray.open_dataset(full, decode_times=False) as a, xarray.open_dataset(part, decode_times=False) as b:
        assert set(b.variables) <= set(a.variables)
        for name in set(b.variables) - {"path_name"}:
            assert np.array_equal(a[name], b[name], equal_nan=a[name].dtype.kind == "f"), name
        return set(a.variables) - set(b.variables)


def test_blocks(tmp_path):
    full = run("blocks", SMALL_BLOCKS, tmp_path, "full.nc")
    part = run("blocks", SMALL_BLOCKS, tmp_path, "part.nc", '["stress", "slip"]')
    none = {"velocity", "contact_opening", "contact_normal_stress", "contact_shear_stress"}
    assert compared(full, part) == none
    assert fields_of(part) == {"stress"} and fields_of(part, "-joints") == {"slip"}
    assert fields_of(full) > {"stress", "displacement"} and fields_of(full, "-joints") > {"slip", "force"}
    made("check", part)
    for artifact in (full, part):
        made("homogenize", artifact, "--radius", "1 m", "-o", artifact.with_name(f"{artifact.stem}-curves.nc"))
        made("show", artifact, "-o", artifact.with_suffix(".png"))
    assert compared(tmp_path / "full-curves.nc", tmp_path / "part-curves.nc") == set()


def test_yielding_zones(tmp_path):
    weak = [*SMALL_BLOCKS, 'rock.zones="mohr-coulomb"']
    part = run("blocks", weak, tmp_path, "part.nc", '["plastic_strain"]')
    assert fields_of(part) == {"plastic_strain"} and fields_of(part, "-joints") == set()
    with xarray.open_dataset(part, decode_times=False) as data:
        assert "zone_plastic_strain" in data and "zone_state" not in data


def test_grains(tmp_path):
    full = run("particles", SMALL_BED, tmp_path, "full.nc")
    part = run("particles", SMALL_BED, tmp_path, "part.nc", '["radius"]')
    assert compared(full, part) == {"velocity", "coordination"}
    assert fields_of(part) == {"radius"}
    made("check", part)
    made("show", part, "-o", tmp_path / "part.png")


def test_finite_elements(tmp_path):
    small = ["fidelity=draft", 'stepping.end="1 s"']
    full = run("fem", small, tmp_path, "full.nc")
    part = run("fem", small, tmp_path, "part.nc", '["displacement", "von_mises_stress"]')
    assert compared(full, part) == {"stress", "strain", "plastic_strain", "damage"}
    assert fields_of(part) == {"displacement", "von_mises_stress"}
    made("check", part)
    made("show", part, "-o", tmp_path / "part.png")


def test_a_scratch(tmp_path):
    small = ["fidelity=draft", 'tip.path="2 um"', 'tip.depth="1 um"']
    part = run("scratch", small, tmp_path, "part.nc", "[]")
    assert fields_of(part) == set()


@pytest.mark.parametrize("kind", ["blocks", "particles", "fem", "scratch"])
def test_an_unknown_field_is_refused_with_those_that_there_are(kind, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(command("scene", kind).output)
    tool = {"fem": "fem-run", "scratch": "scratch"}.get(kind, "dem-run")
    result = command(tool, scene, "--set", 'output.fields=["colour"]', "-o", tmp_path / "a.nc")
    assert result.exit_code == 2
    assert "scene.toml: output.fields" in result.output and "'colour'" in result.output
    assert "'velocity'" in result.output or "'displacement'" in result.output
