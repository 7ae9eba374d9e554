"""A static solution of elastic blocks joined by springs, by dense-ish linear algebra: exact equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree


@dataclass
class Solution:
    displacement: np.ndarray  # (vertex, 2)
    zone_stress: np.ndarray  # (zone, 4)
    pair: np.ndarray  # (spring, 2) vertices
    spring_force: np.ndarray  # (spring, 2) on the first vertex of each pair
    outer_force: np.ndarray  # (vertex, 2) at the held vertices


def solve(model, held: np.ndarray, gradient: np.ndarray, young=65e9, poisson=0.2, spring=3e9) -> Solution:
    """Blocks of constant-strain zones, springs between coinciding vertices, `held` vertices moved affinely."""
    x, tri = model.position, model.zone_vertex
    n = x.shape[0]
    p = x[tri]
    twice = (p[:, 1, 0] - p[:, 0, 0]) * (p[:, 2, 1] - p[:, 0, 1]) - (p[:, 1, 1] - p[:, 0, 1]) * (
        p[:, 2, 0] - p[:, 0, 0]
    )
    shape = (
        np.stack(
            [
                np.roll(p[..., 1], -1, axis=1) - np.roll(p[..., 1], -2, axis=1),
                np.roll(p[..., 0], -2, axis=1) - np.roll(p[..., 0], -1, axis=1),
            ],
            axis=-1,
        )
        / twice[:, None, None]
    )
    lam, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    law = np.array([[lam + 2 * mu, lam, 0], [lam, lam + 2 * mu, 0], [lam, lam, 0], [0, 0, mu]])
    b = np.zeros((tri.shape[0], 3, 6))
    b[:, 0, 0::2], b[:, 1, 1::2] = shape[..., 0], shape[..., 1]
    b[:, 2, 0::2], b[:, 2, 1::2] = shape[..., 1], shape[..., 0]
    stiff = np.einsum("z,zai,ab,zbj->zij", 0.5 * np.abs(twice), b, law[[0, 1, 3]], b)
    dof = np.stack([2 * tri, 2 * tri + 1], axis=2).reshape(-1, 6)
    rows, cols = np.repeat(dof, 6, axis=1).ravel(), np.tile(dof, (1, 6)).ravel()
    pair = np.sort(cKDTree(x).query_pairs(1e-9, output_type="ndarray"), axis=1)
    pair = pair[np.lexsort(pair.T[::-1])]
    values = stiff.ravel()
    for axis in (0, 1):
        i, j = 2 * pair[:, 0] + axis, 2 * pair[:, 1] + axis
        k = np.full(i.size, spring)
        rows, cols = np.concatenate([rows, i, j, i, j]), np.concatenate([cols, i, j, j, i])
        values = np.concatenate([values, k, k, -k, -k])
    matrix = coo_matrix((values, (rows, cols)), shape=(2 * n, 2 * n)).tocsr()
    fixed = np.repeat(held, 2)
    u = np.zeros(2 * n)
    u[fixed] = (x @ gradient.T).ravel()[fixed]
    free = ~fixed
    u[free] = spsolve(matrix[free][:, free], -matrix[free][:, fixed] @ u[fixed])
    outer = (matrix @ u).reshape(-1, 2) * held[:, None]
    strain = np.einsum("zai,zi->za", b, u[dof])
    move = u.reshape(-1, 2)
    return Solution(move, strain @ law.T, pair, spring * (move[pair[:, 1]] - move[pair[:, 0]]), outer)
