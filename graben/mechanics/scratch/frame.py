"""The state of the body at one time, and stress turned from the corotated frame into space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.scratch.mesh import Floats, Ints


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


def stress_in_space(rotation: Floats, stress: Floats) -> Floats:
    """Mean over points of R s R^T: rotation (e, p, 3, 3), stress (e, p, 6) -> (e, 6)."""
    full = np.empty((*stress.shape[:2], 3, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
        full[..., i, j] = full[..., j, i] = stress[..., k]
    turned: NDArray[np.float64] = np.einsum("epij,epjk,eplk->epil", rotation, full, rotation).mean(axis=1)
    return np.stack([turned[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)
