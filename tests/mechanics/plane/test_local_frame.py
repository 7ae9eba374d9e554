"""Coordinates count from beside a body that lies far from zero, and from zero else."""

import numpy as np
import pytest

from graben.mechanics.plane.local_frame import local_origin

BODY = np.array([(0.0, -2.0), (4.0, -2.0), (4.0, 3.0)])


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
def test_far_is_measured_by_the_size_of_the_body(scale):
    for offset, far in ((0.0, False), (50.0, False), (1e6, True), (1e7, True)):
        points = (BODY + offset) * scale
        assert np.array_equal(local_origin(points), points.min(axis=0) if far else np.zeros(2))
