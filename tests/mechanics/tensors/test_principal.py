"""Principal values and the way back, against numpy's eigensolver and against a full rotation."""

import numpy as np
import pytest

from graben.mechanics.materials.elastic import fill_elastic
from graben.mechanics.tensors.principal import (
    back_plane_stress,
    back_plane_tangent,
    back_space_stress,
    back_space_tangent,
    split_plane,
    split_space,
)

CASES = [
    [3.0, 1.0, 2.0, 0.5, 0.3, -0.2],
    [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, -2.0, 1e-9, 0.0, 0.0],
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [-5.0, -1.0, 4.0, -3.0, 2.0, 7.0],
    [1e9, 1e9, 1e9, 1.0, -2.0, 0.5],
]


def matrix(s):
    xx, yy, zz, xy, yz, zx = s
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


@pytest.mark.parametrize("case", CASES, ids=str)
def test_values_match_numpy_and_stress_comes_back(case):
    s = np.array(case)
    vectors, back = np.empty((3, 3)), np.empty(6)
    values = np.array(split_space(s, vectors))
    expected = np.sort(np.linalg.eigvalsh(matrix(s)))[::-1]
    np.testing.assert_allclose(values, expected, atol=1e-14 * np.abs(s).max())
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(3), atol=1e-14)
    back_space_stress(*values, vectors, back)
    np.testing.assert_allclose(back, s, atol=3e-15 * np.abs(s).max())

    plane = np.array([*case[:4], 0.0, 0.0])
    s1, s2, s3, c, w, rank = split_plane(*plane[:4])
    np.testing.assert_allclose((s1, s2, s3), np.sort(np.linalg.eigvalsh(matrix(plane)))[::-1],
                               atol=1e-14 * np.abs(s).max())  # fmt: skip
    out = np.empty(4)
    back_plane_stress(s1, s2, s3, c, w, rank, out)
    np.testing.assert_allclose(out, plane[:4], atol=3e-15 * np.abs(s).max())


@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_isotropic_block_turns_into_the_elastic_stiffness(case):
    bulk, shear = 2.0, 0.7
    for n in (4, 6):
        tangent, expected = np.zeros((n, n)), np.zeros((n, n))
        fill_elastic(1.0, bulk, shear, expected)
        fill_elastic(1.0, bulk, shear, tangent)
        if n == 4:
            *_values, c, s, rank = split_plane(*case[:4])
            back_plane_tangent(c, s, rank, shear, shear, shear, tangent)
        else:
            vectors = np.empty((3, 3))
            split_space(np.array(case), vectors)
            back_space_tangent(vectors, shear, shear, shear, tangent)
        np.testing.assert_allclose(tangent, expected, atol=1e-14)
