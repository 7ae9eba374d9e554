"""Bearing capacity of a strip on weightless cohesive ground, Prandtl: (2 + pi) c; the mesh comes from above."""

import numpy as np
import pytest

from graben.mechanics.fem.body import Material, make_body
from graben.mechanics.fem.loads import edge_traction
from graben.mechanics.fem.march import StepOptions, march
from graben.mechanics.fem.newton import NewtonOptions
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.meshes.mapped import mapped_mesh
from graben.mechanics.meshes.sizing import SizeField

PRANDTL = 2.0 + np.pi


def capacity(near: float, growth: float, size: float, mean_dilatation: bool = True, until: float = 8.0) -> float:
    """Pressure over cohesion that half a strip of width 1 m carries; 6 m x 5 m of von Mises ground."""
    corners = np.array([(0, 0), (0.5, 0), (6, 0), (0, 5), (0.5, 5), (6, 5)], float)
    field = SizeField(size, np.array([[[0.5, 5.0], [0.5, 5.0]]]), np.array([near]), np.array([growth]))
    mesh = mapped_mesh(corners, np.array([(0, 1, 4, 3), (1, 2, 5, 4)]), field)
    x, y = mesh.points.T
    fixed = np.stack([(x == 0) | (x == 6) | (y == 0), y == 0], axis=1)
    # friction 0: von Mises; in plane strain its shear strength is sigma_y / sqrt(3), here 1 Pa
    values = {
        "young_modulus": 1e4, "poisson_ratio": 0.49, "friction_angle": 0.0,
        "hardening": "linear", "initial_yield": np.sqrt(3.0),
    }  # fmt: skip
    parameters = pack("drucker-prager", values)
    law = Material(LAWS["drucker-prager"].id, parameters, LAWS["drucker-prager"].initial_state(parameters))
    body = make_body(mesh, [law], fixed.ravel(), mean_dilatation=mean_dilatation)
    unit, _ = edge_traction(mesh, np.array([0.0, 5.0]), np.array([0.5, 5.0]))
    run = march(
        body, body.untouched(), lambda t: t * unit, 0.0, until, StepOptions(0.5, 1.0, 4e-3), NewtonOptions(1e-5)
    )
    assert run.energy_error() < 1e-6
    return run.time


def test_coarse_mesh_is_within_three_percent():
    assert PRANDTL * 0.99 < capacity(0.05, 0.2, 1.0) < 1.03 * PRANDTL


def test_without_mean_dilatation_it_locks():
    assert capacity(0.05, 0.2, 1.0, mean_dilatation=False) > 1.4 * PRANDTL


@pytest.mark.verify
def test_capacity_falls_to_prandtls_as_the_mesh_is_refined():
    found = np.array([capacity(*mesh) for mesh in ((0.05, 0.2, 1.0), (0.025, 0.1, 0.5), (0.0125, 0.06, 0.4))])
    error = found / PRANDTL - 1
    assert np.all(np.diff(error) < 0)
    assert 0 < error[-1] < 0.006
