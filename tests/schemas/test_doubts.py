"""Warnings go with a result through the chain, and name the file that they began with."""

import pytest

from graben.schemas.doubts import doubts_of
from graben.schemas.provenance import Record
from graben.schemas.scenes.material import read_material, write_material
from graben.stages.tools import picture
from tests.conftest import command, made
from tests.stages.shared.test_measures import COLUMN
from tests.stages.wear_estimate.test_stage import TABLE

VALUES = {"young_modulus": 1e9, "poisson_ratio": 0.2}


def test_a_material_file_keeps_them(tmp_path):
    told = ['inertia is "large"', "of rock.nc: 12 % of the stress is not balanced"]
    write_material(tmp_path / "law.material.toml", "elastic", VALUES, "a note", told)
    assert read_material(tmp_path / "law.material.toml") == ("elastic", VALUES)
    assert doubts_of([tmp_path / "law.material.toml"]) == [
        'of law.material.toml: inertia is "large"', "of rock.nc: 12 % of the stress is not balanced",
    ]  # fmt: skip


def test_what_a_run_says_itself_comes_first_and_nothing_twice(tmp_path):
    write_material(tmp_path / "law.material.toml", "elastic", VALUES, warnings=["doubtful", "doubtful"])
    record = Record.begin(None, [tmp_path / "law.material.toml"])
    assert record.warn(["own"]) == ["own", "of law.material.toml: doubtful"]
    assert record.warn(["own"]) == record.warnings == ["own", "of law.material.toml: doubtful"]


@pytest.mark.parametrize("text", ["no toml [", 'warnings = "one"', "warnings = [1]", ""])
def test_files_with_faults_tell_nothing_here(text, tmp_path):
    (tmp_path / "law.material.toml").write_text(text)
    (tmp_path / "law.nc").write_text(text)
    assert doubts_of([tmp_path / "law.material.toml", tmp_path / "law.nc", tmp_path / "none.csv"]) == []


def test_strict_ends_with_3_and_the_result_is_written(tmp_path):
    assert command("wear-estimate", TABLE, "-o", tmp_path / "w.nc", "-q").exit_code == 0
    result = command("wear-estimate", TABLE, "-o", tmp_path / "s.nc", "-q", "--strict")
    assert result.exit_code == 3 and "it has warnings" in result.output and (tmp_path / "s.nc").exists()
    (tmp_path / "column.toml").write_text(COLUMN.replace("RATE", "10 MPa/s"))
    calm = command("fem-run", tmp_path / "column.toml", "-o", tmp_path / "c.nc", "-q", "--strict")
    assert calm.exit_code == 0, calm.output
    studied = command(
        "tradeoff", TABLE, "--quantity", "mixtures.0.wear_rate_m3_per_s", "--knob", "machine.rotation=1 rpm,2 rpm",
        "--reference", "1e-9", "-o", tmp_path / "t.nc", "-q", "--strict",
    )  # fmt: skip
    assert studied.exit_code == 3, "what a point warns of is repeated"


def test_a_picture_bears_them(tmp_path, monkeypatch):
    made("wear-estimate", TABLE, "-o", tmp_path / "w.nc", "-q")
    drawn = []
    from matplotlib.figure import Figure

    monkeypatch.setattr(Figure, "text", lambda self, x, y, text, **style: drawn.append(text))
    picture.drawn(tmp_path / "w.nc", ".png")
    assert len(drawn) == 1 and drawn[0].startswith("warning: ") and "(and 6 more)" in drawn[0]
