"""The scratch stage on a small scene: artifact, VTU, headline, bad input, failure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput, NumericsFailed
from graben.schemas.artifact import read_artifact
from graben.stages.scratch import stage as scratch
from graben.stages.tools import picture

SMALL = (
    "specimen.length='90 um'",
    "specimen.width='80 um'",
    "mesh.size='2.4 um'",
    "tip.start='30 um'",
    "tip.path='16 um'",
    "numerics.slide_speed=0.03",
    "numerics.indent_speed=0.006",
    "output.frames=1",
    "output.sections=23",
    "output.points=61",
    "fidelity=draft",
)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scratch") / "scene.toml"
    path.write_text('kind = "scratch"\n')
    return path


@pytest.fixture(scope="module")
def done(scene: Path) -> tuple[Path, dict]:
    output = scene.parent / "out.nc"
    return output, scratch.run(scene, output, overrides=SMALL)


def test_artifact_holds_what_the_layout_says(done: tuple[Path, dict]) -> None:
    path, headline = done
    data = read_artifact(path, "scratch")
    for name in ("groove_area", "degree_of_wear", "normal_force"):
        key = next(k for k in headline if k.startswith(name) and "loaded" not in k and "by" not in k)
        assert float(data[name]) == headline[key]
    assert list(data["phase_name"].values) == ["indent", "slide", "lift", "rest"]
    segment = 50e-6**2 * np.arccos(0.96) - 48e-6 * np.sqrt(196e-12)
    assert headline["groove_area_m2"] == pytest.approx(segment, rel=0.12)  # penalty and a 4 um mesh
    assert 0.5 < headline["degree_of_wear"] < 0.9 and headline["s_over_a"] == pytest.approx(16 / 2 / 200**0.5)
    assert abs(data["volume_closure"].values).max() < 1e-9
    assert json.loads(data.attrs["cost"])["steps"] > 100


def test_degree_of_wear_falls_along_the_path(done: tuple[Path, dict]) -> None:
    data = read_artifact(done[0], "scratch")
    s = data["section_s_over_a"].values
    wear = data["section_degree_of_wear"].values[1][(s >= 0) & (s <= 1.1)]
    assert (np.diff(wear) < 0.01).all() and wear[-1] < wear[0]


def test_vtu_series_opens_with_the_promised_fields(done: tuple[Path, dict]) -> None:
    import pyvista

    path = done[0]
    reader = pyvista.get_reader(str(path.with_suffix(".pvd")))
    assert len(reader.time_values) == 4  # indent, one while sliding, slide, rest
    grid = pyvista.read(path.with_suffix(".vtu") / "0003.vtu")
    assert "displacement" in grid.point_data
    assert {"stress", "von_mises", "plastic_strain", "damage"} <= set(grid.cell_data.keys())
    assert grid.cell_data["plastic_strain"].max() > 0.1
    assert grid.compute_cell_sizes()["Volume"].min() > 0


def test_picture(done: tuple[Path, dict], tmp_path: Path) -> None:
    picture.run(done[0], tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 20_000


def test_indentation_alone(scene: Path, tmp_path: Path) -> None:
    overrides = [o for o in SMALL if "tip.path" not in o]
    headline = scratch.run(scene, tmp_path / "dent.nc", overrides=[*overrides, "tip.path='0 um'"])
    assert headline["normal_force_n"] > 0.5 and headline["s_over_a"] == 0.0
    assert headline["degree_of_wear_by_s_over_a"] == {}


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("tip.radius='-1 um'", "tip.radius"),
        ("tip.depth='9 um'", "half of specimen.thickness"),
        ("tip.path='170 um'", "path that stays"),
        ("tip.radius='50 MPa'", "tip.radius"),
        ("mesh.size='40 um'", "mesh.size"),
        ('material.law="lubliner"', "material"),
        ("numerics.points=4", "numerics.points"),
        ("tip.colour=1", "tip.colour"),
        ("damage.remove_at=0.9", "erve"),
    ],
)
def test_bad_input_is_named_and_nothing_written(scene: Path, tmp_path: Path, setting: str, words: str) -> None:
    with pytest.raises(BadInput) as caught:
        scratch.run(scene, tmp_path / "x.nc", overrides=[setting])
    assert words in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_failure_keeps_the_last_good_state(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(NumericsFailed, match="last-good"):
        scratch.run(scene, tmp_path / "x.nc", overrides=[*SMALL, "numerics.energy_limit=1e-9"])
    assert {p.name for p in tmp_path.iterdir()} == {"x.last-good.vtu", "x.checkpoint.npz"}


def test_output_that_exists_is_refused(done: tuple[Path, dict], scene: Path) -> None:
    with pytest.raises(BadInput, match=r"out\.nc"):
        scratch.run(scene, done[0], overrides=SMALL)
