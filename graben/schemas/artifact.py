"""Artifacts: NetCDF-4 files whose variables, dims and units are declared once, in a Layout."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graben.errors import BadInput, Fault, NotFinite
from graben.schemas.artifact_marks import DIGEST, attribute_faults, content_digest, seal, seal_broken
from graben.schemas.files import unfit, whole_file
from graben.schemas.netcdf import Arrays, Column, dims_of, open_arrays, write_netcdf
from graben.schemas.provenance import Record

if TYPE_CHECKING:
    import xarray

# In SI units no number of a rock or a grain comes near.
_LARGEST = 1e60

PARTIAL = "partial"
"""Global attribute of an artifact that a failed run kept: why it stopped."""


@dataclass(frozen=True)
class Variable:
    """One variable of a layout.

    dims : names, in order; () for a scalar
    units : UDUNITS text, "1" where dimensionless
    dtype : numpy dtype; "S" or "U" for text
    optional : may be absent
    may_be_nan : nan marks "no value here" (padding, a measure that does not exist); elsewhere nan is a fault
    may_be_all_nan : the same, and there may be no value at all
    index_of : the dim that its values are indices of; "dim or -1" where -1 marks none
    sum_of : the dim whose length its values add up to
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"
    optional: bool = False
    may_be_nan: bool = False
    may_be_all_nan: bool = False
    index_of: str = ""
    sum_of: str = ""
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "may_be_nan", self.may_be_nan or self.may_be_all_nan)


@dataclass(frozen=True)
class Layout:
    """What an artifact of one kind holds. `version` grows when a reader of the old one would fail.

    attributes : global attributes with their values; own_attributes : those that differ from run to run, by type
    filled : dims of which there is at least one, so that readers may ask for the first and the last
    """

    kind: str
    version: int
    title: str
    dims: Mapping[str, str]
    variables: Mapping[str, Variable]
    attributes: Mapping[str, str] = field(default_factory=dict)
    own_attributes: Mapping[str, type] = field(default_factory=dict)
    filled: tuple[str, ...] = ()


def write_artifact(
    path: str | Path,
    layout: Layout,
    arrays: Mapping[str, Any],
    record: Record,
    attributes: Mapping[str, Any] | None = None,
    partial: str = "",
) -> None:
    """Check `arrays` against `layout` and write them as one NetCDF-4 file, whole or not at all.

    partial : why the run stopped before its end; such an artifact bears that as a mark, and nan where its numbers
        are not finite

    Raises
    ------
    NotFinite : nan or infinity where the layout allows none
    MachineFailed : no room, no permission
    ValueError : the arrays do not fit the layout (a fault of the program, not of its user)
    """
    columns = {}
    for name, values in arrays.items():
        declared = layout.variables.get(name)
        if declared is None:
            raise ValueError(f"{layout.kind}: variable {name!r} is not in the layout")
        array = np.asarray(values)
        if array.dtype.kind not in "SUO":
            array = array.astype(declared.dtype)
        if partial and array.dtype.kind == "f":
            array = np.where(np.isfinite(array), array, np.nan)
        if array.ndim != len(declared.dims):
            raise ValueError(f"{layout.kind}: {name} has shape {array.shape}, expected dims {declared.dims}")
        if not partial:
            _refuse_non_finite(layout.kind, name, declared, array)
        about = {"units": declared.units, "long_name": declared.long_name, **declared.attributes}
        fill = np.nan if array.dtype.kind == "f" and (declared.may_be_nan or partial) else None
        columns[name] = Column(declared.dims, array, about, fill)
    missing = [n for n, v in layout.variables.items() if not v.optional and n not in arrays]
    if missing:
        raise ValueError(f"{layout.kind}: missing variables {missing}")
    dims_of(columns)
    marks = {
        "Conventions": "CF-1.11 UGRID-1.0",
        "title": layout.title,
        "schema_kind": layout.kind,
        "schema_version": layout.version,
        **layout.attributes,
        **record.attributes(),
        **(attributes or {}),
        **({PARTIAL: partial} if partial else {}),
    }
    marks[DIGEST] = content_digest(marks, {name: column.values for name, column in columns.items()})
    with whole_file(path, ends_run=not partial) as temporary:
        write_netcdf(temporary, columns, marks)
        seal(temporary)


def _refuse_non_finite(kind: str, name: str, declared: Variable, array: np.ndarray) -> None:
    if array.dtype.kind != "f":
        return
    bad = _absurd(array) & ~(np.isnan(array) & declared.may_be_nan)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0]) if array.ndim else ()
        raise NotFinite(f"{kind}: {name} holds {int(bad.sum())} values that are not finite, the first at {first}")


def _absurd(values: np.ndarray) -> np.ndarray:
    """Where numbers are nan, infinite, or so large that their cubes soon are."""
    return ~(np.abs(values) < _LARGEST)


def read_artifact(path: str | Path, kind: str | Iterable[str], *, partial: bool = False) -> xarray.Dataset:
    """Read an artifact into memory after checking it against its layout.

    partial : take what a failed run kept even where it holds nan

    Raises
    ------
    BadInput : not a file, not NetCDF, foreign, of another kind, newer than this software, or with faults
    """
    return _whole(path, kind, partial, _labelled)


def read_arrays(path: str | Path, kind: str | Iterable[str]) -> Arrays | xarray.Dataset:
    """As `read_artifact`, for stages: arrays without the labels of xarray, which takes long to import."""
    return _whole(path, kind, False, open_artifact)


def _whole(path: str | Path, kind: str | Iterable[str], partial: bool, opened: Callable[[Path], Any]) -> Any:
    faults, dataset = _read(Path(path), [kind] if isinstance(kind, str) else list(kind), partial, opened)
    if dataset is None:
        raise BadInput(faults)
    return dataset


