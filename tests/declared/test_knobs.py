"""Knobs of accuracy: keys that scenes have, and what a stage takes at each fidelity is what the table says."""

import importlib.util
from functools import reduce
from pathlib import Path

import numpy as np
import pytest

from graben.declared.knobs import FIDELITIES, STAGES, SlowEnough, Times, knob, values_at
from graben.schemas.kinds import SCENES
from graben.schemas.scene import load_scene
from graben.stages.blocks.extent import Extent
from graben.stages.blocks.sizes import steps_of
from graben.stages.calibrate.problem import plan_of, problem_of
from graben.stages.fem_run.mesh import size_field
from graben.stages.particles import stage as particles
from graben.stages.rev_study import stage as rev_study
from graben.stages.rev_study.calibration import each_plan, first_plan
from graben.stages.scratch import stage as scratch
from graben.stages.shared.fidelity import setting

ROOT = Path(__file__).parents[2]
EVERY_TABLE = {"blocks": {"programme": {}}}
NEEDED = {"particles": {"grains": [{"name": "sand", "diameter": "100 um"}]}}
every_fidelity = pytest.mark.parametrize("fidelity", FIDELITIES)
every_stage = pytest.mark.parametrize("stage", STAGES, ids=lambda s: s.kind)


def scene(kind, fidelity="standard", **keys):
    return load_scene({"kind": kind, "fidelity": fidelity, **NEEDED.get(kind, {}), **keys}, kind)


def of(some, key):
    return reduce(getattr, key.split("."), some)


@every_stage
def test_keys_are_those_of_the_scene_and_their_defaults_are_the_declared_ones(stage):
    assert stage.kind in SCENES
    plain = scene(stage.kind, **EVERY_TABLE.get(stage.kind, {}))
    for k in stage.knobs:
        values = [k.at(fidelity) for fidelity in FIDELITIES]
        if not k.settable:
            assert not k.steady
        elif isinstance(k.standard, Times):
            assert of(plain, k.key) > 0 and k.standard.factor == 1.0
            assert all(of(plain, rule.key) == rule.factor for rule in values if rule.key)
        else:
            assert of(plain, k.key) == (k.standard if k.steady else None), k.key


def test_stages_and_their_keys_are_listed_once():
    assert len({s.kind for s in STAGES}) == len(STAGES)
    for stage in STAGES:
        keys = [k.key for k in stage.knobs]
        assert len(set(keys)) == len(keys) and all(k.trades and k.unit for k in stage.knobs)
        assert len(stage.promises) in (0, len(FIDELITIES))


@every_fidelity
def test_blocks_take_the_declared_steps(fidelity):
    rule = values_at("blocks", fidelity)["numerics.steps"]
    fast = {"loading": {"confining_pressure": "1 GPa"}}
    body = Extent(10.0, 10.0, 100.0)
    assert isinstance(rule, SlowEnough) and steps_of(scene("blocks", fidelity, **fast), body, 100.0) == rule.steps
    free = {"loading": {"confining_pressure": "1 Pa"}}
    assert steps_of(scene("blocks", fidelity, **free), body, 100.0) == rule.most * rule.steps


@every_fidelity
def test_beds_take_the_declared_numerics(fidelity):
    _law, recipe, _sizes = particles.prepare(scene("particles", fidelity))
    knobs = values_at("particles", fidelity)
    found = {f"numerics.{name}": getattr(recipe, name) for name in ("safety", "rest", "balance")}
    assert found | {"loading.ramp": recipe.ramp} == {k: knobs[k] for k in (*found, "loading.ramp")}


@every_fidelity
def test_a_calibration_searches_as_declared(fidelity):
    given = scene("calibrate", fidelity)
    plan, problem = plan_of(given), problem_of(given, given.source.path, "here")
    assert values_at("calibrate", fidelity) == {
        "swarm.starts": plan.starts, "swarm.particles": plan.particles, "swarm.generations": plan.generations,
        "refine.best": plan.refine_best, "refine.iterations": plan.iterations, "increments": problem.increments,
    }  # fmt: skip


@every_fidelity
def test_a_study_of_the_representative_size_draws_and_fits_as_declared(fidelity):
    given, knobs = scene("rev-study", fidelity), values_at("rev-study", fidelity)
    _law, sizes = rev_study.prepare(given)
    assert {e.count for e in sizes if e.key == "tests.resamples"} == {float(knobs["tests.resamples"])}
    first, each = first_plan(given), each_plan(given, 2)
    assert [first.starts, first.particles, first.generations, first.refine_best] == [
        knobs[f"calibration.first.{name}"] for name in ("starts", "particles", "generations", "best")
    ]
    assert each.iterations == knobs["calibration.each.iterations"] and each.generations == 0


@every_fidelity
def test_meshes_and_speeds_take_the_declared_factors(fidelity):
    fem, groove = scene("fem", fidelity), scene("scratch", fidelity)
    factor = values_at("fem", fidelity)["mesh.size"].factor
    assert size_field(fem).size == factor * fem.mesh.size
    assert np.array_equal(size_field(fem).near_size, [factor * r.size for r in fem.mesh.refine])
    knobs = values_at("scratch", fidelity)
    assert scratch.mesh_size(groove) == knobs["mesh.size"].factor * groove.mesh.size
    numerics = scratch.numerics_of(groove)
    for name in ("indent_speed", "slide_speed", "lift_speed"):
        assert getattr(numerics, name) == knobs[f"numerics.{name}"].factor * getattr(groove.numerics, name)


def test_what_a_scene_says_itself_holds():
    own = scene("particles", "draft", numerics={"safety": 0.3})
    assert setting(own, "numerics.safety") == 0.3
    assert setting(own, "numerics.rest") == knob("particles", "numerics.rest").draft
    coarse = scene("fem", "draft", mesh={"draft_factor": 4.0})
    assert size_field(coarse).size == 4.0 * coarse.mesh.size


def test_the_page_of_the_manual_is_up_to_date():
    spec = importlib.util.spec_from_file_location("make_fidelity", ROOT / "docs" / "make_fidelity.py")
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    text = (ROOT / "docs" / "manual" / "fidelity.md").read_text(encoding="utf-8")
    assert text == maker.page(), "run python docs/make_fidelity.py"
