"""Artifacts: what was written is read back; every fault of a foreign, broken or newer file is named."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from graben.errors import BadInput, NotFinite
from graben.schemas import artifact, kinds
from graben.schemas.artifact import Layout, Variable, check_artifact, kind_of, read_artifact, write_artifact
from graben.schemas.outputs import Outputs
from graben.schemas.provenance import Record

LAYOUT = Layout(
    kind="sample",
    version=2,
    title="a sample",
    dims={"row": "rows"},
    variables={
        "force": Variable(("row",), "N", "force on the wall"),
        "gap": Variable(("row",), "m", "gap where there is one", may_be_nan=True, optional=True),
        "count": Variable((), "1", "number of rows", dtype="i8"),
    },
)


@pytest.fixture(autouse=True)
def sample_kind(monkeypatch):
    monkeypatch.setitem(kinds.LAYOUTS, "sample", f"{__name__}:LAYOUT")
    monkeypatch.setattr(kinds, "layout", lambda kind: LAYOUT)


def write(path, **changes):
    arrays = {"force": np.arange(3.0), "count": 3} | changes
    write_artifact(path, LAYOUT, arrays, Record.begin())
    return path


def test_round_trip_keeps_values_units_and_provenance(tmp_path):
    data = read_artifact(write(tmp_path / "a.nc", gap=[np.nan, 1.0, 2.0]), "sample")
    assert data.force.values.tolist() == [0.0, 1.0, 2.0]
    assert data.force.attrs["units"] == "N"
    assert data.attrs["schema_version"] == 2
    assert data.attrs["software"] == "graben"
    assert "wall_s" in data.attrs["cost"]


def test_a_tilde_is_a_name_like_any_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path in (Path("~/a.nc"), Path("~a.nc")):
        write(path)
        assert path.is_file() and kind_of(path) == "sample"
        assert check_artifact(path, ["sample"]) == []
        with pytest.raises(BadInput, match="exist"):
            Outputs(path).claim([])
        Outputs(path).claim([], overwrite=True)


def test_nan_is_never_written_where_it_means_nothing(tmp_path):
    with pytest.raises(NotFinite, match="force holds 1 values"):
        write(tmp_path / "a.nc", force=np.array([0.0, np.nan, 1.0]))
    assert list(tmp_path.iterdir()) == []


def test_numbers_whose_cubes_overflow_are_none(tmp_path, monkeypatch):
    for gap in (-1e70, np.inf):
        with pytest.raises(NotFinite, match="gap holds 1 values"):
            write(tmp_path / "a.nc", gap=[np.nan, gap, 1.0])
    monkeypatch.setattr(artifact, "_LARGEST", np.inf)
    path = write(tmp_path / "a.nc", gap=[np.nan, -1e70, 1.0])
    monkeypatch.undo()
    monkeypatch.setitem(kinds.LAYOUTS, "sample", f"{__name__}:LAYOUT")
    monkeypatch.setattr(kinds, "layout", lambda kind: LAYOUT)
    assert [fault.key for fault in check_artifact(path)] == ["gap"]


def test_a_variable_may_hold_no_number_at_all_where_its_layout_says_so(tmp_path, monkeypatch):
    assert check_artifact(write(tmp_path / "a.nc", gap=[np.nan] * 3)) == []  # optional
    gap = LAYOUT.variables["gap"]
    for options, keys in (({}, ["gap"]), ({"may_be_all_nan": True}, [])):
        layout = replace(LAYOUT, variables={**LAYOUT.variables, "gap": replace(gap, optional=False, **options)})
        monkeypatch.setattr(kinds, "layout", lambda kind, layout=layout: layout)
        assert [fault.key for fault in check_artifact(tmp_path / "a.nc")] == keys


def test_an_interrupted_write_leaves_no_file(tmp_path, monkeypatch):
    def half(path, columns, attributes):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(artifact, "write_netcdf", half)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "a.nc")
    assert list(tmp_path.iterdir()) == []


def test_arrays_that_do_not_fit_the_layout_are_a_program_fault(tmp_path):
    with pytest.raises(ValueError, match="not in the layout"):
        write(tmp_path / "a.nc", extra=1.0)
    with pytest.raises(ValueError, match="shape"):
        write(tmp_path / "a.nc", force=np.zeros((2, 2)))


def test_a_run_without_states_is_none(tmp_path, monkeypatch):
    timed = replace(
        LAYOUT, dims={"time": "states"}, variables={"load": Variable(("time",), "N", "force")}, filled=("time",)
    )
    monkeypatch.setattr(kinds, "layout", lambda kind: timed)
    write_artifact(tmp_path / "a.nc", timed, {"load": np.zeros(0)}, Record.begin())
    assert "at least one: states" in check_artifact(tmp_path / "a.nc")[0].expected


def test_each_kind_of_broken_file_is_named(tmp_path):
    import xarray

    good = write(tmp_path / "good.nc")
    truncated = tmp_path / "truncated.nc"
    truncated.write_bytes(good.read_bytes()[:600])
    foreign = tmp_path / "foreign.nc"
    xarray.Dataset({"t": ("x", [1.0])}).to_netcdf(foreign)

    assert check_artifact(good) == []
    assert "existing" in check_artifact(tmp_path / "none.nc")[0].expected
    assert "NetCDF" in check_artifact(truncated)[0].expected
    assert "not an artifact" in check_artifact(foreign)[0].value
    assert "'curves'" in check_artifact(good, ["curves"])[0].expected

    newer = tmp_path / "newer.nc"
    with xarray.open_dataset(good) as data:
        data.load().assign_attrs(schema_version=9).to_netcdf(newer)
    assert "at most 2" in check_artifact(newer)[0].expected


def test_every_fault_of_the_variables_is_named_at_once(tmp_path):
    import xarray

    good = write(tmp_path / "good.nc")
    with xarray.open_dataset(good) as data:
        data = data.load()
    data["force"] = ("row", np.full(3, np.nan), {"units": "kN"})
    bad = tmp_path / "bad.nc"
    data.drop_vars("count").to_netcdf(bad)
    keys = {fault.key for fault in check_artifact(bad)}
    assert keys == {"force", "force.units", "count"}
    with pytest.raises(BadInput):
        read_artifact(bad, "sample")


def test_layouts_of_all_kinds_declare_dims_units_and_names():
    for kind, address in kinds.LAYOUTS.items():
        if kind == "sample":
            continue
        declared = kinds._load(address)
        assert declared.kind == kind
        for name, variable in declared.variables.items():
            assert variable.long_name, (kind, name)
            assert variable.units, (kind, name)
            assert set(variable.dims) <= set(declared.dims), (kind, name)


@pytest.mark.parametrize(
    ("name", "value", "key"),
    [
        ("cost", None, "cost"),
        ("cost", "{broken", "cost"),
        ("cost", "[1]", "cost"),
        ("cost", 3.0, "cost"),
        ("inputs", '"text"', "inputs"),
        ("scene", "kind = 'other'", "scene_sha256"),
        ("seed", "one", "seed"),
        ("warnings", 3.5, "warnings"),
        ("schema_version", "two", "schema_version"),
        ("schema_version", 1.5, "schema_version"),
        ("schema_kind", [1, 2], "schema_kind"),
        ("machine", "elsewhere", "content_sha256"),
    ],
)
def test_damaged_attributes_are_named(tmp_path, name, value, key):
    import xarray

    with xarray.open_dataset(write(tmp_path / "a.nc")) as data:
        data = data.load()
    data.attrs.pop(name) if value is None else data.attrs.update({name: value})
    data.to_netcdf(tmp_path / "b.nc")
    assert key in [fault.key for fault in check_artifact(tmp_path / "b.nc")]


def test_changed_numbers_are_noticed(tmp_path):
    import netCDF4

    path = write(tmp_path / "a.nc")
    with netCDF4.Dataset(path, "a") as data:
        data["count"][...] = 4  # a scalar, for which HDF5 keeps no checksum
    assert [fault.key for fault in check_artifact(path)] == ["content_sha256"]


def test_files_cut_off_or_with_flipped_bytes_are_refused_or_read_as_written(tmp_path):
    path = write(tmp_path / "a.nc", gap=[np.nan, 1.0, 2.0])
    whole, dice = path.read_bytes(), random.Random(1)
    for tenth in range(10):
        path.write_bytes(whole[: tenth * len(whole) // 10])
        assert check_artifact(path)
    for _ in range(150):
        damaged = bytearray(whole)
        for _ in range(dice.choice((1, 1, 4))):
            damaged[dice.randrange(len(whole))] ^= 1 << dice.randrange(8)
        path.write_bytes(damaged)
        if not check_artifact(path):  # the mark of the seal itself
            data = read_artifact(path, "sample")
            assert data.force.values.tolist() == [0.0, 1.0, 2.0]
            assert int(data["count"]) == 3


def test_damaged_bytes_are_found_before_any_library_reads_them(tmp_path, monkeypatch):
    import xarray

    path = write(tmp_path / "a.nc")
    whole = path.read_bytes()
    monkeypatch.setattr(xarray, "open_dataset", lambda *_, **__: pytest.fail("read"))
    for at in (9, 100, len(whole) // 2, len(whole) - 60):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 64]) + whole[at + 1 :])
        assert "damaged" in check_artifact(path)[0].expected


def test_sizes_that_no_file_of_that_length_holds_are_refused(tmp_path):
    import netCDF4

    path = write(tmp_path / "a.nc")
    with netCDF4.Dataset(path, "a") as data:
        data.createDimension("huge", 10**12)
        data.createVariable("gap", "f8", ("huge",), chunksizes=(1000,))
    assert "bytes of data" in check_artifact(path)[0].expected


def test_indices_out_of_range_are_named(tmp_path, monkeypatch):
    variables = {**LAYOUT.variables, "of": Variable(("row",), "1", "row", dtype="i4", index_of="row or -1")}
    monkeypatch.setattr(kinds, "layout", lambda kind: replace(LAYOUT, variables=variables))
    for values, sound in (([-1, 0, 2], True), ([0, 1, 3], False), ([-2, 0, 1], False)):
        layout = replace(LAYOUT, variables=variables)
        arrays = {"force": np.arange(3.0), "count": 3, "of": values}
        write_artifact(tmp_path / "a.nc", layout, arrays, Record.begin())
        assert [fault.key for fault in check_artifact(tmp_path / "a.nc")] == ([] if sound else ["of"])


def test_what_a_failed_run_kept_is_marked_and_holds_nan_where_numbers_are_not_finite(tmp_path):
    arrays = {"force": np.array([1.0, np.inf, np.nan]), "count": 3}
    write_artifact(tmp_path / "a.partial.nc", LAYOUT, arrays, Record.begin(), partial="energy error 9 %")
    assert check_artifact(tmp_path / "a.partial.nc") == []
    kept = read_artifact(tmp_path / "a.partial.nc", "sample", partial=True)
    assert kept.attrs["partial"] == "energy error 9 %"
    assert kept.force.values[0] == 1.0
    assert np.isnan(kept.force.values[1:]).all()
    with pytest.raises(BadInput, match="2 of 3 values"):
        read_artifact(tmp_path / "a.partial.nc", "sample")
