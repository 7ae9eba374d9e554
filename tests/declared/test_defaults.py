"""Defaults that stand in a scene and again in a record of mechanics, or in an argument of Python, agree."""

import dataclasses
import inspect

import pytest

import graben
from graben.declared.knobs import STAGES
from graben.mechanics.averaging.representative import Criteria
from graben.mechanics.fem.newton import NewtonOptions
from graben.mechanics.fitting.curves import Weights
from graben.mechanics.fitting.objective import Objective
from graben.mechanics.optimise.multistart import Plan
from graben.mechanics.particles.bed import BedRecipe
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.scratch.setup import Numerics
from graben.schemas.scene import load_scene

SAND = {"grains": [{"name": "sand", "diameter": "100 um"}]}
OTHER_NAMES = {"best": "refine_best"}
PAIRS = [
    ("calibrate", "weights", Weights, 4),
    ("calibrate", "weights", Objective, 1),
    ("calibrate", "swarm", Plan, 8),
    ("calibrate", "refine", Plan, 5),
    ("rev-study", "tests", Criteria, 4),
    ("particles", "contact", LinearLaw, 4),
    ("particles", "loading", BedRecipe, 2),
    ("particles", "numerics", BedRecipe, 6),
    ("fem", "stepping", NewtonOptions, 2),
    ("scratch", "numerics", Numerics, 13),
]


def standard(kind, table):
    """Keys of a table with their defaults, those of standard fidelity where that sets them."""
    scene = load_scene({"kind": kind, **(SAND if kind == "particles" else {})}, kind)
    knobs = {k.key: k.standard for s in STAGES if s.kind == kind for k in s.knobs}
    given = {name: getattr(getattr(scene, table), name) for name in type(getattr(scene, table)).model_fields}
    return {name: knobs.get(f"{table}.{name}") if value is None else value for name, value in given.items()}


@pytest.mark.parametrize(("kind", "table", "record", "count"), PAIRS, ids=lambda p: getattr(p, "__name__", str(p)))
def test_a_record_of_mechanics_has_the_defaults_of_the_scene(kind, table, record, count):
    ours = {f.name: f.default for f in dataclasses.fields(record) if f.default is not dataclasses.MISSING}
    keys = {OTHER_NAMES.get(name, name): value for name, value in standard(kind, table).items()}
    shared = {name for name in ours if keys.get(name) is not None}
    assert len(shared) == count, shared
    assert {n: ours[n] for n in shared} == {n: keys[n] for n in shared}


def test_fit_has_the_defaults_of_a_calibration():
    keys = load_scene({"kind": "calibrate"}, "calibrate")
    own = {n: p.default for n, p in inspect.signature(graben.fit).parameters.items() if n in type(keys).model_fields}
    chosen = {n: v for n, v in own.items() if v not in (None, inspect.Parameter.empty)}
    assert chosen == {n: getattr(keys, n) for n in ("test", "fidelity", "seed")}
