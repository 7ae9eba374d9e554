"""Closed forms on bent and graded meshes: rates of convergence, no locking."""

import numpy as np
import pytest

from graben.mechanics.elements.quad4 import GAUSS, shape_functions
from graben.mechanics.fem.newton import NewtonOptions, equilibrate
from graben.mechanics.meshes.mesh2d import QuadMesh


def ring(n):
    """A quarter of a cylinder of radii 1 and 2 m, 2 n x n elements."""
    r, angle = np.meshgrid(np.linspace(1, 2, n + 1), np.linspace(0, np.pi / 2, 2 * n + 1), indexing="ij")
    ids = np.arange(r.size).reshape(r.shape)
    points = np.stack([(r * np.cos(angle)).ravel(), (r * np.sin(angle)).ravel()], axis=1)
    points[np.abs(points) < 1e-14] = 0.0
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    return QuadMesh(points, quads), ids


def inner_pressure(mesh, ids, pressure):
    """Pressure on the straight edges of the inner circle, sharing each edge's load between its ends."""
    force = np.zeros((len(mesh.points), 2))
    for i, j in zip(ids[0, :-1], ids[0, 1:]):
        edge = mesh.points[j] - mesh.points[i]
        force[[i, j]] += 0.5 * pressure * np.array([edge[1], -edge[0]])
    return force.ravel()


def radial_error(n, poisson, body, material):
    """Energy-like error of stress and error of displacement against Lame's solution (plane strain)."""
    mesh, ids = ring(n)
    young, pressure = 1.0e9, 1.0e6
    b = body(mesh, material("elastic", young_modulus=young, poisson_ratio=poisson), lambda x, y: (x == 0, y == 0))
    step = equilibrate(
        b, b.untouched(), inner_pressure(mesh, ids, pressure), np.zeros(len(b.fixed)), NewtonOptions(1e-10)
    )
    assert step.converged
    a, c = pressure / 3.0, 4.0 * pressure / 3.0  # sigma_r = a - c / r^2, sigma_theta = a + c / r^2
    r = np.hypot(*mesh.points.T)
    exact = (1 + poisson) / young * ((1 - 2 * poisson) * a * r + c / r)
    found = (step.state.displacement.reshape(-1, 2) * mesh.points).sum(axis=1) / r
    values, _ = shape_functions(GAUSS)
    place = np.einsum("ga,eai->egi", values, mesh.points[mesh.quads])
    rg = np.hypot(place[..., 0], place[..., 1])
    normal = place / rg[..., None]
    s = step.state.stress
    radial = (
        s[..., 0] * normal[..., 0] ** 2
        + s[..., 1] * normal[..., 1] ** 2
        + 2 * s[..., 3] * normal[..., 0] * normal[..., 1]
    )
    weight = b.elements.weight
    stress_error = np.sqrt((weight * (radial - (a - c / rg**2)) ** 2).sum() / (weight * (a - c / rg**2) ** 2).sum())
    return np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)), stress_error


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
def test_thick_cylinder_converges_at_the_rates_of_bilinear_elements(poisson, body, material):
    errors = np.array([radial_error(n, poisson, body, material) for n in (4, 8, 16)])
    rates = np.log2(errors[:-1] / errors[1:])
    assert np.all(rates[:, 0] > 1.85), (errors, rates)  # displacement: h^2
    assert np.all(rates[:, 1] > 0.9), (errors, rates)  # stress: h, at Gauss points better
    assert errors[-1, 0] < 3e-3


def test_without_mean_dilatation_the_cylinder_locks(body, material):
    def options(flag):
        return lambda mesh, law, fix: body(mesh, law, fix, mean_dilatation=flag)

    free = radial_error(8, 0.4999, options(True), material)[0]
    locked = radial_error(8, 0.4999, options(False), material)[0]
    assert locked > 5 * free


def test_cantilever_tip_follows_beam_theory(grid, body, material):
    """Length 20, height 1, end shear force; plane strain; Timoshenko's deflection with shear."""
    length, height, young, poisson, force = 20.0, 1.0, 1e9, 0.3, 1e3
    modulus, shear = young / (1 - poisson**2), young / (2 * (1 + poisson))
    inertia = height**3 / 12
    exact = force * length**3 / (3 * modulus * inertia) + 1.2 * force * length / (shear * height)
    found = []
    for n in (2, 4, 8):
        mesh = grid(length, height, 20 * n, 2 * n)
        b = body(mesh, material("elastic", young_modulus=young, poisson_ratio=poisson), lambda x, y: (x == 0, x == 0))
        end = np.flatnonzero(mesh.points[:, 0] == length)
        y = mesh.points[end, 1]
        # parabolic shear: consistent enough for a tip deflection
        share = np.gradient(y) * 6 * y * (height - y) / height**3
        load = np.zeros((len(mesh.points), 2))
        load[end, 1] = force * share / share.sum()
        step = equilibrate(b, b.untouched(), load.ravel(), np.zeros(len(b.fixed)), NewtonOptions(1e-10))
        found.append(step.state.displacement[2 * end + 1].mean())
    errors = np.abs(np.array(found) / exact - 1)
    assert np.all(np.diff(errors) < 0)
    assert errors[-1] < 5e-3
