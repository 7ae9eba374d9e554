"""Defaults that stand in a scene and again in a record or function of mechanics, or of Python, agree."""

import inspect

import pytest

import graben
from graben.declared.knobs import STAGES
from graben.mechanics.averaging.representative import Criteria
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks
from graben.mechanics.fem.newton import NewtonOptions
from graben.mechanics.fitting.curves import CurveFit, Weights
from graben.mechanics.fitting.objective import Objective
from graben.mechanics.optimise.appso import appso
from graben.mechanics.optimise.levenberg_marquardt import levenberg_marquardt
from graben.mechanics.optimise.multistart import Plan
from graben.mechanics.optimise.swarm import swarm
from graben.mechanics.particles.bed import BedRecipe
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.scratch.mesh import specimen
from graben.mechanics.scratch.setup import Numerics
from graben.schemas.scene import load_scene

SAND = {"grains": [{"name": "sand", "diameter": "100 um"}]}
OTHER_NAMES = {"best": "refine_best"}
PAIRS = [
    ("calibrate", "weights", Weights, 4),
    ("calibrate", "weights", Objective, 1),
    ("calibrate", "swarm", Plan, 8),
    ("calibrate", "refine", Plan, 5),
    ("calibrate", "swarm", swarm, 7),
    ("calibrate", "swarm", appso, 7),
    ("calibrate", "refine", levenberg_marquardt, 3),
    ("calibrate", "", CurveFit, 2),
    ("blocks", "tessellation", voronoi_blocks, 1),
    ("rev-study", "tests", Criteria, 4),
    ("particles", "contact", LinearLaw, 4),
    ("particles", "loading", BedRecipe, 2),
    ("particles", "numerics", BedRecipe, 6),
    ("fem", "stepping", NewtonOptions, 2),
    ("scratch", "mesh", specimen, 2),
    ("scratch", "numerics", Numerics, 13),
]


def standard(kind, table):
    """Keys of a table ("": of the scene) with their defaults, those of standard fidelity where that sets them."""
    scene = load_scene({"kind": kind, **(SAND if kind == "particles" else {})}, kind)
    knobs = {k.key: k.standard for s in STAGES if s.kind == kind for k in s.knobs}
    keys = getattr(scene, table) if table else scene
    given = {name: getattr(keys, name) for name in type(keys).model_fields}
    return {name: knobs.get(f"{table}.{name}") if value is None else value for name, value in given.items()}


def defaults(function):
    """Arguments with a default that is a number or a word."""
    found = {name: p.default for name, p in inspect.signature(function).parameters.items()}
    return {name: value for name, value in found.items() if isinstance(value, int | float | str)}


@pytest.mark.parametrize(("kind", "table", "record", "count"), PAIRS, ids=lambda p: getattr(p, "__name__", str(p)))
def test_mechanics_has_the_defaults_of_the_scene(kind, table, record, count):
    ours = defaults(record)
    keys = {OTHER_NAMES.get(name, name): value for name, value in standard(kind, table).items()}
    shared = {name for name in ours if keys.get(name) is not None}
    assert len(shared) == count, shared
    assert {n: ours[n] for n in shared} == {n: keys[n] for n in shared}


def test_fit_has_the_defaults_of_a_calibration():
    keys = load_scene({"kind": "calibrate"}, "calibrate")
    own = {n: p.default for n, p in inspect.signature(graben.fit).parameters.items() if n in type(keys).model_fields}
    chosen = {n: v for n, v in own.items() if v not in (None, inspect.Parameter.empty)}
    assert chosen == {n: getattr(keys, n) for n in ("test", "fidelity", "seed")}
    assert defaults(graben.follow)["length"] == keys.length  # what follows by default fits by default
