"""Artifacts: what was written is read back; every fault of a foreign, broken or newer file is named."""

import numpy as np
import pytest

from graben.errors import BadInput, NotFinite
from graben.schemas import kinds
from graben.schemas.artifact import Layout, Variable, check_artifact, read_artifact, write_artifact
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


def test_nan_is_never_written_where_it_means_nothing(tmp_path):
    with pytest.raises(NotFinite, match="force holds 1 values"):
        write(tmp_path / "a.nc", force=np.array([0.0, np.nan, 1.0]))
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_write_leaves_no_file(tmp_path, monkeypatch):
    import xarray

    def half(self, path, **kwargs):
        path.write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(xarray.Dataset, "to_netcdf", half)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "a.nc")
    assert list(tmp_path.iterdir()) == []


def test_arrays_that_do_not_fit_the_layout_are_a_program_fault(tmp_path):
    with pytest.raises(ValueError, match="not in the layout"):
        write(tmp_path / "a.nc", extra=1.0)
    with pytest.raises(ValueError, match="shape"):
        write(tmp_path / "a.nc", force=np.zeros((2, 2)))


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
