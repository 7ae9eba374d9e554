"""Finished beds as arrays, and back."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.particles.assembly import Survey
from graben.mechanics.particles.bed import HISTORY, Bed
from graben.mechanics.particles.stored import arrays_of_forces, forces_of
from graben.mechanics.stored import Arrays, like, listed, named, part_of, within

_INTEGER, _REAL = np.int64, np.float64
# Arrays over grains: type and further dimensions.
_GRAINS = {
    "radius": (_REAL, ()), "kind": (_INTEGER, ()), "position": (_REAL, (3,)), "velocity": (_REAL, (3,)),
    "floor_force": (_REAL, ()), "coordination": (_INTEGER, ()),
}  # fmt: skip
_CONTACTS = {"pair": (_INTEGER, (2,)), "normal": (_REAL, (3,)), "push": (_REAL, ())}
_NUMBERS = (
    "area", "piston_height", "solid_fraction", "floor_share_of_weight", "wall_share_of_weight", "energy_error",
    "time_step", "step_over_critical",
)  # fmt: skip
_SURVEY = [f.name for f in fields(Survey)]


def arrays_of_bed(bed: Bed) -> Arrays:
    """All of a finished bed; nothing is copied, for nothing changes it."""
    found = {name: getattr(bed, name) for name in (*_GRAINS, *_CONTACTS, "history")}
    found["numbers"] = np.array([getattr(bed, name) for name in _NUMBERS])
    found["counts"] = np.array([bed.steps, bed.rebuilds])
    found["survey"] = np.array([getattr(bed.survey, name) for name in _SURVEY], dtype=float)
    found["times"] = np.array(list(bed.state_times.values()))
    found["names"] = np.array(list(bed.states))
    for name, position in bed.states.items():
        found |= named(f"state.{name}", {"position": position, **arrays_of_forces(bed.state_forces[name])})
    return found


def bed_of(stored: Arrays, classes: int, names: list[str]) -> Bed:
    """Of `arrays_of_bed`. Refused where it is none of so many classes of grains, with states of these names."""
    n = len(np.atleast_1d(stored.get("radius", 0)))
    arrays: dict[str, Any] = {
        k: like(np.zeros((n, *more), kind), stored.get(k), k) for k, (kind, more) in _GRAINS.items()
    }
    m = len(np.atleast_1d(stored.get("push", 0)))
    arrays |= {k: like(np.zeros((m, *more), kind), stored.get(k), k) for k, (kind, more) in _CONTACTS.items()}
    within(arrays["kind"], "kind", 0, classes - 1)
    within(arrays["pair"], "pair", 0, n - 1)
    arrays["history"] = like(np.zeros((0, len(HISTORY))), stored.get("history"), "history", rows=True)
    found = dict(zip(_SURVEY, listed(stored.get("survey"), "survey", len(_SURVEY))))
    counts = [int(c) for c in listed(stored.get("counts"), "counts", 2)]
    numbers: dict[str, Any] = dict(zip(_NUMBERS, listed(stored.get("numbers"), "numbers", len(_NUMBERS))))
    times = listed(stored.get("times"), "times", len(names))
    if np.atleast_1d(stored.get("names", "")).tolist() != names:
        raise Refused(f"names: {', '.join(names)}")
    states = {name: part_of(stored, f"state.{name}") for name in names}
    place = arrays["position"]
    return Bed(
        **arrays,
        survey=Survey(**{**found, "contacts": int(found["contacts"])}),  # type: ignore[arg-type]
        states={name: like(place, own.get("position"), f"state.{name}") for name, own in states.items()},
        state_times=dict(zip(names, times)),
        state_forces={name: forces_of(own, n) for name, own in states.items()},
        steps=counts[0],
        rebuilds=counts[1],
        **numbers,
    )
