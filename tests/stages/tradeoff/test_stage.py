"""The command: studies of runs that are made up, and one of real runs."""

import json
from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput, NumericsFailed
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.shared.run_apart import Run
from graben.stages.tools import picture
from graben.stages.tradeoff import runs, stage
from tests.conftest import command, made

FEM = Path(__file__).parents[3] / "pipelines" / "upscaling" / "slope.toml"
WEAR = Path(__file__).parents[3] / "pipelines" / "wear" / "astm-g65-mixtures.toml"


def setting(arguments, key):
    return next(a.partition("=")[2] for a in arguments if a.startswith(f"{key}="))


@pytest.fixture
def made_up(monkeypatch):
    """Runs whose load is 5 + h^2 + .01 seed and whose cost is 1 / h; one of h = 8 fails. Returns what was run."""
    called = []

    def run(arguments, folder):
        called.append(arguments)
        h = float(setting(arguments, "mesh.size").split()[0])
        seed = int(setting(arguments, "seed")) if any(a.startswith("seed=") for a in arguments) else 0
        value = 5.0 + h**2 + 0.01 * seed
        headline = {"load_pa": value, "load_low_pa": value - 0.1, "load_high_pa": value + 0.1, "none_pa": None}
        if h == 8.0:
            return Run(3, {}, "the numerics failed: no equilibrium", 1.0, 1.0 / h, 1000)
        return Run(0, headline | {"warnings": ["doubtful"] if h == 0.5 else []}, "", 1.0, 1.0 / h, 1000)

    monkeypatch.setattr(runs, "measured", run)
    return called


def study(folder, *knobs, **more):
    return stage.run(FEM, [], folder / "t.nc", **{"quantity": "load_pa", "knobs": knobs, **more})


