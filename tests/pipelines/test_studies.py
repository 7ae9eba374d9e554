"""The table of studies names scenes, knobs and promises that exist."""

import re
import tomllib
from runpy import run_path

import pytest

from graben.declared.knobs import FIDELITIES, STAGES, stage_of
from graben.schemas.kinds import SCENES
from graben.schemas.scene import load_scene
from graben.stages.tradeoff.knobs import grid, knobs_of
from tests.conftest import PIPELINES

held = run_path(str(PIPELINES / "tradeoffs" / "study.py"), run_name="study")["_held"]
PLAN = tomllib.loads((PIPELINES / "tradeoffs" / "studies.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("study", PLAN["studies"], ids=lambda s: s["name"])
def test_a_study_can_be_made(study):
    runs = {"@" + run["name"] for run in PLAN["runs"]}
    for name in [study["scene"], *study.get("inputs", [])]:
        assert name in runs or (PIPELINES / name).is_file()
    assert re.fullmatch(r"[a-z0-9-]+", study["name"]) and study["quantity"]
    if not study["scene"].startswith("@"):
        for point in grid(knobs_of(study.get("knobs", []))):
            settings = [*study.get("set", []), *(f"{key}={value}" for key, value in point.items())]
            load_scene(PIPELINES / study["scene"], tuple(SCENES), settings)


def test_every_stage_with_knobs_has_a_study_of_its_fidelities():
    studied = {s["promise"] for s in PLAN["studies"] if "promise" in s}
    assert studied == {s.kind for s in STAGES} - {"rev-study"}  # what it recommends jumps from radius to radius
    assert all(stage_of(kind) for kind in studied)


def test_promises_have_one_entry_a_fidelity():
    assert all(len(s.promises) in (0, len(FIDELITIES)) for s in STAGES)


def seen(errors):
    rows = zip(FIDELITIES, errors, (2.0, 4.0, 16.0))
    return {"points": [{"knobs": {"fidelity": f}, "error": e, "cpu_s": c} for f, e, c in rows]}


@pytest.mark.parametrize(("draft", "code"), [(0.05, 0), (-0.05, 0), (0.07, 1), (-0.07, 1), (None, 1)])
def test_a_broken_promise_is_told(draft, code, capsys):
    promised = stage_of("scratch").promises
    assert promised[0].error == 0.06 and promised[2].error is None
    study = {"name": "scratch-fidelity", "promise": "scratch"}
    assert held([study], {"scratch-fidelity": seen([draft, 0.01, None])}) == code
    said = capsys.readouterr().out
    assert ("BROKEN" in said) == bool(code) and "promised     6 %" in said and "cost 8.0" in said
