"""The table of studies names scenes, knobs and promises that exist."""

import re
import tomllib

import pytest

from graben.declared.knobs import FIDELITIES, STAGES, stage_of
from graben.schemas.kinds import SCENES
from graben.schemas.scene import load_scene
from graben.stages.tradeoff.knobs import grid, knobs_of
from tests.conftest import PIPELINES

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
