"""Files of saved states: read back as written, or refused by name; damaged bytes never get through."""

import random
from contextlib import suppress

import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.saved import read_saved, write_saved

OWNER = {"scene": "abc", "version": "1"}
ARRAYS = {"x": np.linspace(0.0, 1.0, 300), "pair": np.arange(40).reshape(-1, 2), "words": np.array(["a", "bc"])}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.state.npz"
    write_saved(path, OWNER, ARRAYS)
    return path


def same(found):
    return set(found) == set(ARRAYS) and all(
        found[name].dtype == array.dtype and np.array_equal(found[name], array) for name, array in ARRAYS.items()
    )


def refused(path):
    with pytest.raises(BadInput) as error:
        read_saved(path, OWNER, "that of the same scene")
    assert all(fault.file == str(path) for fault in error.value.faults)
    return str(error.value)


def test_what_was_written_is_read_back(file):
    assert same(read_saved(file, OWNER, ""))


def test_files_cut_off_anywhere_are_refused(file):
    whole = file.read_bytes()
    for tenth in range(10):
        file.write_bytes(whole[: tenth * len(whole) // 10])
        refused(file)


def test_no_flipped_byte_changes_what_is_read(file):
    whole, dice = file.read_bytes(), random.Random(5)
    for _ in range(400):
        damaged = bytearray(whole)
        for _ in range(dice.choice((1, 1, 3))):
            damaged[dice.randrange(len(whole))] ^= 1 << dice.randrange(8)
        file.write_bytes(damaged)
        with suppress(BadInput):
            assert same(read_saved(file, OWNER, ""))  # a byte that nothing is read from, such as a time stamp


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("x", ARRAYS["x"][:-1]),
        ("x", np.full(300, np.nan)),
        ("pair", ARRAYS["pair"] + 1_000_000),
        ("pair", ARRAYS["pair"].astype(np.int32)),
        ("more", np.zeros(3)),
        ("x", None),
    ],
)
def test_arrays_that_were_changed_are_refused(file, name, array):
    with np.load(file) as data:
        stored = {**dict(data), name: array}
    np.savez(file, **{key: value for key, value in stored.items() if value is not None})
    assert "sha256" in refused(file)


def test_pickled_objects_are_never_loaded(file):

    with np.load(file) as data:
        stored = {**dict(data), "x": np.array([{"an": "object"}], dtype=object)}
    np.savez(file, **stored)
    assert "allow_pickle=False" in refused(file)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"no archive at all", b"\x93NUMPY\x01\x00"])
def test_other_files_are_refused(file, data):
    file.write_bytes(data)
    refused(file)


def test_a_file_of_another_owner_names_what_differs(file):
    with pytest.raises(BadInput, match="another scene: expected that of this one"):
        read_saved(file, {**OWNER, "scene": "def"}, "that of this one")
    with pytest.raises(BadInput, match="another version"):
        read_saved(file, {**OWNER, "version": "2"}, "that of this one")


def test_a_run_goes_on_where_its_state_finds_no_room_and_the_former_one_stays(file, caplog, monkeypatch):
    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    before = file.read_bytes()
    monkeypatch.setattr(np, "savez", full)
    assert not write_saved(file, OWNER, ARRAYS)
    assert "no state is kept" in caplog.text and "No space left" in caplog.text
    assert file.read_bytes() == before and list(file.parent.iterdir()) == [file]
