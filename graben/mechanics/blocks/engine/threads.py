"""Threads that run one compiled loop side by side and meet at its barriers: none is started or woken in a step."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

from graben.mechanics.blocks.shape.partition import Parts
from graben.mechanics.cache_lines import aligned
from graben.mechanics.compiled import kernel

# Looks at a barrier before the core is offered to others: some ten microseconds.
_PATIENCE = 4000

_give_way = types.ExternalFunction("SwitchToThread" if os.name == "nt" else "sched_yield", types.int32())


class Plan(NamedTuple):
    """Who works on what: parts of thread k are first[k] to first[k + 1]; flags (parts,) of those that push on a
    part of another thread, and of those pushed by one.
    """

    first: np.ndarray
    pushes: np.ndarray
    pushed: np.ndarray


def share_out(parts: Parts, far_start: np.ndarray, post_start: np.ndarray, post: np.ndarray, threads: int) -> Plan:
    """Runs of neighbouring parts for each thread; the rest as in relaxation.Motion."""
    count = len(parts.node) - 1
    first = np.arange(threads + 1) * count // threads
    who = np.searchsorted(first, np.arange(count), side="right") - 1
    pushes, pushed = np.zeros(count, dtype=np.int8), np.zeros(count, dtype=np.int8)
    origin = np.repeat(np.arange(count), np.diff(far_start))[post[:, 0]]
    target = np.repeat(np.arange(count), np.diff(post_start))
    across = who[origin] != who[target]
    pushes[origin[across]] = 1
    pushed[target[across]] = 1
    return Plan(first, pushes, pushed)


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    parts = arrayobj.make_array(kind)(context, builder, array)
    zero = context.get_constant(types.intp, 0)
    place = cgutils.get_item_pointer(context, builder, kind, parts, [index, zero])
    return builder.bitcast(place, ir.IntType(64).as_pointer())


@intrinsic
def _read(typing_context, array, row):
    """First entry of a row of an array, after all that was written before it was `_told`."""

    def generate(context, builder, signature, arguments):
        index = context.cast(builder, arguments[1], signature.args[1], types.intp)
        place = _place(context, builder, signature.args[0], arguments[0], index)
        return builder.load_atomic(place, "acquire", 8, typ=ir.IntType(64))

    return types.int64(array, row), generate


@intrinsic
def _tell(typing_context, array, row, value):
    """Write the first entry of a row, for others to `_read`."""

    def generate(context, builder, signature, arguments):
        index = context.cast(builder, arguments[1], signature.args[1], types.intp)
        place = _place(context, builder, signature.args[0], arguments[0], index)
        number = context.cast(builder, arguments[2], signature.args[2], types.int64)
        builder.store_atomic(number, place, "release", 8)
        return context.get_dummy_value()

    return types.void(array, row, value), generate


@kernel(error_model="numpy")
def arrive(board, me, turn):
    """Tell the others that thread `me` got to barrier number `turn`."""
    _tell(board, me, turn)


@kernel(error_model="numpy", nogil=True)
def all_there(board, turn):
    """Wait until all threads got to barrier number `turn`; False when one of them left before."""
    last = board.shape[0] - 1
    for k in range(last):
        looks = 0
        while _read(board, k) < turn:
            if _read(board, last) != 0:
                return False
            looks += 1
            if looks > _PATIENCE:
                _give_way()
    return True


def run_together(work: Callable[..., Any], arguments: Sequence[tuple]) -> Any:
    """work(k, board, *arguments[k]) for each k in a thread of its own; returns what the first one returns.

    `work` must release the interpreter and pass the same barriers in each thread. Whoever leaves, for whatever
    reason, frees those who wait.
    """
    threads = len(arguments)
    # One cache line a thread; the last row is the sign that somebody left.
    board = aligned(threads + 1, 8).view(np.int64)

    def run(k: int) -> Any:
        try:
            return work(k, board, *arguments[k])
        finally:
            board[threads, 0] = 1

    if threads == 1:
        return run(0)
    with ThreadPoolExecutor(threads - 1) as pool:
        others = [pool.submit(run, k) for k in range(1, threads)]
        try:
            result = run(0)
        finally:
            board[threads, 0] = 1
        for other in others:
            other.result()
    return result
