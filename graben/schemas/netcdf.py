"""NetCDF-4 files, written by netCDF4 itself: xarray, which reads them, takes longer to import than a small run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Column(NamedTuple):
    """A variable of a file: dims, numbers or text, attributes, and the value that marks none (None: there is none)."""

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
