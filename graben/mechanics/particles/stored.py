"""An assembly of spheres as plain arrays, and back: it goes on from them bitwise."""

from __future__ import annotations

from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.particles.assembly import Assembly, ContactForces
from graben.mechanics.particles.records import Drive, Ints, Walls
from graben.mechanics.stored import Arrays, like, listed, named, part_of, within

_BODIES = ("position", "velocity", "spin", "identity")
_DRIVE = tuple(name for name in Drive._fields if name not in ("gravity", "floor", "piston"))
_COUNTS = ("steps", "rebuilds", "_steps_at_rebuild", "_capacity")
_OWN = ("clock", "ledger")


def arrays_of_forces(forces: ContactForces) -> Arrays:
    """By the names of the fields; nothing is copied."""
    return {"pair": forces.pair, "force": forces.force, "arm": forces.arm}


def forces_of(stored: Arrays, bodies: int) -> ContactForces:
    """Of `arrays_of_forces`. Refused where they are none of so many bodies."""
    count = len(np.atleast_1d(stored.get("pair", 0)))
    pair = like(np.zeros((count, 2), np.int64), stored.get("pair"), "pair")
    force, arm = (like(np.zeros((count, 3)), stored.get(name), name) for name in ("force", "arm"))
    return ContactForces(within(pair, "pair", -1, bodies - 1), force, arm)


def arrays_of_assembly(box: Assembly) -> Arrays:
    """Copies of all that steps change, and of what drives them."""
    m, contacts = box.pairs, box.contacts
    listing = {"first": contacts.first, "partner": contacts.partner[:m], "dash": contacts.dash[:m],
               "start": contacts.start}  # fmt: skip
    if contacts.slip is not None:
        listing["slip"] = contacts.slip[:m]
    found = {
        "numbers": [contacts.skin, box.dt, *(getattr(box.drive, name) for name in _DRIVE)],
        "counts": [*(getattr(box, name) for name in _COUNTS), box.drive.piston],
        **{name: getattr(box, name) for name in _OWN},
        **named("bodies", {name: getattr(box.bodies, name) for name in _BODIES}),
        **named("contacts", listing),
        **named("walls", {k: v for k, v in box.walls._asdict().items() if v is not None}),
        **named("loads", {k: v for k, v in box.loads._asdict().items() if v is not None}),
    }
    return {name: np.array(values) for name, values in found.items()}


def bring_back_assembly(box: Assembly, kind: Ints, stored: Arrays) -> None:
    """Put a state of `arrays_of_assembly` into an assembly of the same bodies.

    kind : (n,) of the bodies, in the order in which they were given

    Raises
    ------
    Refused : it does not fit: lengths, kinds, numbers that are none, indices out of range
    """
    n = len(kind)
    numbers = listed(stored.get("numbers"), "numbers", 2 + len(_DRIVE))
    counts = [int(c) for c in listed(stored.get("counts"), "counts", len(_COUNTS) + 1)]
    piston, floor = counts[-1], box.drive.floor
    if not (numbers[0] > 0.0 and numbers[1] > 0.0) or min(counts[:-1]) < 0 or piston not in (-1, floor + 1):
        raise Refused("numbers and counts of an assembly")
    own = part_of(stored, "bodies")
    bodies = {name: like(getattr(box.bodies, name), own.get(name), f"bodies.{name}") for name in _BODIES}
    if not np.array_equal(np.sort(bodies["identity"]), np.arange(n)):
        raise Refused("bodies.identity: each body once")
    if np.abs(bodies["position"]).max() > 1e4 * max(box.width.max(), float(box.bodies.position.max())):
        raise Refused("bodies.position: near the box")
    kind = kind[bodies["identity"]]
    law = box.law
    box.bodies = box.bodies._replace(radius=law.radius[kind], mass=law.mass[kind], kind=kind, **bodies)
    _bring_back_contacts(box, numbers[0], part_of(stored, "contacts"))
    box.walls = _walls(box, floor + 1 + (piston >= 0), part_of(stored, "walls"))
    own = part_of(stored, "loads")
    loads: dict[str, Any] = {
        k: v if v is None else like(v, own.get(k), f"loads.{k}") for k, v in box.loads._asdict().items()
    }
    box.loads = box.loads._replace(**loads)
    box.dt = numbers[1]
    drive: dict[str, Any] = dict(zip(_DRIVE, numbers[2:]))
    box.drive = box.drive._replace(piston=piston, **drive)
    if piston >= 0 and not box.drive.piston_mass > 0.0:
        raise Refused("numbers: the mass of the piston")
    for name, count in zip(_COUNTS, counts):
        setattr(box, name, count)
    for name in _OWN:
        setattr(box, name, like(getattr(box, name), stored.get(name), name))


def _bring_back_contacts(box: Assembly, skin: float, own: Arrays) -> None:
    contacts, n = box.contacts, len(box.bodies.radius)
    first = like(contacts.first, own.get("first"), "contacts.first")
    m = int(first[-1])
    if first[0] != 0 or (np.diff(first) < 0).any() or m != len(np.atleast_1d(own.get("partner", 0))):
        raise Refused("contacts.first: where the rows of contacts.partner begin")
    parts: Arrays = {"partner": np.zeros(m, np.uint32), "dash": np.zeros(m), "start": contacts.start}
    if contacts.slip is not None:
        parts["slip"] = np.zeros((m, 3))
    found: dict[str, Any] = {name: like(part, own.get(name), f"contacts.{name}") for name, part in parts.items()}
    within(found["partner"].astype(np.int64), "contacts.partner", 0, n - 1)
    box.contacts = contacts._replace(first=first, skin=skin, **found)


def _walls(box: Assembly, rows: int, own: Arrays) -> Walls:
    """A table of so many walls."""
    found: dict[str, Any] = {}
    for name, values in box.walls._asdict().items():
        if values is None:
            found[name] = None
            continue
        shape = (len(values), rows, 3) if name == "slip" else (rows, *values.shape[1:])
        found[name] = like(np.zeros(shape, values.dtype), own.get(name), f"walls.{name}")
    within(found["kind"], "walls.kind", 0, box.law.walls.kn.shape[1] - 1)
    return Walls(**found)
