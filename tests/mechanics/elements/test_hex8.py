"""The hexahedron against Gauss integration of its shape functions."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.elements.hex8 import (
    CORNERS,
    FACES,
    HOURGLASS,
    hourglass_shares,
    largest_face,
    shape_gradient,
    volume_gradient,
)

ROOT = 1.0 / np.sqrt(3.0)
GAUSS = [(a, b, c) for c in (-ROOT, ROOT) for b in (-ROOT, ROOT) for a in (-ROOT, ROOT)]


@pytest.mark.parametrize("seed", range(4))
def test_volume_and_its_gradient_are_those_of_gauss_integration(seed: int) -> None:
    xe, b, g = CORNERS + 0.2 * np.random.default_rng(seed).uniform(-1, 1, (8, 3)), np.empty((8, 3)), np.empty((8, 3))
    volume = volume_gradient(xe, b)
    total, mean = 0.0, np.zeros((8, 3))
    for point in GAUSS:  # two points a direction are exact for a trilinear volume
        weight = shape_gradient(xe, *point, g)
        total += weight
        mean += weight * g
    assert volume == pytest.approx(total, rel=1e-13)
    np.testing.assert_allclose(b, mean, atol=1e-13)
    np.testing.assert_allclose(xe.T @ b, volume * np.eye(3), atol=1e-13)


def test_largest_face_of_a_brick() -> None:
    assert largest_face(CORNERS * np.array([1.0, 2.0, 3.0])) == pytest.approx(6.0)


def test_faces_close_the_cube_and_look_outwards() -> None:
    corners = CORNERS[FACES].astype(float)
    area = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    np.testing.assert_array_equal(area.sum(axis=0), 0.0)
    assert (np.einsum("fi,fi->f", area, corners.mean(axis=1) - 0.5) == 0.5).all()


def test_hourglass_shares_are_projections_on_the_base_vectors() -> None:
    w, out = np.random.default_rng(1).uniform(-1, 1, (8, 3)), np.empty((4, 3))
    hourglass_shares(w, out)
    np.testing.assert_allclose(out, HOURGLASS @ w, atol=1e-14)
