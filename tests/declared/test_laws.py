"""Parameters of laws: every law is declared, every parameter does something, templates lie within the bounds."""

import numpy as np
import pytest

from graben.declared.laws import PARAMETERS, declare, parameter
from graben.declared.parameter import Parameter
from graben.errors import Refused
from graben.mechanics.materials import hardening, j2_hardening, lubliner_curves
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.materials.point import follow
from graben.schemas.kinds import scene_model
from graben.schemas.quantities import KNOWN
from graben.schemas.scene import load_scene
from graben.schemas.scenes.material import MaterialTable
from graben.stages.calibrate.problem import problem_of

STEEL = {"young_modulus": 2e11, "poisson_ratio": 0.3}
ROCK = {"young_modulus": 1e10, "poisson_ratio": 0.2}
TABLE = [[0.0, 2e8], [0.05, 3e8]]
FORMS = [
    {"hardening": "table", "hardening_table": TABLE},
    {"hardening": "linear", "initial_yield": 2e8, "hardening_modulus": 1e9},
    {"hardening": "exponential", "initial_yield": 2e8, "hardening_gain": 1e8, "hardening_rate": 50.0},
]
DUCTILE = {
    "damage": "ductile", "initiation_strain_050": 1e-3, "initiation_strain_060": 3e-3, "failure_displacement": 0.2,
    "max_damage": 0.05,
}  # fmt: skip
SLOPE = {**ROCK, "friction_angle": 0.9, "dilation_angle": 0.5, "flow_stress_ratio": 0.9}
SETS = {
    "elastic": [ROCK],
    "transverse-elastic": [
        {**ROCK, "young_modulus_across": 5e9, "poisson_ratio_across": 0.1, "shear_modulus_across": 2e9,
         "axis_angle": 0.5}
    ],
    "j2": [STEEL | form for form in FORMS],
    "mohr-coulomb": [
        {**ROCK, "friction_angle": 0.6, "dilation_angle": 0.2, "cohesion": 5e6, "tensile_strength": 1e6}
    ],
    "drucker-prager": [
        {**SLOPE, **DUCTILE, "initial_yield": 1e5, "hardening_gain": 1e6, "hardening_rate": 100.0},
        {**SLOPE, "hardening": "barcelona", "initial_yield": 1e6, "peak_yield": 2e6, "strain_at_peak": 0.01},
        {**SLOPE, "hardening": "linear", "initial_yield": 1e6, "hardening_modulus": 1e7},
        {**SLOPE, "hardening": "table", "hardening_table": [[0.0, 1e6], [0.05, 2e6]]},
    ],
    "lubliner": [
        {**ROCK, "dilation_angle": 0.5, "initial_yield": 1e7, "peak_yield": 2e7, "strain_at_peak": 2e-3,
         "tensile_yield": 2e6, "largest_inelastic_strain": 0.02, "largest_cracking_strain": 0.01,
         "tension_recovery": 0.2, "compression_recovery": 0.8, "max_damage": 0.3}
    ],
    "erve": [
        {**STEEL, "damage_threshold": 1e5, "subdomains": 3, "max_damage_step": limit, "hardening": TABLE}
        for limit in (0.01, 1.0)
    ],
    "energy-damage": [STEEL | {"damage_threshold": 1e4, "max_damage": 0.3} | form for form in FORMS],
}  # fmt: skip
"""Values of each law, among which every declared parameter counts at least once."""

# Compression to failure, far into tension, and back, with some shear: what any law is there for.
PATH = np.cumsum(
    [[0.0] * 4, *[[0.0, -1e-3, 0.0, 2e-4]] * 8, *[[1e-3, 1e-3, 0.0, 0.0]] * 16, *[[0.0, -2e-3, 0.0, 0.0]] * 12], 0
)


def answer(law, values):
    found = follow(law, pack(law, values), "eeee", PATH, length=1.0, parts=4)
    assert found.complete[0], (law, values)
    return np.concatenate([found.stress[0].ravel(), found.state[0].ravel()])


def changed(p, value):
    """Another value of a parameter, within its bounds."""
    factor = 0.5 if p.name == "damage_threshold" else 0.97  # damage begins at one of a few steps
    if p.form == "word":
        return next(w for w in p.choices if w != value)
    if p.form == "table":
        return [[x, factor * y] for x, y in value]
    moved = value * factor if value else 0.1
    return round(moved + 1) if p.name == "subdomains" else min(max(moved, p.lower), p.upper)


