"""Loads as nodal forces: weight, and pressures that end anywhere on the outline."""

import numpy as np
import pytest

from graben.mechanics.fem.loads import body_force, edge_traction


def test_weight_is_shared_out_whole_and_without_moment(grid):
    mesh = grid(3.0, 2.0, 5, 4, bend=0.3)
    force = body_force(mesh, 2500.0, np.array([1.0, -9.81])).reshape(-1, 2)
    np.testing.assert_allclose(force.sum(axis=0), [2500 * 6.0, -9.81 * 2500 * 6.0])
    arm = mesh.points - [1.5, 1.0]
    moment = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
    np.testing.assert_allclose(moment.sum(), 0.0, atol=1e-9 * np.abs(moment).sum())


def test_an_edge_load_may_end_inside_elements(grid):
    mesh = grid(3.0, 2.0, 5, 4)
    force, length = edge_traction(mesh, np.array([0.4, 2.0]), np.array([1.7, 2.0]))
    force = force.reshape(-1, 2)
    np.testing.assert_allclose(length, 1.3)
    np.testing.assert_allclose(force.sum(axis=0), [0.0, -1.3], atol=1e-15)  # a pressure pushes into the body
    np.testing.assert_allclose((mesh.points[:, 0] * force[:, 1]).sum(), -1.3 * 1.05)
    tangential, _ = edge_traction(mesh, np.array([1.7, 2.0]), np.array([0.4, 2.0]), np.array([3.0, 0.0]))
    np.testing.assert_allclose(tangential.reshape(-1, 2).sum(axis=0), [3.9, 0.0])
    with pytest.raises(ValueError, match=r"covers 2 m of the 2\.5 m"):
        edge_traction(mesh, np.array([1.0, 2.0]), np.array([3.5, 2.0]))
    with pytest.raises(ValueError, match="covers 0 m"):
        edge_traction(mesh, np.array([0.0, 1.0]), np.array([3.0, 1.0]))
