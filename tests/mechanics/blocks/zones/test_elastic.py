"""Triangles: exact under affine fields, no stress under rotation, forces that are the gradient of the energy."""

import numpy as np
import pytest

from graben.mechanics.blocks.shape.bodies import build_bodies, ear_clip
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks
from graben.mechanics.blocks.zones import elastic
from graben.mechanics.plane.polygons import signed_area

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


@pytest.fixture(scope="module", params=[None, 0.3])
def mesh(request):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.8, seed=2), request.param)
    gradient, area = elastic.shape_gradients(bodies.position, bodies.zone_vertex)
    lam, mu = elastic.lame(65e9, 0.2)
    return bodies, gradient, area, np.full(len(area), lam), np.full(len(area), mu)


def forces(mesh, x):
    bodies, gradient, area, lam, mu = mesh
    out = np.zeros_like(x)
    elastic.zone_forces(x, bodies.zone_vertex, gradient, area, lam, mu, out, 0, len(area))
    return out


def test_zones_fill_the_blocks(mesh):
    bodies = mesh[0]
    assert mesh[2].sum() == pytest.approx(16.0, rel=1e-12)
    assert np.all(np.bincount(bodies.zone_block) >= 1)
    ring = np.split(bodies.position[bodies.block_corner], bodies.block_start[1:-1])
    assert bodies.block_area == pytest.approx([signed_area(r) for r in ring], rel=1e-9)


def test_rotation_of_any_size_makes_no_stress(mesh):
    bodies, gradient, area, lam, mu = mesh
    for angle in (0.1, 1.0, np.pi):
        c, s = np.cos(angle), np.sin(angle)
        x = bodies.position @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
        stress, energy = elastic.zone_state(x, bodies.zone_vertex, gradient, area, lam, mu)
        assert np.abs(stress).max() < 1e-13 * 65e9 * 10
        assert np.abs(forces(mesh, x)).max() < 1e-2
        assert energy < 1e-6


def test_small_affine_field_gives_hookes_stress(mesh):
    bodies, gradient, area, lam, mu = mesh
    h = 1e-7 * np.array([[1.0, 0.5], [0.3, -2.0]])
    stress, _ = elastic.zone_state(bodies.position @ (np.eye(2) + h).T, bodies.zone_vertex, gradient, area, lam, mu)
    e = 0.5 * (h + h.T)
    tr = np.trace(e)
    hooke = [lam[0] * tr + 2 * mu[0] * e[0, 0], lam[0] * tr + 2 * mu[0] * e[1, 1], lam[0] * tr, 2 * mu[0] * e[0, 1]]
    assert stress == pytest.approx(np.tile(hooke, (len(area), 1)), rel=1e-5)


def test_forces_are_the_gradient_of_the_energy_and_balance(mesh):
    bodies, gradient, area, lam, mu = mesh
    rng = np.random.default_rng(0)
    x = bodies.position @ np.array([[0.9, 0.3], [-0.2, 1.1]]) + 0.01 * rng.standard_normal(bodies.position.shape)
    f = forces(mesh, x)
    d = rng.standard_normal(x.shape)
    h = 1e-5

    def energy(y):
        return elastic.zone_state(y, bodies.zone_vertex, gradient, area, lam, mu)[1]

    assert -(f * d).sum() == pytest.approx((energy(x + h * d) - energy(x - h * d)) / (2 * h), rel=1e-6)
    scale = np.abs(f).sum()
    assert np.abs(f.sum(axis=0)).max() < 1e-13 * scale
    assert abs((x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]).sum()) < 1e-13 * scale * 4.0


def test_ears_of_a_polygon_that_turns_inwards():
    ring = np.array([(0, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)], dtype=float)
    triangles = ear_clip(ring)
    assert len(triangles) == 3
    assert sum(signed_area(ring[t]) for t in triangles) == pytest.approx(signed_area(ring))
    assert min(signed_area(ring[t]) for t in triangles) > 0.0


def test_row_sums_bound_the_fastest_mode(mesh):
    bodies, gradient, area, lam, mu = mesh
    rows = elastic.row_sums(elastic.stiffness_matrices(gradient, area, lam, mu))
    nv = len(bodies.position)
    total = np.bincount(bodies.zone_vertex.ravel(), weights=rows.ravel(), minlength=nv)
    stiffness = np.zeros((2 * nv, 2 * nv))
    h = 1e-6
    for z in range(min(31, len(area))):
        for a in range(3):
            for d in range(2):
                x = bodies.position.copy()
                x[bodies.zone_vertex[z, a], d] += h
                one = np.zeros_like(x)
                elastic.zone_forces(
                    x, bodies.zone_vertex[z : z + 1], gradient[z : z + 1], area[z : z + 1], lam, mu, one, 0, 1
                )
                stiffness[:, 2 * bodies.zone_vertex[z, a] + d] -= one.ravel() / h
    seen = np.flatnonzero(np.abs(stiffness).sum(axis=1))
    root = np.sqrt(np.repeat(total, 2))[seen]
    scaled = stiffness[np.ix_(seen, seen)] / np.outer(root, root)
    assert np.linalg.eigvalsh(0.5 * (scaled + scaled.T)).max() <= 1.0 + 1e-4
