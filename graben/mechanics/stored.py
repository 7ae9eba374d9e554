"""What a state that was stored must be like before a run goes on from it: kernels take indices on trust."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.errors import Refused

Arrays = dict[str, np.ndarray]


def named(prefix: str, arrays: Mapping[str, Any]) -> Arrays:
    """The arrays under names that begin with a prefix and a dot."""
    return {f"{prefix}.{name}": np.asarray(values) for name, values in arrays.items()}


def part_of(arrays: Arrays, prefix: str) -> Arrays:
    """What `named` made of a prefix, under its own names."""
    return {name[len(prefix) + 1 :]: values for name, values in arrays.items() if name.startswith(prefix + ".")}


def listed(values: np.ndarray | None, name: str, count: int | None = None) -> list[float]:
    """A list of finite numbers; Refused where there is none, or another count of them."""
    right = values is not None and values.ndim == 1 and values.dtype.kind in "fi"
    if values is None or not right or (count is not None and len(values) != count) or not np.isfinite(values).all():
        raise Refused(f"{name}: {'' if count is None else f'{count} '}finite numbers")
    found: list[float] = values.tolist()
    return found


def like(own: np.ndarray, found: np.ndarray | None, name: str, *, rows: bool = False) -> np.ndarray:
    """An array of the kind and shape of another, of finite numbers; Refused where it is none.

    rows : their number may be another
    """
    if found is None or found.dtype != own.dtype or found.ndim != own.ndim:
        raise Refused(f"{name}: {own.ndim} dimensions of {own.dtype}")
    if found.shape[rows:] != own.shape[rows:]:
        raise Refused(f"{name}: shape {own.shape}")
    if found.dtype.kind == "f" and not np.isfinite(found).all():
        raise Refused(f"{name}: finite numbers")
    return np.ascontiguousarray(found)


def within(found: np.ndarray, name: str, least: int, most: int) -> np.ndarray:
    """Integers in a range, which compiled loops take on trust; Refused where they are not."""
    if found.dtype.kind != "i" or (found.size and (found.min() < least or found.max() > most)):
        raise Refused(f"{name}: {least} to {most}")
    return found
