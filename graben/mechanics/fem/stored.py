"""A march as plain arrays, and back: it goes on from them bitwise."""

from __future__ import annotations

from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.fem.body import Body, State
from graben.mechanics.fem.march import March
from graben.mechanics.stored import Arrays, like, listed, named, part_of

_FIELDS = ("displacement", "stress", "internal")
_NUMBERS = ("time", "begin", "length", "last_length", "external_work", "internal_work", "drag_work")
_COUNTS = ("rejected", "factorisations")
_FLAGS = ("complete", "ended")


def arrays_of_state(state: State) -> Arrays:
    """By the names of its fields; nothing is copied, for no step changes them."""
    return {name: getattr(state, name) for name in _FIELDS}


def state_of(stored: Arrays, body: Body) -> State:
    """Of `arrays_of_state`. Refused where it is none of this body."""
    own = body.untouched()
    return State(*(like(getattr(own, name), stored.get(name), name) for name in _FIELDS))


def arrays_of_march(run: March) -> Arrays:
    """All of a march."""
    residuals = [np.array(row) for row in run.residuals]
    stored: dict[str, Any] = {
        "numbers": [getattr(run, name) for name in _NUMBERS],
        "counts": [getattr(run, name) for name in (*_COUNTS, *_FLAGS)],
        "reason": run.reason,
        "force": run.force,
        "drag": run.drag,
        "residual_count": np.array([len(row) for row in residuals], dtype=np.int64),
        "residual": np.concatenate([np.zeros(0), *residuals]),
    }
    before = {} if run.before is None else named("before", arrays_of_state(run.before))
    return {k: np.asarray(v) for k, v in stored.items()} | named("state", arrays_of_state(run.state)) | before


def march_of(stored: Arrays, body: Body, end: float) -> March:
    """Of `arrays_of_march`. Refused where it is none of this body, from time 0 towards an end, s."""
    numbers = dict(zip(_NUMBERS, listed(stored.get("numbers"), "numbers", len(_NUMBERS))))
    counts = [int(n) for n in listed(stored.get("counts"), "counts", len(_COUNTS) + len(_FLAGS))]
    sizes = [int(n) for n in listed(stored.get("residual_count"), "residual_count")]
    if min(counts) < 0 or min(sizes, default=1) < 1 or min(numbers["length"], numbers["last_length"]) < 0.0:
        raise Refused("counts and lengths of steps that are not negative")
    residuals = np.array(listed(stored.get("residual"), "residual", sum(sizes)))
    if not numbers["begin"] == 0.0 <= numbers["time"] <= end or (numbers["time"] > 0.0) != bool(sizes):
        raise Refused(f"numbers: a time from 0 to {end:g} s")
    reason, before = stored.get("reason"), part_of(stored, "before")
    if reason is None or reason.dtype.kind != "U" or reason.ndim:
        raise Refused("reason: a text")
    if bool(before) != bool(sizes) or bool(sizes) != (numbers["last_length"] > 0.0):
        raise Refused("before: the state before the last step, where there was one")
    nothing = np.zeros(body.pattern.size)
    flags = map(bool, counts[len(_COUNTS) :])
    others: dict[str, Any] = {**numbers, **dict(zip(_COUNTS, counts)), **dict(zip(_FLAGS, flags))}
    return March(
        state=state_of(part_of(stored, "state"), body),
        force=like(nothing, stored.get("force"), "force"),
        drag=like(nothing, stored.get("drag"), "drag"),
        before=state_of(before, body) if before else None,
        reason=str(reason),
        iterations=[n - 1 for n in sizes],
        residuals=[tuple(row.tolist()) for row in np.split(residuals, np.cumsum(sizes)[:-1])] if sizes else [],
        **others,
    )