def test_errors_of_a_sequence_count_from_its_limit(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=4 m,2 m,1 m,0.5 m", wanted=0.26)
    assert found["reference"] == pytest.approx(5.0) and found["reference_from"] == "extrapolated"
    assert found["order"] == pytest.approx(2.0)
    np.testing.assert_allclose([p["error"] for p in found["points"]], [3.2, 0.8, 0.2, 0.05], rtol=1e-9)
    assert all(p["error_low"] < p["error"] < p["error_high"] for p in found["points"])
    assert all(p["on_front"] for p in found["points"])
    assert found["recommended"]["knobs"] == {"mesh.size": "1 m"}
    assert found["warnings"] == ["mesh.size 0.5 m warns: doubtful"]
    assert check_artifact(tmp_path / "t.nc") == []
    assert picture.drawn(tmp_path / "t.nc", ".png").startswith(b"\x89PNG")


def test_seeds_repeat_each_point(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=2 m,1 m,0.5 m", seeds=3)
    assert found["reference"] == pytest.approx(5.01)  # the scene has seed 0
    data = read_artifact(tmp_path / "t.nc", "tradeoff")
    assert data["value"].shape == (3, 3) and data["seed"].values.tolist() == [0, 1, 2]


def test_the_finest_point_is_the_reference_where_nothing_can_be_extrapolated(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=1 m,0.5 m", wanted=0.3)
    assert found["reference_from"] == "finest" and found["reference"] == pytest.approx(5.25)
    last = found["points"][-1]
    assert np.isnan(last["error"]) and not last["on_front"]
    assert "whose own error is not known" in found["warnings"][0]
    assert found["points"][0]["error"] == pytest.approx(6.0 / 5.25 - 1.0)


def test_a_given_reference(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=1 m,0.5 m", reference=4.0, wanted=0.01)
    np.testing.assert_allclose([p["error"] for p in found["points"]], [0.5, 0.3125])
    assert found["recommended"] is None and "within 1 %" in found["warnings"][-1]


def test_what_is_done_is_not_done_again(made_up, tmp_path):
    study(tmp_path, "mesh.size=2 m,1 m")
    assert len(made_up) == 3  # the first of all is made twice, for it compiles
    study(tmp_path, "mesh.size=2 m,1 m,0.5 m", overwrite=True)
    assert len(made_up) == 4
    study(tmp_path, "mesh.size=2 m,1 m", overwrite=True, overrides=["seed=7"])
    assert len(made_up) == 7


def test_what_a_scene_names_is_part_of_it(made_up, tmp_path):
    law = tmp_path / "law.material.toml"
    law.write_text('law = "elastic"\n[parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.2\n')
    settings = {"overrides": [f'material={{file="{law}"}}'], "overwrite": True}
    study(tmp_path, "mesh.size=2 m,1 m", **settings)
    study(tmp_path, "mesh.size=2 m,1 m", **settings)
    assert len(made_up) == 3
    law.write_text(law.read_text().replace("0.2", "0.3"))
    study(tmp_path, "mesh.size=2 m,1 m", **settings)
    assert len(made_up) == 6


@pytest.mark.parametrize("code", [-9, -2, 1, 3, 130])
def test_what_the_machine_ended_is_tried_again(code, monkeypatch, tmp_path):
    said = "the machine failed: No space left" if code == 3 else ""
    tries = []
    monkeypatch.setattr(
        runs, "measured", lambda arguments, folder: tries.append(1) or Run(code, {}, said, 1.0, 1.0, 1)
    )
    task = runs.Task(("fem-run",), tmp_path, "x")
    assert runs.make(task).code == runs.make(task).code == code and len(tries) == 2


def test_an_interval_is_found_behind_the_unit_too(monkeypatch, tmp_path):
    headline = {"n_per_m2": 4.0, "n_per_m2_low": 3.8, "n_per_m2_high": 4.4}
    monkeypatch.setattr(runs, "measured", lambda arguments, folder: Run(0, headline, "", 1.0, 1.0, 1))
    found = study(tmp_path, "mesh.size=2 m,1 m", quantity="n_per_m2", reference=4.0)["points"][0]
    assert (found["error_low"], found["error_high"]) == (pytest.approx(-0.05), pytest.approx(0.1))


def test_a_point_that_fails_is_told(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=8 m,2 m,1 m")
    assert np.isnan(found["points"][0]["error"])
    assert any(w == "mesh.size 8 m: 1 of 1 runs gave no result: the numerics failed: no equilibrium"
               for w in found["warnings"])  # fmt: skip
    with pytest.raises(NumericsFailed, match="the finest point gives no value"):
        study(tmp_path, "mesh.size=1 m,8 m", overwrite=True)


def test_values_from_fine_to_coarse_are_told(made_up, tmp_path):
    found = study(tmp_path, "mesh.size=0.5 m,1 m")
    assert any("from coarse to fine" in text for text in found["warnings"])


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"quantity": "no_such"}, "a number of the stage: load_pa"),
        ({"quantity": "none_pa"}, None),
        ({"knobs": ["mesh.no_such=1,2"]}, "no such key"),
        ({"knobs": ["mesh.size=1 m,2 kg"]}, "dimension"),
        ({"reference": 0.0}, "other than 0"),
    ],
)
def test_bad_input_is_refused(made_up, tmp_path, more, said):
    error = BadInput if said else NumericsFailed
    with pytest.raises(error, match=said):
        study(tmp_path, **({"knobs": ["mesh.size=2 m,1 m"]} | more))
    assert not (tmp_path / "t.nc").exists()


def test_of_real_runs(tmp_path):
    """Each in a process of its own, with what it cost; a class more costs no more than noise."""
    result = made(
        "tradeoff", WEAR, "--quantity", "mixtures.0.wear_rate_m3_per_s", "--knob", "machine.rotation=100 rpm,200 rpm",
        "-o", tmp_path / "t.nc", "--json", "-q", "--processes", "2",
    )  # fmt: skip
    found = json.loads(result.stdout)
    assert found["points"][0]["error"] == pytest.approx(-0.5, abs=1e-12)
    assert all(0.1 < p["cpu_s"] < 100.0 and 2e7 < p["peak_memory_bytes"] < 2e9 for p in found["points"])
    assert len(list((tmp_path / "t.runs").glob("*.json"))) == 3
    bad = command("tradeoff", WEAR, "--quantity", "x", "-o", tmp_path / "u.nc", "--", "--no-such-option")
    assert bad.exit_code == 2 and "No such option" in bad.output


def test_an_error_wanted_is_a_share():
    bad = command("tradeoff", WEAR, "--quantity", "x", "-o", "t.nc", "--error", "much")
    assert bad.exit_code == 2 and "such as 5% or 0.05" in bad.output
