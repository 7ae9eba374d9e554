"""Graded mesh, its supports and its surface."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.scratch.body import reference_gradients
from graben.mechanics.scratch.mesh import brick, graded_axis, specimen
from graben.mechanics.scratch.surface import contact_stiffness, exposed_faces


def test_axis_is_fine_inside_and_grows_outside() -> None:
    x = graded_axis(0.0, 200.0, (40.0, 130.0), 1.5, 1.25)
    d = np.diff(x)
    assert x[0] == 0.0 and x[-1] == 200.0 and (d > 0).all()
    inside = (x[:-1] >= 40.0 - 1e-9) & (x[1:] <= 130.0 + 1e-9)
    np.testing.assert_allclose(d[inside], 1.5)
    assert np.maximum(d[1:] / d[:-1], d[:-1] / d[1:]).max() < 1.6
    with pytest.raises(ValueError, match="graded axis"):
        graded_axis(0.0, 1.0, (0.5, 2.0), 0.1, 1.2)


def test_specimen_fills_its_box_and_is_held_where_it_should() -> None:
    mesh = specimen(200e-6, 50e-6, 15e-6, 50e-6, 60e-6, 14e-6, 3e-6)
    vol, g0 = np.empty(len(mesh.cells)), np.empty((len(mesh.cells), 1, 8, 3))
    reference_gradients(mesh.points, mesh.cells, g0, vol)
    assert vol.min() > 0 and vol.sum() == pytest.approx(200e-6 * 50e-6 * 15e-6, rel=1e-12)
    p, free = mesh.points, mesh.free
    assert (free[p[:, 2] == p[:, 2].min()] == 0).all()
    middle = (p[:, 1] == 0) & (p[:, 2] == 0) & (p[:, 0] > 0) & (p[:, 0] < 200e-6)
    np.testing.assert_array_equal(free[middle], np.tile([1, 0, 1], (middle.sum(), 1)))
    assert (p[mesh.top.ravel(), 2] == 0).all()


def test_exposed_faces_are_the_top_and_then_the_pit() -> None:
    mesh = brick(np.arange(5.0), np.arange(4.0), -np.arange(3.0)[::-1])
    alive = np.ones(len(mesh.cells), dtype=np.int64)
    faces, owners = exposed_faces(mesh, alive)
    assert len(faces) == 12 and (mesh.points[faces, 2] == 0).all()
    normal = np.cross(
        mesh.points[faces[:, 2]] - mesh.points[faces[:, 0]], mesh.points[faces[:, 3]] - mesh.points[faces[:, 1]]
    )
    assert (normal[:, 2] > 0).all()
    gone = (1 * 3 + 1) * 2 + 1  # cell (1, 1, top)
    alive[gone] = 0
    faces, owners = exposed_faces(mesh, alive)
    assert len(faces) == 11 + 5 and gone not in owners
    corner = brick(np.arange(5.0), np.arange(4.0), -np.arange(3.0)[::-1])
    alive[:] = 1
    alive[(1 * 3 + 0) * 2 + 1] = 0  # at the plane of symmetry: that side stays closed
    assert len(exposed_faces(corner, alive)[0]) == 11 + 4


def test_contact_stiffness_spreads_e_a_over_h() -> None:
    mesh = brick(np.arange(5.0), np.arange(4.0), -np.arange(3.0)[::-1])
    faces, owners = exposed_faces(mesh, np.ones(len(mesh.cells), dtype=np.int64))
    nodes, k = contact_stiffness(mesh, faces, owners, np.ones(len(mesh.cells)), 10.0, 0.5)
    assert k.sum() == pytest.approx(0.5 * 10.0 * 12) and set(nodes) == set(mesh.top.ravel())
