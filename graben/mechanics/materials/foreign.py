"""Laws from outside the package: compiled functions that every kernel calls by their address.

The id of such a law is the place in memory of two addresses, those of a guard and of the law's entry; it is negative
where the law knows directions. So kernels need no compilation for a law, and cost nothing more where none is used.
The guard hands on copies: what fails, or leaves numbers that are not finite, changes nothing. Where the law's
function gives no tangent, the guard takes central differences of the increment.
"""

from __future__ import annotations

import inspect
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.errors import NumbaError
from numba.extending import intrinsic
from numba.np import arrayobj
from numba.np.unsafe.ndarray import to_fixed_tuple

from graben.declared.parameter import Parameter
from graben.errors import Refused
from graben.mechanics.compiled import c_kernel
from graben.mechanics.materials.law import NOT_CONVERGED, NOT_FINITE, OK, Law

FIRST = 1 << 8
"""Ids of this size and more, either sign, are such places."""

_ARRAYS = (1, 2, 3, 4, 6)  # among the arguments of an update, after the law
_DOUBLES = "CPointer(float64)"
_OF_LAW = f"int64({', '.join([_DOUBLES] * 4)}, float64, {_DOUBLES}, int64, int64)"
_GUARD = f"int64(CPointer(int64), {', '.join([_DOUBLES] * 4)}, float64, {_DOUBLES}, int64, int64, int64, int64)"
_SHARE, _SMALLEST = 1e-6, 1e-9  # steps of the differences: of the largest strain increment, and at least
_WITH_TANGENT, _WITHOUT_TANGENT, _FAILED = 1, 2, 3  # answers of a law's entry; 0 where it raised an exception
_USUAL = ("equivalent_plastic_strain", "damage")
_kept: list[Any] = []  # bodies and fits hold addresses: what lies there lives as long as the process


@intrinsic
def update_foreign(typing_context, place, deps, sig, state, par, length, tangent):
    """A law from outside; arguments and return code as in `laws.update`, place: the size of its id.

    All that kernels compile is this call of the guard, whose address is the first of the two at that place.
    """
    contiguous = all(a.layout == "C" for a in (deps, sig, state, par, tangent))

    def generate(context, builder, signature, arguments):
        if not contiguous:
            return ir.IntType(64)(NOT_CONVERGED)
        table = context.cast(builder, arguments[0], signature.args[0], types.int64)
        table = builder.inttoptr(table, ir.IntType(64).as_pointer())
        given, rows = _flat(context, builder, signature, arguments)
        sizes = [rows[1], rows[3], rows[4], rows[6]]
        return _called(builder, builder.load(table), [table, *given, *sizes])

    return types.int64(place, deps, sig, state, par, length, tangent), generate


@intrinsic
def _call(typing_context, address, deps, sig, state, par, length, tangent):
    """The answer of a law's own entry."""

    def generate(context, builder, signature, arguments):
        given, rows = _flat(context, builder, signature, arguments)
        return _called(builder, arguments[0], [*given, rows[1], rows[6]])

    return types.int64(types.int64, deps, sig, state, par, length, tangent), generate


def _flat(context, builder, signature, arguments):
    """Where the arrays begin and the length, in their order, and how many rows each array has."""
    arrays = {k: arrayobj.make_array(signature.args[k])(context, builder, arguments[k]) for k in _ARRAYS}
    length = context.cast(builder, arguments[5], signature.args[5], types.float64)
    given = [*(arrays[k].data for k in (1, 2, 3, 4)), length, arrays[6].data]
    return given, {k: builder.extract_value(arrays[k].shape, 0) for k in _ARRAYS}


def _called(builder, address, arguments):
    kind = ir.FunctionType(ir.IntType(64), [a.type for a in arguments])
    return builder.call(builder.inttoptr(address, kind.as_pointer()), arguments)


@cache
def _guard() -> Any:
    """The C function between kernels and laws: it hands on copies, checks, and takes what the law made of them."""

    def guard(table_at, deps_at, sig_at, state_at, par_at, length, tangent_at, n, states, count, wanted):
        address = numba.carray(table_at, (2,))[1]
        deps, sig, state = (
            numba.carray(deps_at, (n,)), numba.carray(sig_at, (n,)), numba.carray(state_at, (states,)),
        )  # fmt: skip
        par = numba.carray(par_at, (count,))
        moved, s, q, slopes = np.empty(n), np.empty(n), np.empty(states), np.zeros((wanted, wanted))
        for i in range(n):
            moved[i], s[i] = deps[i], sig[i]
        for k in range(states):
            q[k] = state[k]
        answer = _call(address, moved, s, q, par, length, slopes)
        if answer <= 0 or answer > _WITHOUT_TANGENT:
            return NOT_CONVERGED
        total, largest = 0.0, 0.0
        for i in range(n):
            total += abs(s[i])
            largest = max(largest, abs(deps[i]))
        for k in range(states):
            total += abs(q[k])
        if wanted > 0 and answer == _WITHOUT_TANGENT:
            step = max(_SHARE * largest, _SMALLEST)
            trial, kept, none = np.empty(n), np.empty(states), np.empty((0, 0))
            for j in range(n):
                for side in (-1.0, 1.0):
                    for i in range(n):
                        moved[i], trial[i] = deps[i], sig[i]
                    for k in range(states):
                        kept[k] = state[k]
                    moved[j] += side * step
                    answer = _call(address, moved, trial, kept, par, length, none)
                    if answer <= 0 or answer > _WITHOUT_TANGENT:
                        return NOT_CONVERGED
                    for i in range(n):
                        slopes[i, j] = (trial[i] - slopes[i, j]) / (2.0 * step) if side > 0.0 else trial[i]
        for i in range(wanted):
            for j in range(wanted):
                total += abs(slopes[i, j])
        if not total < np.inf:
            return NOT_FINITE
        for i in range(n):
            sig[i] = s[i]
        for k in range(states):
            state[k] = q[k]
        tangent = numba.carray(tangent_at, (wanted, wanted))
        for i in range(wanted):
            for j in range(wanted):
                tangent[i, j] = slopes[i, j]
        return OK

    return c_kernel(_GUARD, guard, error_model="numpy")


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
        if p.form != "number" or p.when or not p.name.isidentifier():
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
    table = np.array([_guard().address, entry.address], dtype=np.int64)
    _kept.extend((entry, table))
    return Law(
        id=table.ctypes.data if isotropic else -table.ctypes.data,
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

        @numba.cfunc(_OF_LAW, error_model="numpy")
        def entry(deps_at, sig_at, state_at, par_at, length, tangent_at, n, wanted):
            every, state, par = ready(n, state_at, par_at)
            deps, sig = numba.carray(deps_at, (n,)), numba.carray(sig_at, (n,))
            code = function(deps, sig, state, par, length, numba.carray(tangent_at, (wanted, wanted)))
            for k in range(states):
                every[own[k]] = state[k]
            return _WITH_TANGENT if code == OK else _FAILED

    else:

        @numba.cfunc(_OF_LAW, error_model="numpy")
        def entry(deps_at, sig_at, state_at, par_at, length, tangent_at, n, wanted):
            every, state, par = ready(n, state_at, par_at)
            code = function(numba.carray(deps_at, (n,)), numba.carray(sig_at, (n,)), state, par, length)
            for k in range(states):
                every[own[k]] = state[k]
            return _WITHOUT_TANGENT if code == OK else _FAILED

    return entry
