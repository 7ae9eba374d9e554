"""Artifacts: NetCDF-4 files whose variables, dims and units are declared once, in a Layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graben.errors import BadInput, Fault, NotFinite
from graben.schemas.files import whole_file
from graben.schemas.provenance import Record

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Variable:
    """One variable of a layout.

    dims : names, in order; () for a scalar
    units : UDUNITS text, "1" where dimensionless
    dtype : numpy dtype; "S" or "U" for text
    optional : may be absent
    may_be_nan : nan marks "no value here" (padding, a measure that does not exist); elsewhere nan is a fault
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"
    optional: bool = False
    may_be_nan: bool = False
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Layout:
    """What an artifact of one kind holds. `version` grows when a reader of the old one would fail."""

    kind: str
    version: int
    title: str
    dims: Mapping[str, str]
    variables: Mapping[str, Variable]
    attributes: Mapping[str, str] = field(default_factory=dict)


def write_artifact(
    path: str | Path,
    layout: Layout,
    arrays: Mapping[str, Any],
    record: Record,
    attributes: Mapping[str, Any] | None = None,
) -> None:
    """Check `arrays` against `layout` and write them as one NetCDF-4 file, whole or not at all.

    Raises
    ------
    NotFinite : nan or infinity where the layout allows none
    MachineFailed : no room, no permission
    ValueError : the arrays do not fit the layout (a fault of the program, not of its user)
    """
    import xarray

    variables = {}
    for name, values in arrays.items():
        declared = layout.variables.get(name)
        if declared is None:
            raise ValueError(f"{layout.kind}: variable {name!r} is not in the layout")
        array = np.asarray(values)
        if array.dtype.kind not in "SUO":
            array = array.astype(declared.dtype)
        if array.ndim != len(declared.dims):
            raise ValueError(f"{layout.kind}: {name} has shape {array.shape}, expected dims {declared.dims}")
        _refuse_non_finite(layout.kind, name, declared, array)
        about = {"units": declared.units, "long_name": declared.long_name, **declared.attributes}
        variables[name] = (declared.dims, array, about)
    missing = [n for n, v in layout.variables.items() if not v.optional and n not in arrays]
    if missing:
        raise ValueError(f"{layout.kind}: missing variables {missing}")
    dataset = xarray.Dataset(
        variables,
        attrs={
            "Conventions": "CF-1.11 UGRID-1.0",
            "title": layout.title,
            "schema_kind": layout.kind,
            "schema_version": layout.version,
            **layout.attributes,
            **record.attributes(),
            **(attributes or {}),
        },
    )
    # Bit-reproducible data: no time stamps, fixed compression.
    encoding: dict[Any, dict[str, Any]] = {
        n: {"zlib": True, "complevel": 1, "shuffle": True}
        for n, v in dataset.variables.items()
        if v.ndim and v.dtype.kind in "fiu" and v.size > 4096
    }
    for name, declared in layout.variables.items():
        if name in dataset.variables and dataset[name].dtype.kind == "f":
            encoding.setdefault(name, {})["_FillValue"] = np.nan if declared.may_be_nan else None
    with whole_file(path) as temporary:
        try:
            dataset.to_netcdf(temporary, engine="netcdf4", format="NETCDF4", encoding=encoding)
        except RuntimeError as error:
            raise OSError(f"{error}") from error  # what the library makes of a full disk


def _refuse_non_finite(kind: str, name: str, declared: Variable, array: np.ndarray) -> None:
    if array.dtype.kind != "f":
        return
    bad = np.isinf(array) if declared.may_be_nan else ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0]) if array.ndim else ()
        raise NotFinite(f"{kind}: {name} holds {int(bad.sum())} values that are not finite, the first at {first}")


def read_artifact(path: str | Path, kind: str | Iterable[str]) -> xarray.Dataset:
    """Read an artifact into memory after checking it against its layout.

    Raises
    ------
    BadInput : not a file, not NetCDF, foreign, of another kind, newer than this software, or with faults
    """
    import xarray

    faults = check_artifact(path, [kind] if isinstance(kind, str) else list(kind))
    if faults:
        raise BadInput(faults)
    with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as dataset:
        return dataset.load()


def check_artifact(path: str | Path, kinds: Iterable[str] | None = None) -> list[Fault]:
    """Every fault of an artifact file; empty when it is as its layout says.

    kinds : those the caller takes; None for any known one
    """
    import xarray

    from graben.schemas.kinds import LAYOUTS, layout

    path = Path(path)
    if not path.is_file():
        return [Fault(str(path), "", "", "an existing artifact file")]
    try:
        dataset = xarray.open_dataset(path, engine="netcdf4", decode_times=False)
    except (OSError, ValueError, RuntimeError) as error:
        return [Fault(str(path), "", "", f"a whole NetCDF-4 file ({error})")]
    with dataset:
        kind = dataset.attrs.get("schema_kind")
        accepted = list(kinds) if kinds is not None else list(LAYOUTS)
        if kind not in accepted or kind not in LAYOUTS:
            shown = repr(kind) if kind is not None else "(absent: not an artifact of graben)"
            return [Fault(str(path), "schema_kind", shown, " or ".join(map(repr, accepted)))]
        declared = layout(str(kind))
        version = int(dataset.attrs.get("schema_version", 0))
        if version > declared.version:
            return [Fault(str(path), "schema_version", str(version), f"at most {declared.version}; update graben")]
        return _variable_faults(str(path), declared, dataset)


def _variable_faults(file: str, declared: Layout, dataset: xarray.Dataset) -> list[Fault]:
    faults = []
    for name, variable in declared.variables.items():
        if name not in dataset.variables:
            if not variable.optional:
                faults.append(Fault(file, name, "(absent)", f"variable with dims {variable.dims}"))
            continue
        found = dataset[name]
        if tuple(found.dims) != variable.dims:
            faults.append(Fault(file, f"{name}.dims", str(tuple(found.dims)), str(variable.dims)))
            continue
        units = found.attrs.get("units")
        if units != variable.units:
            faults.append(Fault(file, f"{name}.units", repr(units), repr(variable.units)))
        try:
            values = np.asarray(found.values)
        except (OSError, RuntimeError, ValueError) as error:
            faults.append(Fault(file, name, "", f"readable data ({error}); the file seems truncated"))
            continue
        if values.dtype.kind != "f" or values.size == 0:
            continue
        if not variable.may_be_nan and not np.isfinite(values).all():
            bad = int((~np.isfinite(values)).sum())
            faults.append(Fault(file, name, f"{bad} of {values.size} values nan or infinite", "finite numbers"))
        elif variable.may_be_nan and np.isnan(values).all() and not variable.optional:
            faults.append(Fault(file, name, "nan throughout", "at least one number"))
    return faults
