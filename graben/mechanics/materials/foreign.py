"""Laws from outside the package: compiled functions that every kernel calls by their address.

The id of such a law is the address of its entry, negative where the law knows directions. So kernels need no
compilation for it, and cost nothing more where none is used. A law gets copies: what fails, or leaves numbers that
are not finite, changes nothing. Where its function gives no tangent, central differences of the increment do.
"""

from __future__ import annotations

import inspect
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.errors import NumbaError
from numba.extending import intrinsic
from numba.np import arrayobj
from numba.np.unsafe.ndarray import to_fixed_tuple

from graben.errors import Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.law import NOT_CONVERGED, NOT_FINITE, OK, Law, Parameter

FIRST = 1 << 8
"""Ids of this size and more, either sign, are addresses."""

_ENTRY = "int64(CPointer(float64), CPointer(float64), CPointer(float64), CPointer(float64), float64, " \
    "CPointer(float64), int64, int64)"  # fmt: skip
_SHARE, _SMALLEST = 1e-6, 1e-9  # steps of the differences: of the largest strain increment, and at least
_WITH_TANGENT, _WITHOUT_TANGENT, _FAILED = 1, 2, 3  # answers of an entry; 0 where it raised an exception
_USUAL = ("equivalent_plastic_strain", "damage")
_entries: list[Any] = []  # bodies and fits hold addresses: an entry lives as long as the process


@intrinsic
def _call(typing_context, address, deps, sig, state, par, length, tangent):
    """The answer of the entry at an address; 0 where arrays are not contiguous."""
    contiguous = all(a.layout == "C" for a in (deps, sig, state, par, tangent))

    def generate(context, builder, signature, arguments):
        i64, f64 = ir.IntType(64), ir.DoubleType()
        if not contiguous:
            return i64(0)
        arrays = {k: arrayobj.make_array(signature.args[k])(context, builder, arguments[k]) for k in (1, 2, 3, 4, 6)}
        place = context.cast(builder, arguments[0], signature.args[0], types.int64)
        size = context.cast(builder, arguments[5], signature.args[5], types.float64)
        rows = [builder.extract_value(arrays[k].shape, 0) for k in (1, 6)]
        kind = ir.FunctionType(i64, [f64.as_pointer()] * 4 + [f64, f64.as_pointer(), i64, i64])
        entry = builder.inttoptr(place, kind.as_pointer())
        return builder.call(entry, [*(arrays[k].data for k in (1, 2, 3, 4)), size, arrays[6].data, *rows])

    return types.int64(address, deps, sig, state, par, length, tangent), generate


@kernel(error_model="numpy")
def update_foreign(law_id, deps, sig, state, par, length, tangent):
    """A law from outside; arguments and return code as in `laws.update`."""
    address, n = abs(law_id), deps.shape[0]
    moved, s, q, slopes = deps.copy(), sig.copy(), state.copy(), np.zeros(tangent.shape)
    answer = _call(address, moved, s, q, par, length, slopes)
    if answer <= 0 or answer > _WITHOUT_TANGENT:
        return NOT_CONVERGED
    total = 0.0
    for i in range(n):
        total += abs(s[i])
    for k in range(q.shape[0]):
        total += abs(q[k])
    if tangent.shape[0] > 0:
        if answer == _WITHOUT_TANGENT:
            code = _differences(address, deps, sig, state, par, length, slopes)
            if code != OK:
                return code
        for i in range(n):
            for j in range(n):
                total += abs(slopes[i, j])
    if not total < np.inf:
        return NOT_FINITE
    sig[:], state[:] = s, q
    if tangent.shape[0] > 0:
        tangent[:, :] = slopes
    return OK


