"""Contact laws: what a law is, which there are, and how the loops over contacts find theirs.

A law is a table, a NamedTuple of arrays over two classes (body and body, or body and wall), and five functions of it.
The type of the table picks the functions when numba compiles a loop. A run pays for no law but its own.

A new law is a NamedTuple, its functions, and a row of `LAWS`. It must stand in mechanics: the disk cache of compiled
kernels notices edits of sources there only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class LinearTable(NamedTuple):
    """Springs, dashpots and Coulomb friction, H (4.5)-(4.12): (a, b) by the classes of both sides."""

    kn: Floats  # N/m
    cn: Floats  # N s/m
    kt: Floats  # N/m
    ct: Floats  # N s/m
    friction: Floats


class LawTables(NamedTuple):
    """The laws of one run, each a table of a type in `LAWS`."""

    pairs: Any  # (c, c) by the classes of two bodies
    walls: Any  # (c, k) by the classes of body and wall


class Functions(NamedTuple):
    """A law by its functions; the arguments begin with its table and the classes of both sides."""

    normal: Callable[..., Any]
    shear: Callable[..., Any]
    stiffness: Callable[..., Any]
    normal_energy: Callable[..., Any]
    shear_energy: Callable[..., Any]


def _linear_normal(law, a, b, overlap, opening):
    spring = law.kn[a, b] * overlap
    total = spring - law.cn[a, b] * opening
    if total < 0.0:  # spring and dashpot together never pull
        total = 0.0
    return spring, total


def _linear_shear(law, a, b, overlap, total):
    return law.kt[a, b], law.ct[a, b], law.friction[a, b] * total


def _linear_stiffness(law, a, b, overlap):
    return law.kn[a, b]


def _linear_normal_energy(law, a, b, overlap):
    return 0.5 * law.kn[a, b] * overlap * overlap


def _linear_shear_energy(law, a, b, overlap, slip2):
    return 0.5 * slip2 / law.kt[a, b]


LAWS: dict[type, Functions] = {
    LinearTable: Functions(
        _linear_normal, _linear_shear, _linear_stiffness, _linear_normal_energy, _linear_shear_energy
    ),
}


def _picked_by_table(function: Callable[..., Any]) -> Callable[..., Any]:
    """Tell numba to compile, in place of a function below, the one that `LAWS` holds for the type of the table."""

    def pick(law: Any, *arguments: Any) -> Callable[..., Any] | None:
        functions = LAWS.get(getattr(law, "instance_class", None))  # type: ignore[arg-type]
        return None if functions is None else getattr(functions, function.__name__)

    overload(function, jit_options={"error_model": "numpy"}, strict=False)(pick)
    return function


@_picked_by_table
def normal(law, a, b, overlap, opening):
    """Spring and total normal force, N, both positive when they push; opening: m/s, positive when bodies part."""
    return LAWS[type(law)].normal(law, a, b, overlap, opening)


@_picked_by_table
def shear(law, a, b, overlap, total):
    """Tangential stiffness N/m, dashpot N s/m and the largest force, N, under the total normal force."""
    return LAWS[type(law)].shear(law, a, b, overlap, total)


@_picked_by_table
def stiffness(law, a, b, overlap):
    """Derivative of the normal spring, N/m."""
    return LAWS[type(law)].stiffness(law, a, b, overlap)


@_picked_by_table
def normal_energy(law, a, b, overlap):
    """Energy in the normal spring, J."""
    return LAWS[type(law)].normal_energy(law, a, b, overlap)


@_picked_by_table
def shear_energy(law, a, b, overlap, slip2):
    """Energy in the tangential spring, J, from its squared force; overlap is negative in a contact that opened."""
    return LAWS[type(law)].shear_energy(law, a, b, overlap, slip2)
