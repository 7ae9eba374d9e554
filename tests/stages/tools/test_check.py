"""`graben check` and the stages refuse the same scenes: each stage is run to the moment at which its work begins."""

import random

import pytest

from graben.errors import BadInput
from graben.schemas.provenance import Record
from graben.schemas.scene import load_scene
from graben.stages.calibrate import stage as calibrate
from graben.stages.dem_run import stage as dem_run
from graben.stages.fem_run import stage as fem_run
from graben.stages.scratch import stage as scratch
from graben.stages.tools.check import check, examine
from graben.stages.wear_estimate import stage as wear_estimate

CURVE = "stress_xx_mpa,stress_yy_mpa,strain_xx,strain_yy\n" + "".join(
    f"-0.5,{-0.5 - 0.4 * k},{2e-4 * k},{-1e-3 * k}\n" for k in range(6)
)
SMALL = {
    "blocks": 'domain = { width = "2 m", height = "2 m" }\nloading.duration = "2 s"',
    "particles": 'box = { width = "0.6 mm", depth = "0.3 mm" }\ngrains = [{ name = "a", diameter = "100 um" }]',
    "fem": 'fidelity = "draft"\nmesh.size = "4 m"',
    "scratch": 'fidelity = "draft"\nmesh.size = "4 um"',
    "calibrate": 'fidelity = "draft"\ncurves = ["curve.csv"]',
    "wear": """
        mixtures = [{ name = "m", shares = { a = 1.0 } }]
        [[grains]]
        name = "a"
        diameter = "100 um"
        grooves = [{ force = "2 N", area = "88 um^2", degree_of_wear = 0.4 }]
    """,
}
STAGES = {
    "blocks": dem_run.run, "particles": dem_run.run, "fem": fem_run.run, "scratch": scratch.run,
    "calibrate": calibrate.run, "wear": wear_estimate.run,
}  # fmt: skip

_GRAIN = '{{name="{}",diameter="{} um",grooves=[{{force="2 N",area="88 um^2",degree_of_wear=0.4}}]}}'
_THREE = (
    f"grains=[{','.join(_GRAIN.format(n, d) for n, d in zip('abc', (100, 150, 200)))}]\n"
    'mixtures=[{name="m",shares={a=0.5,b=0.25,c=0.25}}]'
)

# What only the mechanics, the law or another file refuse: a few of each kind.
CROSS = {
    "blocks": [
        'tessellation.edge="1 nm"',
        "loading.states=1000000000",
        "numerics.steps=100000000000000000",
        'domain.holes=[[["-1 m","-1 m"],["3 m","-1 m"],["3 m","3 m"],["-1 m","3 m"]]]',
        'in_situ.syy="-100 GPa"',
        'programme.supports=[{start=["9 m","0 m"],end=["9 m","1 m"]}]',
        'programme.supports=[{start=["0 m","0 m"],end=["2 m","0 m"]}]\n'
        'programme.loads=[{start=["0 m","9 m"],end=["2 m","9 m"]}]',
        'numerics={damping="viscous",damping_coefficient="1e9 1/s"}',
    ],
    "particles": [
        'box.width="1 km"',
        'grains=[{name="a",diameter="1 nm"}]',
        'box={width="0.09 mm",depth="0.3 mm",sides="walls"}',
        "beds=100000000",
        "shaking.cycles=1000000000000",
    ],
    "fem": [
        'mesh.size="0.1 mm"',
        'mesh.refine=[{start=["55 m","50 m"],end=["60 m","50 m"],size="1 um"}]',
        'stepping.save_every="1e-12 s"',
        'loads=[{start=["200 m","50 m"],end=["210 m","50 m"],rate="1 MPa/s"}]',
        'supports=[{start=["0 m","0 m"],end=["80 m","0 m"],fix="y"}]',
        "mesh.patches=[[0,1,5,6]]",
        "mesh.patches=[[0,1,6,99]]",
        "material.parameters.poisson_ratio=0.5",
        "material.parameters.nonsense=1.0",
        'mesh={method="paved",outline=[["0 m","0 m"],["80 m","50 m"],["80 m","0 m"],["0 m","50 m"]]}',
        'mesh={method="file",file="curve.csv"}',
        'material={file="curve.csv"}',
    ],
    "scratch": [
        'mesh.size="1 nm"',
        "mesh={growth=1.0,growth_depth=1.0,size='10 nm'}",
        'material={law="lubliner"}',
        "material.parameters.poisson_ratio=0.7",
        "damage={growth_per_joule=1.0}",
    ],
    "calibrate": [
        'search="cma-es"\nswarm.particles=3',
        'free={young_modulus={lower="1 MPa",upper="1 GPa"},poisson_ratio={lower=0.1,upper=0.9}}',
        'fixed={hardening="exponential"}\nstaged=true',
        'law="j2"',
        'curves=["scene.toml"]',
        "swarm={starts=1000,particles=100000,generations=100000}\nincrements=1000",
    ],
    "wear": [
        'counts={source="bed",bed="curve.csv"}',
        'grains=[{name="a",diameter="100 um",scratch=["curve.csv"]}]',
        'counts.source="hoormazdi-2021"\n' + _THREE,
        'load.mode="given"\ngrains=[{name="a",diameter="1 um",grooves=['
        '{force="1 N",area="1 um^2",degree_of_wear=0},{force="2 N",area="2 um^2",degree_of_wear=0}]}]',
    ],
}  # fmt: skip


