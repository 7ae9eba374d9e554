"""Keys that are gone: the refusal says what to write now, and none of them is a key today."""

import pytest

from graben.errors import BadInput
from graben.schemas.kinds import SCENES, scene_model
from graben.schemas.old_keys import OLD_KEYS, advice_on
from graben.schemas.scene import load_scene

PROGRAMME = 'kind = "blocks"\n[programme]\n'


def keys_of(kind):
    """Dotted keys of a kind of scene, without the numbers of entries in lists."""
    schema = scene_model(kind).model_json_schema()

    def walk(node, name):
        if "$ref" in node:
            node = schema["$defs"][node["$ref"].rpartition("/")[2]]
        lists = [node["items"]] if isinstance(node.get("items"), dict) else []
        for part in (*node.get("anyOf", ()), *node.get("allOf", ()), *lists):
            yield from walk(part, name)
        for key, inner in node.get("properties", {}).items():
            dotted = f"{name}.{key}" if name else key
            yield dotted
            yield from walk(inner, dotted)

    return set(walk(schema, ""))


def test_an_old_key_is_refused_with_what_to_write_now(tmp_path):
    path = tmp_path / "old.toml"
    path.write_text(PROGRAMME + "calm = 0.005\npatience = 3\nnonsense = 1\n")
    with pytest.raises(BadInput) as refused:
        load_scene(path, "blocks")
    said = {fault.key: fault.expected for fault in refused.value.faults}
    assert "programme.frame" in said["programme.calm"] and "numerics.steps" in said["programme.patience"]
    assert said["programme.nonsense"].startswith("no such key")


def test_entries_of_lists_have_no_number_in_the_table(monkeypatch):
    monkeypatch.setitem(OLD_KEYS, "blocks", {"programme.loads.speed": "rate"})
    assert advice_on("blocks", ("programme", "loads", 3, "speed")) == "rate"
    assert advice_on("fem", ("programme", "loads", 3, "speed")).startswith("no such key")


def test_the_keys_of_today_are_found():
    assert {"seed", "programme.frame", "programme.loads.rate"} <= keys_of("blocks")


@pytest.mark.parametrize("kind", OLD_KEYS)
def test_an_old_key_is_no_key_of_today(kind):
    assert kind in SCENES
    assert not keys_of(kind) & set(OLD_KEYS[kind])
