"""Scenes: every fault at once, with file, key, value and what was expected."""

import json
import tomllib
from typing import get_args

import pytest
from pydantic import BaseModel

from graben.errors import BadInput
from graben.schemas.kinds import SCENES, scene_model
from graben.schemas.scene import load_scene
from graben.schemas.template import json_schema, template


@pytest.fixture
def scene_file(tmp_path):
    def write(text):
        path = tmp_path / "scene.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("kind", SCENES)
def test_the_template_of_each_kind_is_a_scene(kind, tmp_path):
    path = tmp_path / f"{kind}.toml"
    path.write_text(template(kind))
    scene = _load_without_inputs(path, kind)
    assert scene.kind == kind


def _load_without_inputs(path, kind):
    """Load a template; files it names as examples need not exist here, nothing else may be wrong."""
    context = {"folder": path.parent, "check_files": False}
    return scene_model(kind).model_validate(tomllib.loads(path.read_text()), context=context)


def models_within(annotation):
    """Every scene model that a type annotation mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_within(argument)


def undescribed(model):
    """Dotted names of the keys without a description, in a model and in the tables it holds."""
    for name, info in model.model_fields.items():
        inner = list(models_within(info.annotation))
        if not info.description and name != "kind" and not inner:
            yield f"{model.__name__}.{name}"
        for table in inner:
            yield from undescribed(table)


@pytest.mark.parametrize("kind", SCENES)
def test_every_key_is_described(kind):
    assert list(undescribed(scene_model(kind))) == []


@pytest.mark.parametrize("kind", SCENES)
def test_the_json_schema_tells_editors_the_keys(kind):
    schema = json.loads(json_schema(kind))
    assert {"kind", "seed", "fidelity"} <= set(schema["properties"])
    assert schema["additionalProperties"] is False


def test_every_fault_is_named_at_once(scene_file):
    path = scene_file(template("blocks").replace("seed = 0", "seed = -1", 1) + "\n[nonsense]\nkey = 1\n")
    with pytest.raises(BadInput) as caught:
        load_scene(path, "blocks")
    keys = {fault.key for fault in caught.value.faults}
    assert {"seed", "nonsense"} <= keys
    assert all(fault.file == str(path) and fault.expected for fault in caught.value.faults)


def test_foreign_kinds_and_broken_files_are_refused(scene_file, tmp_path):
    with pytest.raises(BadInput, match="expected 'blocks'"):
        load_scene(scene_file('kind = "wear"\n'), "blocks")
    with pytest.raises(BadInput, match="valid TOML"):
        load_scene(scene_file("kind = = 3"), "blocks")
    with pytest.raises(BadInput, match="absent"):
        load_scene(scene_file(""), "blocks")
    with pytest.raises(BadInput, match="existing scene file"):
        load_scene(tmp_path / "nowhere.toml", "blocks")
    with pytest.raises(BadInput, match="UTF-8"):
        path = tmp_path / "latin.toml"
        path.write_bytes(b"title = '\xff'")
        load_scene(path, "blocks")


def test_overrides_replace_keys_and_are_noted_in_the_text(scene_file):
    path = scene_file(template("blocks"))
    scene = load_scene(path, "blocks", ["seed=7", "title=wide beds", "fidelity=draft"])
    assert (scene.seed, scene.title, scene.fidelity) == (7, "wide beds", "draft")
    assert scene.source.effective_text.startswith("# graben set: seed=7\n")
    with pytest.raises(BadInput, match="KEY=VALUE"):
        load_scene(path, "blocks", ["seed"])
    with pytest.raises(BadInput, match="no such key"):
        load_scene(path, "blocks", ["sede=7"])


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("machine.applied_load=1,5 kN", "write 1.5 kN"),
        ('machine.applied_load="1 500 N"', "thousands"),
        ("machine.applied_load=1500", "bare number"),
        ("machine.rotation=50 Hz", "names its angle"),
        ("seed=1,5", "integer"),
        ("seed=3\nfidelity='draft'", "one line"),
        ("title=a\udcff", "one line"),
        ("seed=" + "[" * 5000, "integer"),
        ("seed=" + "9" * 5000, "integer"),
        ("seed=0x" + "f" * 50_000, "huge integer"),
        ("a" + ".a" * 5000 + "=1", "dotted key"),
        ("kind=0x" + "f" * 50_000, "kind"),
        ("machine.wheel_diameter=2**2 m", "one finite number"),
    ],
)
def test_settings_that_are_none(setting, words, scene_file):
    with pytest.raises(BadInput, match=words) as caught:
        load_scene(scene_file(template("wear")), "wear", [setting])
    assert len(str(caught.value)) < 1000


def test_a_setting_in_any_spelling_of_one_meaning(scene_file):
    for setting in ("machine.applied_load=1.5 kN", 'machine.applied_load="1.5\u00a0kN"'):
        assert load_scene(scene_file(template("wear")), "wear", [setting]).machine.applied_load == 1500.0
