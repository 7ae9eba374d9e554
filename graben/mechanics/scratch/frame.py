"""The state of the body at one time, and stress turned from the corotated frame into space."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.scratch.mesh import Floats, Ints
from graben.mechanics.stored import Arrays, like, within


@dataclass
class Snapshot:
    """State of the body at one time: positions (n, 3), stress (e, 6) in space, p (e,), damage (e,), living (e,),
    volumes (e,) [m3], exposed faces (f, 4), and the held faces (g, 4) that removal bared."""

    name: str
    time: float
    tip: Floats
    points: Floats
    stress: Floats
    plastic_strain: Floats
    damage: Floats
    alive: Ints
    volumes: Floats
    faces: Ints
    supports: Ints


_NOTHING = np.array(0)
_ARRAYS = [f.name for f in fields(Snapshot) if f.name not in ("name", "time")]


def arrays_of_snapshot(snapshot: Snapshot) -> Arrays:
    """By the names of its fields; nothing is copied."""
    return {f.name: np.asarray(getattr(snapshot, f.name)) for f in fields(Snapshot)}


def snapshot_of(stored: Arrays, own: Snapshot) -> Snapshot:
    """Of `arrays_of_snapshot`; own: a snapshot of the same body. Refused where it is none."""
    parts = {
        name: like(getattr(own, name), stored.get(name), name, rows=name in ("faces", "supports")) for name in _ARRAYS
    }
    within(parts["alive"], "alive", 0, 1)
    for name in ("faces", "supports"):
        within(parts[name], name, 0, len(own.points) - 1)
    title, time = stored.get("name", _NOTHING), stored.get("time", _NOTHING)
    if title.dtype.kind != "U" or time.dtype.kind != "f" or title.ndim or time.ndim:
        raise Refused("name and time of a snapshot")
    return Snapshot(name=str(title), time=float(time), **parts)


def stress_in_space(rotation: Floats, stress: Floats) -> Floats:
    """Mean over points of R s R^T: rotation (e, p, 3, 3), stress (e, p, 6) -> (e, 6)."""
    full = np.empty((*stress.shape[:2], 3, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
        full[..., i, j] = full[..., j, i] = stress[..., k]
    turned: NDArray[np.float64] = np.einsum("epij,epjk,eplk->epil", rotation, full, rotation).mean(axis=1)
    return np.stack([turned[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)
