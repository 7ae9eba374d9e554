"""A model's state as plain arrays, and back: a run that goes on from one is bitwise the run that never stopped."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import BROKEN, STICK
from graben.mechanics.blocks.contact.sleeping import AWAY, CLOSED, fresh_sleep
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.zones.plastic import ELASTIC, LOST, PlasticZones

_GROUPS = ("motion", "pairs", "skeleton", "skeleton.zones")
_COUNTERS = ("steps_done", "rebuilds")
# Integers of motion and skeleton that stepping changes.
_CHANGING = ("kind", "turn", "due", "flag")


def take(model: BlockModel) -> dict[str, np.ndarray]:
    """Copies of everything that stepping changes, and of constraints and loads, by name."""
    result: dict[str, np.ndarray] = {}
    for group in _GROUPS:
        for name, value in attrgetter(group)(model)._asdict().items():
            if isinstance(value, np.ndarray):
                result[f"{group}.{name}"] = value.copy()
    result["held"] = model.held.copy()
    result["removed"] = model.removed.copy()
    result["flown_at"] = model.flown_at.copy()
    result["excavated"] = np.array(model.excavated)
    result["time"] = np.array(model.time)
    for name in _COUNTERS:
        result[name] = np.array(getattr(model, name))
    return result


def bring_back(model: BlockModel, state: dict[str, np.ndarray]) -> None:
    """Put a state of `take` into a model built from the same scene.

    Raises
    ------
    Refused : it does not fit: lengths, kinds, numbers that are none, indices and flags out of range
    """
    _refuse_unlike(model, state)
    model.pairs = _group(model, state, "pairs")
    _refuse_pairs(model)
    model.held[:] = state["held"]
    model.list_held()
    sleep = fresh_sleep(model.pairs, model.parts, model.motion.node, len(model.joints))
    model.motion = model.motion._replace(**sleep)
    for group in ("motion", "skeleton", "skeleton.zones"):
        found, own = _group(model, state, group), attrgetter(group)(model)
        for name, value in found._asdict().items():
            before = getattr(own, name)
            # What depends on geometry and contacts alone is known already; compiled loops take it on trust.
            known = isinstance(value, np.ndarray) and value.dtype.kind in "iu" and name not in _CHANGING
            if isinstance(value, np.ndarray) and (
                value.shape != before.shape or (known and not np.array_equal(value, before))
            ):
                raise _other(f"{group}.{name} of the same model")
        if group == "skeleton.zones":
            model.skeleton = model.skeleton._replace(zones=found)
        else:
            setattr(model, group, found)
    _within("motion.kind", model.motion.kind, CLOSED, AWAY)
    _within("motion.turn", model.motion.turn, 0, len(model.pairs.key))
    if isinstance(model.skeleton.zones, PlasticZones):
        _within("zones.flag", model.skeleton.zones.flag, ELASTIC, LOST)
    model.motion = model.motion._replace(rows=sleep["rows"])
    model.removed[:] = state["removed"]
    model.flown_at[:] = state["flown_at"]
    model.weight[model.removed[model.bodies.vertex_block]] = 0.0
    model.excavated = float(state["excavated"])
    model.time = float(state["time"])
    for name in _COUNTERS:
        setattr(model, name, int(state[name]))


def _refuse_unlike(model: BlockModel, state: dict[str, np.ndarray]) -> None:
    """Every array there, of the kind and number of dimensions that the model's own has, without nan."""
    for name, own in take(model).items():
        stored = state.get(name)
        if stored is None or stored.dtype != own.dtype or stored.ndim != own.ndim:
            raise _other(f"{name}: {own.ndim} dimensions of {own.dtype}")
        # Only lists of contacts and of constraints change their length.
        if name.partition(".")[0] not in ("pairs", "motion", "skeleton") and stored.shape != own.shape:
            raise _other(f"{name}: shape {own.shape}")
        if stored.dtype.kind == "f" and np.isnan(stored).any():
            raise _other(f"{name}: numbers")


def _group(model: BlockModel, state: dict[str, np.ndarray], group: str) -> Any:
    """A named tuple of the model with the arrays of a state."""
    own = attrgetter(group)(model)
    names = [name for name, value in own._asdict().items() if isinstance(value, np.ndarray)]
    return own._replace(**{name: np.ascontiguousarray(state[f"{group}.{name}"]) for name in names})


def _refuse_pairs(model: BlockModel) -> None:
    p, nodes = model.pairs, len(model.motion.node)
    n = len(p.key)
    for name, value in p._asdict().items():
        shape = (n, 2)[: value.ndim]
        if value.shape != shape and not (name == "seat" and value.shape == (0, 2)):
            raise _other(f"pairs.{name}: shape {shape}")
    _within("pairs.first", p.first, 0, nodes - 1)
    _within("pairs.second", p.second, 0, nodes - 1)
    _within("pairs.joint", p.joint, 0, len(model.joints) - 1)
    _within("pairs.flag", p.flag, STICK, BROKEN)
    for name in ("live", "intact"):
        _within(f"pairs.{name}", getattr(p, name), 0, 1)
    first, second = p.first.astype(np.int64), p.second.astype(np.int64)
    if not np.array_equal(p.key, first * nodes + second) or (np.diff(p.key) <= 0).any():
        raise _other("pairs.key: pairs in their order, each once")


def _other(expected: str) -> Refused:
    return Refused(f"state of another model, or damaged: expected {expected}")


def _within(name: str, values: np.ndarray, least: int, most: int) -> None:
    if values.size and (values.min() < least or values.max() > most):
        raise _other(f"{name}: {least} to {most}")
