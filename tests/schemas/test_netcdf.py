"""Files that netCDF4 writes and reads are what xarray makes of them."""

import numpy as np
import pytest

from graben.schemas.netcdf import Column, dims_of, open_arrays, write_netcdf

NUMBERS = np.linspace(-1.0, 1.0, 10_000)
COLUMNS = {
    "few": Column(("row", "axis"), np.arange(6.0).reshape(3, 2), {"units": "m"}, None),
    "many": Column(("point",), NUMBERS, {"units": "m"}, None),
    "gap": Column(("row",), np.array([np.nan, 1.0, 2.0]), {"units": "m", "flag_values": [1, 2]}, np.nan),
    "flag": Column(("point",), np.arange(10_000, dtype=np.int8), {}, None),
    "count": Column((), np.array(3, dtype=np.int64), {"units": "1"}, None),
    "name": Column(("row",), np.array(["a", "ü ✓", ""]), {"units": "1"}, None),
    "nobody": Column(("none",), np.zeros(0), {}, None),
}


def same(a, b):
    return a.shape == b.shape and np.array_equal(a, b, equal_nan=b.dtype.kind == "f")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.nc"
    write_netcdf(path, COLUMNS, {"title": "ü", "seed": 3, "share": 0.5})
    return path


def test_xarray_reads_what_was_written(file):
    import xarray

    with xarray.open_dataset(file) as data:
        assert dict(data.attrs) == {"title": "ü", "seed": 3, "share": 0.5}
        assert set(data.variables) == set(COLUMNS) and dict(data.sizes) == dims_of(COLUMNS)
        for name, column in COLUMNS.items():
            assert data[name].dims == column.dims
            assert same(data[name].values, column.values)
            assert data[name].attrs.get("units") == column.attributes.get("units")


def test_arrays_are_what_was_written_after_the_file_is_closed(file):
    with open_arrays(file) as data:
        data.load()
    assert data.attrs == {"title": "ü", "seed": 3, "share": 0.5} and data.sizes == dims_of(COLUMNS)
    assert "few" in data and "other" not in data and float(data["count"]) == 3.0
    for name, column in COLUMNS.items():
        assert data[name].dims == column.dims
        assert same(data[name].values, column.values)
        assert np.asarray(data[name]).shape == column.values.shape
        if column.values.dtype.kind != "U":
            assert data[name].values.dtype == column.values.dtype


@pytest.mark.parametrize("mark", ["scale_factor", "add_offset", "missing_value"])
def test_numbers_that_mean_others_are_left_to_xarray(mark, file):
    import netCDF4

    with netCDF4.Dataset(file, "a") as data:
        data["few"].setncattr(mark, 2.0)
    assert open_arrays(file) is None


def test_variables_that_disagree_about_a_dim_are_refused(tmp_path):
    other = Column(("row",), np.zeros(4), {}, None)
    with pytest.raises(ValueError, match="'row'"):
        write_netcdf(tmp_path / "a.nc", {**COLUMNS, "other": other}, {})
    assert not (tmp_path / "a.nc").exists()


def test_what_the_machine_refuses_is_an_error_of_the_machine(tmp_path):
    with pytest.raises(OSError):
        write_netcdf(tmp_path / "absent" / "a.nc", COLUMNS, {})