@kernel(error_model="numpy")
def _differences(address, deps, sig, state, par, length, slopes):
    """slopes (n, n) = d sig / d deps, by central differences."""
    n = deps.shape[0]
    largest = 0.0
    for j in range(n):
        largest = max(largest, abs(deps[j]))
    step = max(_SHARE * largest, _SMALLEST)
    moved, s, q, none = np.empty(n), np.empty(n), np.empty(state.shape[0]), np.empty((0, 0))
    for j in range(n):
        for side in (-1.0, 1.0):
            moved[:], s[:], q[:] = deps, sig, state
            moved[j] += side * step
            answer = _call(address, moved, s, q, par, length, none)
            if answer <= 0 or answer > _WITHOUT_TANGENT:
                return NOT_CONVERGED
            for i in range(n):
                slopes[i, j] = (s[i] - slopes[i, j]) / (2.0 * step) if side > 0.0 else s[i]
    return OK


def make_law(
    name: str,
    function: Callable[..., Any],
    parameters: Sequence[Parameter],
    state: Mapping[str, float],
    isotropic: bool,
    title: str,
) -> Law:
    """The record of a law from outside, with its entry compiled.

    Parameters
    ----------
    function : (deps (n,), sig (n,), state (s,), par, length[, tangent (n, n)]) -> 0, or a code above 0; compiled or
        to be compiled. par has the parameters by name; sig, state and tangent are changed in place
    parameters : numbers only
    state : initial values by name, in the order in which the function has them

    Raises
    ------
    Refused : parameters of another kind, a function of other arguments, or one that cannot be compiled
    """
    if not parameters:
        raise Refused("at least one parameter")
    for p in parameters:
        if p.choices or p.table or p.when or not p.name.isidentifier():
            raise Refused(f"parameters that are numbers with names as in Python, not {p.name!r}")
    plain = getattr(function, "py_func", function)
    count = len(inspect.signature(plain).parameters)
    if count not in (5, 6):
        raise Refused(f"a function of deps, sig, state, par, length and perhaps tangent, not of {count} arguments")
    compiled = function if hasattr(function, "py_func") else numba.njit(error_model="numpy")(function)
    others = [s for s in state if s not in _USUAL]
    slots = (*_USUAL, *others)
    start = np.array([state.get(s, 0.0) for s in slots], dtype=np.float64)
    own = np.array([slots.index(s) for s in state], dtype=np.int64)
    try:
        entry = _entry(compiled, [p.name for p in parameters], own, len(slots), count == 6)
    except NumbaError as error:
        raise Refused(f"a function that can be compiled ({error})") from error
    _entries.append(entry)
    return Law(
        id=entry.address if isotropic else -entry.address,
        name=name,
        title=title,
        parameters=tuple(parameters),
        state_names=slots,
        initial_state=lambda par: start.copy(),
    )


def _entry(function: Any, names: Sequence[str], own: np.ndarray, slots: int, gives_tangent: bool) -> Any:
    """The C function that kernels call; it changes what it is given.

    It picks the law's own states among the slots, and names the parameters.
    """
    par_type = namedtuple("par", names)  # type: ignore[misc]
    count, states = len(names), len(own)

    @numba.njit(error_model="numpy")
    def ready(n, state_at, par_at):
        every, state = numba.carray(state_at, (slots,)), np.empty(states)
        for k in range(states):
            state[k] = every[own[k]]
        return every, state, par_type(*to_fixed_tuple(numba.carray(par_at, (count,)), count))

    if gives_tangent:

        @numba.cfunc(_ENTRY, error_model="numpy")
        def entry(deps_at, sig_at, state_at, par_at, length, tangent_at, n, wanted):
            every, state, par = ready(n, state_at, par_at)
            deps, sig = numba.carray(deps_at, (n,)), numba.carray(sig_at, (n,))
            code = function(deps, sig, state, par, length, numba.carray(tangent_at, (wanted, wanted)))
            for k in range(states):
                every[own[k]] = state[k]
            return _WITH_TANGENT if code == OK else _FAILED

    else:

        @numba.cfunc(_ENTRY, error_model="numpy")
        def entry(deps_at, sig_at, state_at, par_at, length, tangent_at, n, wanted):
            every, state, par = ready(n, state_at, par_at)
            code = function(numba.carray(deps_at, (n,)), numba.carray(sig_at, (n,)), state, par, length)
            for k in range(states):
                every[own[k]] = state[k]
            return _WITHOUT_TANGENT if code == OK else _FAILED

    return entry
