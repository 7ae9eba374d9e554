"""Constitutive laws in Python: a law with its parameters, a point that follows a path, and laws of one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graben.api.units import known
from graben.declared.laws import parameter
from graben.declared.parameter import Parameter
from graben.errors import BadInput, Fault, Refused
from graben.mechanics.materials import point
from graben.mechanics.materials.foreign import make_law
from graben.mechanics.materials.law import Law
from graben.mechanics.materials.laws import LAWS, register
from graben.schemas.quantities import KNOWN
from graben.schemas.scenes.material import (
    material_table,
    parameter_to_si,
    read_material,
    write_material,
)
from graben.stages.shared.material import pack_values

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Material(Mapping[str, Any]):
    """A law with its parameters; stands in a scene's tables as ``material``.

    Attributes
    ----------
    law : name; parameters : values in SI, words and tables
    record : what the law declares: its ``parameters`` with units and bounds, its ``state_names``
    packed : (k,) the parameters as compiled functions read them
    """

    law: str
    parameters: dict[str, Any]
    record: Law = field(repr=False, compare=False)
    packed: NDArray[np.float64] = field(repr=False, compare=False)

    def save(self, path: str | Path, note: str = "") -> None:
        """Write NAME.material.toml, which fem-run and scratch take."""
        write_material(path, self.law, self.parameters, note)

    def _table(self) -> dict[str, Any]:
        return material_table(self.law, self.parameters)

    def __getitem__(self, name: str) -> Any:
        return self._table()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._table())

    def __len__(self) -> int:
        return len(self._table())


def material(law: str | Path, **parameters: Any) -> Material:
    """A law with its parameters, checked.

    Parameters
    ----------
    law : name of a law, see docs/manual/materials.md or `laws`, "module:law" for one of one's own that a module
        defines; or a NAME.material.toml, or calibrate's artifact
    parameters : numbers in SI, or text with a unit ("65 GPa"); words; tables of rows. They replace those of a file

    Raises
    ------
    BadInput : every fault, named by parameter
    """
    values: dict[str, Any] = {}
    name = str(law)
    if name not in LAWS and (isinstance(law, Path) or name.endswith((".toml", ".nc"))):
        name, values = read_material(law)
    known(name, "law")
    faults = []
    for key, value in parameters.items():
        try:
            values[key] = _in_si(name, key, value)
        except (Refused, TypeError, ValueError) as error:
            faults.append(Fault(name, key, repr(value), str(error)))
    if faults:
        raise BadInput(faults)
    record, packed = pack_values(name, values, name, prefix="")
    return Material(name, values, record, packed)


def _in_si(law: str, name: str, value: Any) -> Any:
    """Text with its unit -> a number; numbers and words as they are; tables row by row."""
    p = parameter(law, name)
    word = p is None or p.form == "word"
    if isinstance(value, str):
        return value if word else parameter_to_si(law, name, value)
    if np.ndim(value) == 0:
        return value if word else float(value)
    rows = value.tolist() if hasattr(value, "tolist") else value
    return [[float(x), parameter_to_si(law, "young_modulus", y) if isinstance(y, str) else float(y)] for x, y in rows]


def laws() -> dict[str, Law]:
    """Every law that is known, by name: records with ``title``, ``parameters`` (unit, bounds, default), state."""
    return dict(LAWS)


@dataclass(frozen=True)
class Followed:
    """What a point did along a path, at the steps that it reached.

    Attributes
    ----------
    stress : (steps, n) Pa; strain : (steps, n) with tensor shear; components xx, yy, zz, xy, for n = 6 also yz, zx
    state : (steps,) arrays by name, such as equivalent_plastic_strain and damage
    complete : whether the whole path has a solution
    reached : steps reached, the last one as a fraction
    """

    stress: NDArray[np.float64]
    strain: NDArray[np.float64]
    state: dict[str, NDArray[np.float64]]
    complete: bool
    reached: float


# Control word over xx, yy, zz, xy; component that `strain` prescribes.
_MODES = {
    "plane-strain": ("seee", 1),
    "triaxial": ("sese", 1),
    "plane-stress": ("sese", 1),
    "uniaxial-strain": ("eeee", 1),
    "shear": ("eeee", 3),
}


def follow(
    material: Material,
    strain: ArrayLike | None = None,
    stress: ArrayLike | None = None,
    mode: str = "plane-strain",
    *,
    start: ArrayLike | None = None,
    length: float = 10.0,
    increments: int = 1,
    tolerance: float = 1e-9,
) -> Followed:
    """Drive one material point along a path.

    Parameters
    ----------
    material : of `material`
    strain : (steps,) axial strain yy at each step, for "shear" the tensor shear xy. The first step is where the path
        starts
    stress : lateral stress in Pa, tension positive, a number or (steps,). It is that of xx ("plane-strain",
        "plane-stress") or of xx and zz ("triaxial"); 0 unless given
    mode : one of those; "uniaxial-strain" and "shear" hold all other strains. Or a word of n letters, e for strain
        and s for stress: then strain and stress are (steps, n), and each component follows that of its letter. n is 3
        for plane stress (xx, yy, xy), 4 (xx, yy, zz, xy) or 6 (xx, yy, zz, xy, yz, zx)
    start : (n,) stress at the start, Pa; the lateral stress in xx, yy and zz unless given ("plane-stress": not in zz)
    length : characteristic length in m, for laws with damage; that of `fit` unless given
    increments : between two steps
    tolerance : on prescribed stresses, relative to the largest stress

    Returns
    -------
    the steps that were reached; ``complete`` says whether these are all

    Raises
    ------
    BadInput : arrays that do not fit, or numbers that are not finite
    """
    try:
        word, targets, begin = _path(strain, stress, mode)
        if start is not None:
            begin = np.asarray(start, dtype=np.float64)
        response = point.follow(
            material.law, material.packed, word, targets, length=length, stress=begin, parts=increments,
            tolerance=tolerance,
        )  # fmt: skip
    except (Refused, TypeError) as error:
        raise BadInput(Fault("follow", "", "", str(error), True)) from None
    rows = int(response.reached[0]) + 1
    states = {name: response.state[0, :rows, k] for k, name in enumerate(material.record.state_names)}
    return Followed(
        response.stress[0, :rows], response.strain[0, :rows], states, bool(response.complete[0]),
        float(response.reached[0]),
    )  # fmt: skip


def _path(strain: ArrayLike | None, stress: ArrayLike | None, mode: str) -> tuple[str, NDArray[np.float64], Any]:
    """Control word, targets (steps, n), and the stress at the start."""
    if mode not in _MODES:
        if not mode or set(mode) - {"e", "s"}:
            raise Refused(f"`mode` one of {', '.join(_MODES)}, or a word of the letters e and s, not {mode!r}")
        parts = {"e": strain, "s": stress}
        given = {k: np.asarray(v, dtype=np.float64) for k, v in parts.items() if v is not None}
        shapes = {v.shape for v in given.values()}
        if set(mode) - set(given) or len(shapes) != 1 or any(len(s) != 2 or s[1] != len(mode) for s in shapes):
            raise Refused(f"`strain` and `stress` of shape (steps, {len(mode)}) for the mode {mode!r}")
        return mode, np.stack([given[letter][:, k] for k, letter in enumerate(mode)], axis=1), None
    word, axis = _MODES[mode]
    along = np.asarray(strain, dtype=np.float64)
    if strain is None or along.ndim != 1 or not len(along):
        raise Refused(f"`strain` of shape (steps,) for the mode {mode!r}, not {along.shape}")
    lateral = np.zeros(len(along)) if stress is None else np.asarray(stress, dtype=np.float64)
    if lateral.shape not in ((), along.shape):
        raise Refused(f"`stress` a number or of shape {along.shape}, not {lateral.shape}")
    if stress is not None and "s" not in word:
        raise Refused(f"no `stress` for the mode {mode!r}; see `start`")
    targets = np.zeros((len(along), 4))
    targets[:, axis] = along
    if word[0] == "s":
        targets[:, 0] = lateral
    if mode == "triaxial":
        targets[:, 2] = lateral
    begin = np.zeros(4)
    begin[:2] = targets[0, 0] if word[0] == "s" else 0.0
    begin[2] = 0.0 if mode == "plane-stress" else begin[0]
    return word, targets, begin


def law(
    name: str,
    parameters: Sequence[Parameter],
    state: Sequence[str] | Mapping[str, float] = (),
    *,
    isotropic: bool = True,
    title: str = "",
) -> Callable[[Function], Function]:
    """Make a constitutive law of one's own known in this process, by decorating its function.

    ``material``, ``follow``, ``fit``, ``plane_analysis`` and scenes of kinds "fem" and "calibrate" then take it by
    its name. As "module:name" every process finds it: commands, files of scenes and materials, workers. The
    function is compiled by numba, plain or already decorated with ``numba.njit``::

        function(deps, sig, state, par, length)            # or (..., length, tangent)

    It changes `sig` and `state` in place and returns 0, or a number above 0 where it finds no stress. The step is
    then halved, and neither is changed.

    deps : (n,) increment of strain, shears engineering; n is 4 (xx, yy, zz, xy) or 6 (xx, yy, zz, xy, yz, zx)
    sig : (n,) stress, Pa, tension positive; state : (s,) in the order declared
    par : the parameters by name, in SI: ``par.young_modulus``
    length : characteristic length of the element, m
    tangent : (n, n) d sig / d deps of this increment, to be filled where its size is not 0. Without this argument the
        tangent is found by differences, at 2 n further calls of the function

    Parameters
    ----------
    name : one without a colon that no law of the package has; an earlier law of one's own is replaced
    parameters : ``Parameter(name, unit, lower, upper, default)``, numbers with SI units that scenes know
    state : names, or initial values by name. ``equivalent_plastic_strain`` and ``damage`` are drawn by fem-run
    isotropic : whether the law knows no direction
    title : one line that says what it is; the first line of the function's docstring unless given

    Raises
    ------
    BadInput : the name is taken, a parameter is no number, or the function cannot be compiled
    """

    def decorate(function: Function) -> Function:
        initial = dict(state) if isinstance(state, Mapping) else dict.fromkeys(state, 0.0)
        words = title or (getattr(function, "__doc__", None) or name).strip().splitlines()[0]
        try:
            for p in parameters:
                if p.unit not in ("1", *KNOWN):
                    raise Refused(f"{p.name} in one of the units 1, {', '.join(KNOWN)}, not {p.unit!r}")
            if ":" in name:
                raise Refused("a name without a colon")
            register(make_law(name, function, tuple(parameters), initial, isotropic, words), function.__module__)
        except Refused as error:
            raise BadInput(Fault("law", name, "", str(error), True)) from error
        return function

    return decorate
