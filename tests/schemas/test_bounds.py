"""Every number that a scene can hold is finite, bounded, and a number: no text, no true or false."""

import copy
import json
import math
import tomllib

import pytest
from pydantic import ValidationError

from graben.schemas.kinds import SCENES, scene_model
from graben.schemas.template import json_schema, template

# Numbers with a parameter's own unit: bounded by `parameter_to_si` and by the law.
OF_A_LAW = {"Prior.mean", "Prior.deviation", "Free.lower", "Free.upper", "Free.initial"}
CHOICES = {"Numerics.points"}
# Tables that a scene writes out; the size of the file bounds them.
WRITTEN_OUT = {"Calibration.properties", "Curves.properties", "GrainClass.grooves", "GrainClass.scratch",
               "WearScene.grains", "WearScene.mixtures", "ParticlesScene.grains"}  # fmt: skip


def leaves(name, schema):
    """(name, schema) of every number, quantity and list in a JSON schema."""
    for option in schema.get("anyOf", [schema]):
        if option.get("type") in ("number", "integer", "array") or "x-unit" in option:
            yield name, option
        inner = [option.get("items"), option.get("additionalProperties"), *option.get("prefixItems", [])]
        for item in inner:
            if isinstance(item, dict):
                yield from leaves(f"{name}[]", item)


def tables(kind):
    schema = json.loads(json_schema(kind))
    yield scene_model(kind).__name__, schema
    yield from schema.get("$defs", {}).items()


def unbounded(kind):
    for table, schema in tables(kind):
        for key, about in schema.get("properties", {}).items():
            for name, leaf in leaves(f"{table}.{key}", about):
                if leaf.get("type") == "array":
                    if "maxItems" not in leaf and "[]" not in name:
                        yield name
                elif "x-unit" in leaf:
                    if not leaf["x-largest"] < math.inf:
                        yield name
                elif not (
                    {"minimum", "exclusiveMinimum"} & set(leaf) and {"maximum", "exclusiveMaximum"} & set(leaf)
                ):
                    yield name


@pytest.mark.parametrize("kind", SCENES)
def test_every_number_and_list_has_bounds(kind):
    assert set(unbounded(kind)) - OF_A_LAW - CHOICES - WRITTEN_OUT == set()


def places(tables, path=()):
    """Path of every value in nested tables and lists."""
    for key, value in tables.items() if isinstance(tables, dict) else enumerate(tables):
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))
        else:
            yield (*path, key), value


# Tables that are off unless given.
OFF = {
    "particles": {"shaking": {"cycles": 5, "amplitude": 0.1, "acceleration": 2.0}},
    "scratch": {"damage": {"growth_per_joule": 1e5, "remove_at": 0.9}},
    "rev-study": {"calibration": {"scene": "a.toml"}},
    "blocks": {"in_situ": {"sxx": "-1 MPa", "level": "10 m", "syy_rise": "0 Pa/m"}},
}


def filled(kind):
    """The template of a kind with the tables that it leaves off."""
    tables = tomllib.loads(template(kind)) | OFF.get(kind, {})
    if kind == "scratch":
        tables["material"] = {"file": "law.material.toml"}
    return tables


def refused(kind, tables):
    try:
        scene_model(kind).model_validate(tables, context={"check_files": False})
    except ValidationError:
        return True
    return False


NO_NUMBERS = [
    math.nan,
    math.inf,
    -math.inf,
    1e300,
    -1e300,
    10**400,
    -(10**400),
    True,
    "0,5",
    "1e3",
    "0.5",
    None,
    [],
    {},
]
NO_QUANTITIES = [
    0.5,
    1,
    True,
    "0.5",
    "nan m",
    "1e300 m",
    "1e300 Pa",
    "1e-300 m",
    "1e-300 Pa",
    "9**9**9 m",
    "1,5 m",
    "1,5 Pa",
    [],
    {},
]


@pytest.mark.parametrize("kind", SCENES)
def test_extreme_and_foreign_values_are_refused_at_every_key(kind):
    good = filled(kind)
    assert not refused(kind, good)
    taken = []
    for path, value in places(good):
        if isinstance(value, bool) or path[0] == "kind":
            wrong = [0, 1, "yes", 0.5]
        elif isinstance(value, int | float):
            wrong = NO_NUMBERS
        elif isinstance(value, str) and value[:1].isdigit():
            wrong = NO_QUANTITIES
        else:
            wrong = [0, 1.5, True]
        for bad in wrong:
            tables = copy.deepcopy(good)
            place = tables
            for step in path[:-1]:
                place = place[step]
            place[path[-1]] = bad
            of_law = {"parameters", "free"} & set(path)  # its smallest values are the law's to refuse
            if not refused(kind, tables) and not (of_law and bad in ("1e-300 m", "1e-300 Pa")):
                taken.append((path, bad))
    assert taken == []


@pytest.mark.parametrize("seed", [-1, 2**32, 10**400, 1.0, True, "3"])
def test_seeds_are_what_generators_take(seed):
    tables = tomllib.loads(template("wear"))
    assert refused("wear", {**tables, "seed": seed})
    assert not refused("wear", {**tables, "seed": 2**32 - 1})


@pytest.mark.parametrize("scale", [1e-6, 1e3])
def test_small_and_large_models_are_within_the_bounds(scale):
    tables = tomllib.loads(template("blocks"))
    edge, side = f"{0.5 * scale!r} m", f"{10 * scale!r} m"
    tables["domain"] = {"width": side, "height": side}
    tables["tessellation"].update(edge=edge, rounding=f"{0.05 * scale!r} m")
    tables["loading"]["speed"] = f"{5e-3 * scale!r} m/s"
    tables.pop("programme", None)
    scene_model("blocks").model_validate(tables)


@pytest.mark.parametrize("name", ["a\0b", "two\nlines", "x" * 10_000, ""])
def test_names_are_short_and_in_one_line(name):
    tables = tomllib.loads(template("wear"))
    tables["mixtures"][0]["name"] = name
    assert refused("wear", tables)


@pytest.mark.parametrize("gone", ["corners", "patches"])
def test_a_mapped_mesh_has_corners_and_patches(gone):
    tables = tomllib.loads(template("fem"))
    tables["mesh"][gone] = []
    assert refused("fem", tables)
    tables["mesh"]["method"] = "paved"
    assert not refused("fem", tables)
