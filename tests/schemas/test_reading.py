"""Files that a user names: what is no text file of bounded size is refused at once, with file and reason."""

import os
import threading

import pytest

from graben.errors import BadInput
from graben.schemas.polygon_file import read_polygons
from graben.schemas.reading import MiB, read_bytes, read_json, read_text, read_toml
from graben.schemas.scene import load_scene
from graben.schemas.scenes.material import read_material
from graben.schemas.template import template
from graben.stages.calibrate.measured import Reading, read_measured
from graben.stages.tools.check import check

READERS = {
    "scene": (".toml", lambda path: load_scene(path, "wear")),
    "material": (".material.toml", read_material),
    "map": (".geojson", read_polygons),
    "curves": (".csv", lambda path: read_measured([path], Reading())),
}
SCENE = template("wear").encode()


def said(reader, path):
    """What a reader says of a file that it must refuse; a reader that blocks fails the test."""
    out = []

    def read():
        try:
            reader(path)
        except BaseException as error:
            out.append(error)

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    thread.join(60.0)
    assert not thread.is_alive(), "waits for ever"
    assert len(out) == 1 and type(out[0]) is BadInput, out
    assert str(path) in str(out[0])
    return str(out[0])


def sparse(path):
    with open(path, "wb") as stream:
        stream.truncate(3 * 1024 * MiB)


NO_FILES = {
    "absent": (lambda path: None, "existing"),
    "folder": (os.mkdir, "folder"),
    "pipe": (os.mkfifo, "pipe"),
    "device": (lambda path: os.symlink("/dev/zero", path), "device"),
    "loop": (lambda path: os.symlink(path, path), "readable"),
    "huge": (sparse, "MiB"),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("made", NO_FILES)
def test_what_is_no_file_is_refused_at_once(reader, made, tmp_path):
    suffix, read = READERS[reader]
    path = tmp_path / f"input{suffix}"
    make, words = NO_FILES[made]
    make(path)
    assert words in said(read, path)


def test_names_that_no_file_can_have(tmp_path):
    for name in ("a\0.toml", "a" * 5000 + ".toml"):
        said(READERS["scene"][1], tmp_path / name)


CONTENTS = {
    "latin": (b"title = '\xe4'", "UTF-8"),
    "utf16": ("kind = 'wear'".encode("utf-16"), "UTF-16"),
    "null": (b"kind = 'wear'\0", "null"),
    "twice": (b"kind = 'wear'\n" + SCENE, "TOML"),
    "deep lists": (b"a = " + b"[" * 50_000 + b"]" * 50_000, "deep"),
    "deep tables": (b"a = " + b"{b=" * 5_000 + b"1" + b"}" * 5_000, "deep"),
    "dotted key": (b"a" + b".a" * 300_000 + b" = 1", "dotted key"),
    "dotted header": (b"[" + b'"a" . ' * 100_000 + b"a]", "dotted key"),
    "long key": (b"a" * (MiB - 100) + b" = 1", "kind"),
    "long digits": (b"a = " + b"9" * 10_000, "TOML"),
    "large": (b"# " + b"a" * (2 * MiB), "MiB"),
    "empty": (b"", "absent"),
}


@pytest.mark.parametrize("content", CONTENTS)
def test_scenes_of_any_bytes_are_refused_in_a_sentence(content, tmp_path):
    text, words = CONTENTS[content]
    path = tmp_path / "scene.toml"
    path.write_bytes(text)
    assert words in said(READERS["scene"][1], path)
    if words != "absent":
        assert check(path)
        path = path.rename(tmp_path / "a.material.toml")
        if words not in ("kind",):
            assert words in said(read_material, path)


def test_a_huge_value_is_named_in_a_short_message(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(SCENE.replace(b"seed = 0", b"seed = 0x" + b"f" * 100_000))
    assert "huge integer" in said(READERS["scene"][1], path)
    path.write_bytes(SCENE.replace(b'title = ""', b"title = [" + b"1," * 100_000 + b"]"))
    assert len(said(READERS["scene"][1], path)) < 1000


def test_a_byte_order_mark_is_no_fault(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SCENE)
    assert load_scene(path, "wear").source.text == SCENE.decode()


@pytest.mark.parametrize("text", ['{"type": ', "[" * 100_000, '{"a": NaN}', '{"a": -Infinity}', "9" * 10_000, "\0"])
def test_json_that_is_none(text, tmp_path):
    path = tmp_path / "map.geojson"
    path.write_text(text)
    said(lambda p: read_json(p, "map"), path)
    said(read_polygons, path)


def test_nested_collections(tmp_path):
    path = tmp_path / "map.geojson"
    deep = 600
    path.write_text('{"type":"GeometryCollection","geometries":[' * deep + "]}" * deep)
    said(read_polygons, path)


def test_regular_files_are_read(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes("a = 'µ'\r\n".encode())
    assert read_bytes(path, "file") == "a = 'µ'\r\n".encode()
    assert read_text(path, "file") == "a = 'µ'\r\n"
    assert read_toml(path, "file")[1] == {"a": "µ"}