def check_artifact(path: str | Path, kinds: Iterable[str] | None = None) -> list[Fault]:
    """Every fault of an artifact file; empty when it is as its layout says.

    kinds : those the caller takes; None for any known one
    """
    from graben.schemas.kinds import LAYOUTS

    return _read(Path(path), list(kinds) if kinds is not None else list(LAYOUTS), True, open_artifact)[0]


def open_artifact(path: Path) -> Arrays | xarray.Dataset:
    """Open without a check; the full reader is for files of other programs."""
    return open_arrays(path) or _labelled(path)


def _labelled(path: Path) -> xarray.Dataset:
    """The path is made absolute: libraries take a leading ~ for the home folder."""
    import xarray

    return xarray.open_dataset(path.absolute(), engine="netcdf4", decode_times=False)


def kind_of(path: Path) -> str:
    """Kind of an artifact as it calls itself; "" where it cannot be told (reading it will say why)."""
    try:
        if seal_broken(path):
            return ""
        with open_artifact(path) as data:
            return str(data.attrs.get("schema_kind", ""))
    except Exception:
        return ""


def _read(
    path: Path, accepted: list[str], partial: bool, opened: Callable[[Path], Any]
) -> tuple[list[Fault], Any | None]:
    """Every fault, or none and the data."""
    file = str(path)
    if not path.is_file():
        return [Fault(file, "", "", "an existing artifact file")], None
    if unfit(path):
        return [Fault(file, "", "", unfit(path))], None
    try:
        if seal_broken(path):
            return [Fault(file, "", "", "the bytes that were written; they are damaged")], None
        with opened(path) as dataset:
            faults = _faults(file, path.stat().st_size, dataset, accepted, partial)
            return faults, None if faults else dataset.load()
    except Exception as error:  # whatever damaged bytes make of HDF5, netCDF and xarray
        return [Fault(file, "", "", f"a whole NetCDF-4 file ({error})")], None


def _faults(
    file: str, size: int, dataset: Arrays | xarray.Dataset, accepted: list[str], partial: bool
) -> list[Fault]:
    from graben.schemas.kinds import LAYOUTS, layout

    kind = str(dataset.attrs.get("schema_kind", "(absent: not an artifact of graben)"))
    if kind not in accepted or kind not in LAYOUTS:
        return [Fault(file, "schema_kind", repr(kind), " or ".join(map(repr, accepted)))]
    # Deflated bytes grow by a factor of 1032 at most: a larger size is damage, and would not fit into memory.
    if dataset.nbytes > 1100 * size + 1_000_000:
        return [Fault(file, "", f"{size} bytes", f"a file that holds its {dataset.nbytes} bytes of data")]
    declared = layout(kind)
    version = dataset.attrs.get("schema_version")
    if not isinstance(version, int | np.integer):
        return [Fault(file, "schema_version", repr(version), "a whole number")]
    if version > declared.version:
        return [Fault(file, "schema_version", str(version), f"at most {declared.version}; update graben")]
    faults = [Fault(file, *found) for found in attribute_faults(dataset.attrs, declared.own_attributes)]
    faults += _variable_faults(file, declared, dataset, partial and PARTIAL in dataset.attrs)
    stored = dataset.attrs.get(DIGEST)
    if not faults and stored is not None and stored != content_digest(dataset.attrs, dataset.variables):
        faults.append(Fault(file, DIGEST, str(stored)[:12], "the digest of what the file holds; it is damaged"))
    return faults


def _variable_faults(file: str, declared: Layout, dataset: Arrays | xarray.Dataset, partial: bool) -> list[Fault]:
    faults = [Fault(file, dim, "0", f"at least one: {declared.dims[dim]}") for dim in declared.filled
              if dataset.sizes.get(dim) == 0]  # fmt: skip
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
        if str(units) != variable.units:
            faults.append(Fault(file, f"{name}.units", repr(units), repr(variable.units)))
        try:
            values = np.asarray(found.values)
        except Exception as error:  # as above, of one variable
            faults.append(Fault(file, name, "", f"readable data ({error}); the file seems damaged"))
            continue
        wanted = "SUO" if variable.dtype in ("S", "U") else "fiub"
        if values.dtype.kind not in wanted:
            faults.append(Fault(file, name, str(values.dtype), "text" if wanted == "SUO" else "numbers"))
            continue
        faults += _value_faults(file, name, variable, values, dict(dataset.sizes), partial)
    return faults


def _value_faults(
    file: str, name: str, variable: Variable, values: np.ndarray, sizes: dict[Any, int], partial: bool
) -> list[Fault]:
    if values.size == 0:
        return []
    if variable.index_of:
        dim, _, none = variable.index_of.partition(" or ")
        least, most = int(none or 0), sizes.get(dim, 0) - 1
        if not (values.min() >= least and values.max() <= most):
            span = f"{values.min()} to {values.max()}"
            return [Fault(file, name, span, f"indices from {least} to {most}")]
    if variable.sum_of and (values.min() < 0 or values.sum() != sizes.get(variable.sum_of, 0)):
        expected = f"a sum of {sizes.get(variable.sum_of, 0)}, the length of dim {variable.sum_of}"
        return [Fault(file, name, f"sum {values.sum()}", expected)]
    if values.dtype.kind != "f" or partial:
        return []
    bad = _absurd(values) & ~(np.isnan(values) & variable.may_be_nan)
    if bad.any():
        found = f"{int(bad.sum())} of {values.size} values nan, infinite or absurdly large"
        return [Fault(file, name, found, f"finite numbers below {_LARGEST:g}")]
    if variable.may_be_nan and np.isnan(values).all() and not (variable.optional or variable.may_be_all_nan):
        return [Fault(file, name, "nan throughout", "at least one number")]
    return []
