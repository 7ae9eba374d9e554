"""Averages over spheres."""

import numpy as np
import pytest

from graben.mechanics.averaging.spheres import best_fit_gradient, love_weber


def test_a_cubic_lattice_under_stress_gives_that_stress():
    """Spheres of radius r in a simple cubic lattice: a force 4 r^2 sigma on each contact."""
    r, n = 0.01, 4
    grid = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    centre = (2 * grid + 1) * r
    stress = np.array([-1e5, -2e5, 3e4])
    pair, force, point = [], [], []
    index = {tuple(g): k for k, g in enumerate(grid)}
    for k, g in enumerate(grid):
        for axis in range(3):
            ahead = g.copy()
            ahead[axis] += 1
            normal = np.eye(3)[axis]
            pair.append((k, index.get(tuple(ahead), -1)))
            force.append(4 * r**2 * stress[axis] * normal)
            point.append(centre[k] + r * normal)
            if g[axis] == 0:
                pair.append((k, -1))
                force.append(-4 * r**2 * stress[axis] * normal)
                point.append(centre[k] - r * normal)
    everything = np.ones(n**3, dtype=bool)
    arrays = np.array(pair), np.array(force), np.array(point)
    assert np.allclose(love_weber(everything, centre, *arrays, (2 * r * n) ** 3), np.diag(stress), rtol=1e-12)
    inner = ((grid > 0) & (grid < n - 1)).all(axis=1)
    assert np.allclose(love_weber(inner, centre, *arrays, 8 * (2 * r) ** 3), np.diag(stress), rtol=1e-12)
    with pytest.raises(ValueError, match="volume"):
        love_weber(everything, centre, *arrays, 0.0)


def test_best_fit_is_exact_for_affine_fields_and_robust_to_scatter():
    rng = np.random.Generator(np.random.PCG64(1))
    x = rng.uniform(-1.0, 1.0, (4000, 3)) + 30.0
    gradient = rng.normal(0.0, 0.01, (3, 3))
    u = x @ gradient.T + [1.0, 2.0, 3.0]
    assert np.allclose(best_fit_gradient(x, np.stack([u, 2 * u])), np.stack([gradient, 2 * gradient]), atol=1e-13)
    noisy = best_fit_gradient(x, u + rng.normal(0.0, 0.001, x.shape))
    assert np.abs(noisy - gradient).max() < 5 * 0.001 / np.sqrt(4000 / 3)


def test_too_few_spheres():
    with pytest.raises(ValueError, match="span"):
        best_fit_gradient(np.zeros((3, 3)), np.zeros((3, 3)))