def test_every_law_is_declared_and_every_declaration_is_a_law():
    ours = {name for name, law in LAWS.items() if 0 <= law.id < 256}
    assert ours <= set(PARAMETERS) and set(SETS) == ours
    for name, law in LAWS.items():
        assert law.parameters is PARAMETERS[name]
        names = [p.name for p in law.parameters]
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("law", SETS)
def test_a_declaration_is_whole(law):
    for p in PARAMETERS[law]:
        assert p.unit in ("1", *KNOWN) and p.description and p.lower < p.upper, p
        if p.form == "number":
            assert np.isfinite([p.lower, p.upper]).all() and (p.default is None or p.holds(p.default)), p
        if p.form == "word":
            assert p.default in p.choices, p
        if p.when:
            other, words = p.when
            assert set(words.split("|")) <= set(next(q for q in PARAMETERS[law] if q.name == other).choices), p


@pytest.mark.parametrize("law", SETS)
def test_every_declared_parameter_changes_what_the_law_answers(law):
    switches = {p.when[0] for p in PARAMETERS[law] if p.when}  # the sets go through their words
    silent = {p.name for p in PARAMETERS[law]} - switches
    for values in SETS[law]:
        before = answer(law, values)
        for p in (p for p in LAWS[law].active(values) if p.name not in switches):
            after = answer(law, {**values, p.name: changed(p, values.get(p.name, p.default))})
            if not np.array_equal(before, after):
                silent.discard(p.name)
    assert silent == set()


def test_words_are_known_to_compiled_code_by_their_order():
    def word(law, name, number):
        return next(p for p in PARAMETERS[law] if p.name == name).choices[number]

    for name in ("exponential", "barcelona", "linear", "table"):
        assert word("drucker-prager", "hardening", getattr(hardening, name.upper())) == name
    for law in ("j2", "energy-damage"):
        for name in ("table", "linear", "exponential"):
            assert word(law, "hardening", getattr(j2_hardening, name.upper())) == name
    for name in ("current", "printed"):
        assert word("lubliner", "crack_strain", getattr(lubliner_curves, name.upper())) == name


@pytest.mark.parametrize("kind", ["fem", "scratch"])
def test_the_material_of_a_template_lies_within_the_bounds(kind):
    given = scene_model(kind).model_fields["material"].default
    table = given if isinstance(given, MaterialTable) else MaterialTable(**given)
    law, values = table.resolve()
    assert LAWS[law].faults(values) == []


def test_the_bounds_of_calibrates_template_lie_within_those_of_its_law():
    scene = load_scene({"kind": "calibrate"}, "calibrate")
    problem = problem_of(scene, scene.source.path, "template")
    assert problem.box.size == len(scene.free) > 5


@pytest.mark.parametrize(
    ("key", "name"),
    [("young", "young_modulus"), ("poisson", "poisson_ratio"), ("friction", "friction_angle"),
     ("cohesion", "cohesion"), ("tension", "tensile_strength"), ("dilation", "dilation_angle")],
)  # fmt: skip
def test_the_rock_of_blocks_has_the_bounds_of_its_law(key, name):
    def rock(value):
        text = value if p.unit == "1" else f"{value!r} {p.unit}"
        return {"kind": "blocks", "rock": {"zones": "mohr-coulomb", "friction": "80 deg", key: text}}

    p = parameter("mohr-coulomb", name)
    assert getattr(load_scene(rock(p.upper), "blocks").rock, key) == p.upper
    with pytest.raises(ValueError, match=rf"rock.{key} = .*: expected less than or equal to"):
        load_scene(rock(1.001 * p.upper), "blocks")


@pytest.mark.parametrize("part", ["lower", "upper"])
def test_bounds_beyond_those_of_the_law_are_faults_of_the_scene(part):
    free = {"poisson_ratio": {"lower": 0.1, "upper": 0.3} | {part: -0.995 if part == "lower" else 0.5}}
    with pytest.raises(ValueError, match=rf"free.poisson_ratio.{part} = .*: expected from -0.99 to 0.49999 1"):
        load_scene(
            {"kind": "calibrate", "law": "elastic", "free": free, "fixed": {"young_modulus": "1 GPa"}}, "calibrate"
        )


def test_a_law_of_the_package_cannot_be_declared_again():
    before = PARAMETERS["j2"]
    with pytest.raises(Refused, match="law of the package"):
        declare("j2", [Parameter("x", "1")])
    assert PARAMETERS["j2"] is before
