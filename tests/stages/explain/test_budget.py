"""--budget: the finest fidelity that fits, with a run at draft first where there is time for it."""

import json

import pytest

from graben.declared.costs import Cost
from graben.declared.knobs import Promise
from graben.errors import BadInput
from graben.stages.explain import budget, size
from graben.stages.shared.run_apart import Run
from tests.conftest import PIPELINES, command, made

WEAR = PIPELINES / "wear" / "astm-g65-mixtures.toml"
BLOCKS = {"kind": "blocks", "loading": {"confining_pressure": "4 MPa"}}
ZONES = 1675.39
# 1 s of start; draft 12,500 steps take 2.5 s, standard 10 s, reference 40 s.
COST = Cost(1.0, 2e-4 / ZONES)


@pytest.fixture
def known(monkeypatch):
    """Costs and promises that are known; returns the factor by which a run at draft is slower than predicted."""
    slower = {"by": 1.0, "code": 0, "made": 0}

    def run(arguments, folder, limit):
        assert arguments[-2:] == ["--set", "fidelity=draft"]
        slower["made"] += 1
        return Run(slower["code"], {}, "", 1.0 + 2.5 * slower["by"], 3.5, 1000)

    monkeypatch.setattr(budget, "measured", run)
    monkeypatch.setattr(budget, "slowness", lambda: 1.0)
    for module in (budget, size):
        monkeypatch.setattr(module, "COSTS", {"blocks": COST})
    monkeypatch.setattr(budget, "promise_at", lambda kind, fidelity: Promise({"draft": 0.1}.get(fidelity)))
    return slower


def chosen(seconds):
    return budget.choose(BLOCKS, ["dem-run"], [], [], seconds)


@pytest.mark.parametrize(
    ("seconds", "fidelity", "predicted", "tries"),
    [(4.0, "draft", 3.5, 0), (12.0, "standard", 11.0, 0), (40.0, "standard", 11.0, 1), (50.0, "reference", 41.0, 1)],
)
def test_the_finest_that_fits(known, seconds, fidelity, predicted, tries):
    found = chosen(seconds)
    assert found.fidelity == fidelity and known["made"] == tries
    assert found.predicted == pytest.approx(predicted, rel=2e-3, abs=1.0)
    assert found.words.endswith("its error is 10 %" if fidelity == "draft" else "its error is not known")


def test_a_run_at_draft_corrects_the_prediction(known):
    known["by"] = 3.0
    found = chosen(60.0)
    assert found.fidelity == "standard" and found.tried
    assert found.predicted == pytest.approx(31.0, rel=2e-3, abs=1.0)


def test_a_run_at_draft_that_fails_corrects_nothing_and_is_not_told_of(known):
    known["code"] = 3
    assert chosen(60.0).fidelity == "reference" and not chosen(60.0).tried


def test_a_run_at_draft_that_takes_the_budget_is_refused(known):
    known["by"], known["code"] = 40.0, -15
    with pytest.raises(BadInput, match=r"at least 101 s"):
        chosen(60.0)


def test_what_is_not_known_fits_no_budget():
    scene = PIPELINES / "upscaling" / "calibrate.toml"
    with pytest.raises(BadInput, match="not known before"):
        budget.choose(scene, ["calibrate"], [], [], 60.0)


def test_a_restart_keeps_its_fidelity(tmp_path):
    result = command("dem-run", WEAR, "-o", tmp_path / "r.nc", "--budget", "1 h", "--restart")
    assert result.exit_code == 2 and "no --budget" in result.output


def test_what_fits_nothing_is_refused(known):
    with pytest.raises(BadInput, match=r"at least 3\.5 s"):
        chosen(2.0)
    with pytest.raises(BadInput, match="no budget"):
        budget.choose(WEAR, ["wear-estimate"], [], [], 60.0)


def test_a_run_within_a_budget_keeps_to_what_was_said(tmp_path):
    """The prediction rests on a run at draft, and holds within a factor of 1.5 beside the noise of two short runs."""
    scene = tmp_path / "rock.toml"
    scene.write_text(
        'kind = "blocks"\n[tessellation]\nedge = "1.5 m"\n[output]\nvtk = false\n'
        '[loading]\nconfining_pressure = "4 MPa"\n',
        encoding="utf-8",
    )
    result = made("dem-run", scene, "-o", tmp_path / "r.nc", "--json", "--budget", "20 h")
    found = json.loads(result.stdout)
    assert found["chosen"] == {"fidelity": "reference"} and found["steps"] > 200_000
    assert found["budget_s"] == 72_000.0 and found["predicted_s"] > 0.0 and found["wall_s"] > 0.0
    assert "within 7.2e+04 s: fidelity reference" in result.stderr


@pytest.mark.parametrize("text", ["10", "-1 s", "0 s", "10 kg"])
def test_a_budget_is_a_time(text, tmp_path):
    result = command("dem-run", "no-such.toml", "-o", tmp_path / "r.nc", "--budget", text)
    assert result.exit_code == 2 and "budget" in result.output
