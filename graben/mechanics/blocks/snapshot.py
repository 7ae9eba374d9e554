"""A model's state as plain arrays, and back: a run that goes on from one is bitwise the run that never stopped."""

from __future__ import annotations

from operator import attrgetter

import numpy as np

from graben.mechanics.blocks.contact import empty_rows
from graben.mechanics.blocks.model import BlockModel

_GROUPS = ("motion", "pairs", "skeleton", "skeleton.zones")
_COUNTERS = ("steps_done", "rebuilds")


def take(model: BlockModel) -> dict[str, np.ndarray]:
    """Copies of everything that stepping changes, and of constraints and loads, by name."""
    result: dict[str, np.ndarray] = {}
    for group in _GROUPS:
        for name, value in attrgetter(group)(model)._asdict().items():
            if isinstance(value, np.ndarray):
                result[f"{group}.{name}"] = value.copy()
    result["held"] = model.held.copy()
    result["removed"] = model.removed.copy()
    result["excavated"] = np.array(model.excavated)
    result["time"] = np.array(model.time)
    for name in _COUNTERS:
        result[name] = np.array(getattr(model, name))
    return result


def bring_back(model: BlockModel, state: dict[str, np.ndarray]) -> None:
    """Put a state of `take` into a model built from the same scene. ValueError when it does not fit."""
    if len(model.motion.x) != len(state.get("motion.x", ())) or model.held.shape != state["held"].shape:
        raise ValueError("state of another model: number of vertices")
    for group in _GROUPS:
        own = attrgetter(group)(model)
        found = {}
        for name, value in own._asdict().items():
            if not isinstance(value, np.ndarray):
                continue
            stored = state.get(f"{group}.{name}")
            # Only lists of contacts and of constraints change their length.
            if stored is None or stored.dtype != value.dtype or stored.ndim != value.ndim:
                raise ValueError(f"state of another model: {group}.{name}")
            found[name] = np.ascontiguousarray(stored)
        if group == "skeleton.zones":
            model.skeleton = model.skeleton._replace(zones=own._replace(**found))
        else:
            setattr(model, group, own._replace(**found))
    rows = empty_rows(len(model.pairs.key), len(model.pairs.seat) > 0)
    model.motion = model.motion._replace(rows=rows)
    model.held[:] = state["held"]
    model.removed[:] = state["removed"]
    model.weight[model.removed[model.bodies.vertex_block]] = 0.0
    model.excavated = float(state["excavated"])
    model.time = float(state["time"])
    for name in _COUNTERS:
        setattr(model, name, int(state[name]))
