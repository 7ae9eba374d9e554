"""NetCDF-4 files by netCDF4 itself: xarray, which gives them to users, takes longer to import than a small run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Column(NamedTuple):
    """A variable of a file: dims, numbers or text, attributes, and the number that marks none, if any."""

    dims: tuple[str, ...]
    values: np.ndarray
    attributes: Mapping[str, Any]
    fill: float | None


def dims_of(columns: Mapping[str, Column]) -> dict[str, int]:
    """Length of each dim; ValueError where two variables disagree."""
    sizes: dict[str, int] = {}
    for name, column in columns.items():
        for dim, length in zip(column.dims, column.values.shape, strict=True):
            if sizes.setdefault(dim, length) != length:
                raise ValueError(f"{name} has {length} of dim {dim!r}, another variable {sizes[dim]}")
    return sizes


def write_netcdf(path: Path, columns: Mapping[str, Column], attributes: Mapping[str, Any]) -> None:
    """Write one file. Bit-reproducible: no time stamps, fixed compression.

    Raises
    ------
    OSError : no room, no permission
    """
    import netCDF4

    sizes = dims_of(columns)
    try:
        # Of a relative path a leading ~ would become the home folder.
        with netCDF4.Dataset(path.absolute(), "w", format="NETCDF4") as file:
            for dim, length in sizes.items():
                file.createDimension(dim, length)
            file.setncatts(dict(attributes))
            for name, column in columns.items():
                _write(file, name, column)
    except RuntimeError as error:
        raise OSError(f"{error}") from error  # what the library makes of a full disk


def _write(file: Any, name: str, column: Column) -> None:
    values = column.values
    if values.dtype.kind in "SUO":
        variable = file.createVariable(name, str, column.dims)
        values = values.astype(str).astype(object)
    else:
        packed = column.dims and values.size
        many = values.size > 4096
        variable = file.createVariable(
            name, values.dtype, column.dims, fill_value=column.fill, fletcher32=bool(packed),
            zlib=many, complevel=1 if many else 0, shuffle=many,
        )  # fmt: skip
    variable.setncatts(dict(column.attributes))
    if values.size:
        variable.set_auto_maskandscale(False)
        variable[...] = values


class Read:
    """A variable of an open file; its values are read when they are asked for, once."""

    def __init__(self, variable: Any) -> None:
        self._variable = variable
        self.dims: tuple[str, ...] = tuple(variable.dimensions)
        self.attrs: dict[str, Any] = {n: variable.getncattr(n) for n in variable.ncattrs() if n != "_FillValue"}

    @cached_property
    def values(self) -> np.ndarray:
        found = np.asarray(self._variable[...])
        return found if found.dtype.kind != "U" else found.astype(object)

    @property
    def nbytes(self) -> int:
        size = 8 if self._variable.dtype is str else np.dtype(self._variable.dtype).itemsize
        return int(np.prod(self._variable.shape, dtype=np.float64)) * size

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __float__(self) -> float:
        return float(self.values)


class Arrays:
    """An open file with the few things of an xarray.Dataset that stages ask for."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self.attrs: dict[str, Any] = {name: file.getncattr(name) for name in file.ncattrs()}
        self.sizes = {name: len(dim) for name, dim in file.dimensions.items()}
        self.variables = {name: Read(variable) for name, variable in file.variables.items()}

    @property
    def nbytes(self) -> int:
        return sum(variable.nbytes for variable in self.variables.values())

    def __getitem__(self, name: str) -> Read:
        return self.variables[name]

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def load(self) -> Arrays:
        """Read what was not read yet; the file may then be closed."""
        for variable in self.variables.values():
            _ = variable.values
        return self

    def __enter__(self) -> Arrays:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()


_DECODED = {"scale_factor", "add_offset", "missing_value", "_Unsigned"}


def open_arrays(path: Path) -> Arrays | None:
    """Open a file; None where its numbers mean others (scaled, marked as missing) and a full reader is needed."""
    import netCDF4

    file = netCDF4.Dataset(path.absolute())
    file.set_auto_maskandscale(False)
    for variable in file.variables.values():
        marks = set(variable.ncattrs())
        filled = "_FillValue" in marks and not np.all(np.isnan(variable.getncattr("_FillValue")))
        if marks & _DECODED or filled or (variable.dtype is not str and np.dtype(variable.dtype).kind not in "fiu"):
            file.close()
            return None
    return Arrays(file)