class Began(Exception):
    """Raised where a stage's record begins, which is where its work does."""


def leaves(model, prefix=""):
    """Dotted key and default of every number and quantity of a scene model, tables of defaults included."""
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if hasattr(type(value), "model_fields"):
            yield from leaves(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            unit = next((m.json_schema.get("x-unit") for m in field.metadata if hasattr(m, "json_schema")), None)
            yield f"{prefix}{name}", value, unit


def numbers(kind, folder, count):
    """Settings that make one number of the scene zero, negative, tiny, huge, or a little different."""
    scene = load_scene(folder / "scene.toml", kind)
    found = []
    for key, value, unit in leaves(scene):
        for new in (0 * value, -value, 1e-9 * value, 1e12 * value, 0.7 * value, 3 * value):
            new = int(new) if isinstance(value, int) else new
            found.append(f'{key}="{new!r} {unit}"' if unit else f"{key}={new!r}")
    return random.Random(7).sample(found, min(count, len(found)))


@pytest.fixture
def folder(tmp_path):
    """A folder with a curve."""
    (tmp_path / "curve.csv").write_text(CURVE)
    return tmp_path


def write(folder, kind):
    path = folder / "scene.toml"
    path.write_text(f'kind = "{kind}"\n{SMALL[kind]}\n')
    return path


def refused_by_stage(kind, path, settings, monkeypatch):
    """Whether the stage refuses the scene before its work."""

    def begin(*arguments, **named):
        raise Began

    monkeypatch.setattr(Record, "begin", begin)
    try:
        STAGES[kind](path, path.with_name("never.nc"), overrides=settings)
    except BadInput:
        return True
    except Began:
        return False
    raise AssertionError("the stage ended without a record")


def refused_by_check(path, settings, monkeypatch):
    """What check finds in the scene with these settings in it."""
    monkeypatch.setattr("graben.stages.tools.check.load_scene", lambda p, kinds: load_scene(p, kinds, settings))
    faults, absent = examine(path)
    return bool(faults or absent)


@pytest.mark.parametrize("kind", STAGES)
def test_check_and_stage_refuse_the_same_numbers(kind, folder, monkeypatch):
    path = write(folder, kind)
    assert not refused_by_check(path, [], monkeypatch)
    for setting in numbers(kind, folder, 40):
        told = refused_by_check(path, [setting], monkeypatch)
        assert told == refused_by_stage(kind, path, [setting], monkeypatch), setting


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in CROSS.items() for text in texts])
def test_check_finds_what_mechanics_laws_and_files_refuse(kind, text, folder, monkeypatch):
    path = write(folder, kind)
    settings = text.split("\n")
    assert refused_by_stage(kind, path, settings, monkeypatch)
    assert refused_by_check(path, settings, monkeypatch)


def test_the_stage_itself_refuses_before_it_writes_anything(folder):
    path = write(folder, "fem")
    before = sorted(folder.iterdir())
    with pytest.raises(BadInput, match="a segment that holds nodes"):
        fem_run.run(path, folder / "o.nc", overrides=['supports=[{start=["0 m","-9 m"],end=["8 m","-9 m"]}]'])
    assert sorted(folder.iterdir()) == before


def test_a_file_that_the_command_line_may_name_is_no_fault(folder):
    path = folder / "scene.toml"
    path.write_text('kind = "calibrate"\n')
    faults, absent = examine(path)
    assert faults == [] and [f.key for f in absent] == ["curves"]


def test_material_files_are_held_against_their_law(folder):
    path = folder / "steel.material.toml"
    path.write_text('law = "elastic"\n[parameters]\nyoung_modulus = "210 GPa"\npoisson_ratio = 0.3\n')
    assert check(path) == []
    path.write_text('law = "elastic"\n[parameters]\nyoung_modulus = "-210 GPa"\n')
    assert {f.key for f in check(path)} == {"parameters.young_modulus", "parameters.poisson_ratio"}
