"""Elements in plane strain: whole areas, one volume strain in each, and shapes that are refused."""

import numpy as np
import pytest

from graben.mechanics.elements import quad4
from graben.mechanics.elements.plane_strain import plane_elements

_, DERIVATIVES = quad4.shape_functions(quad4.GAUSS)
KITE = np.array([[[0.0, 0.0], [2.0, 0.5], [2.5, 2.0], [0.2, 1.0]]])  # area 2.425 m2


def test_points_share_the_area_and_mean_dilatation_leaves_one_volume_strain():
    plain, bar = (plane_elements(KITE, DERIVATIVES, mean) for mean in (False, True))
    np.testing.assert_allclose(plain.weight.sum(), 2.425)
    np.testing.assert_allclose(bar.length, np.sqrt(2.425))
    u = np.array([1e-3, 0.0, 0.0, 2e-3, -1e-3, 1e-3, 0.0, -2e-3])
    strain, mean = (np.einsum("egic,c->egi", e.strain_matrix, u)[0] for e in (plain, bar))
    volume = strain[:, 0] + strain[:, 1]
    assert np.ptp(volume) > 1e-4
    np.testing.assert_allclose(mean[:, 0] + mean[:, 1], volume @ plain.weight[0] / 2.425, rtol=1e-12)
    np.testing.assert_array_equal(mean[:, 2], strain[:, 2])
    np.testing.assert_allclose(mean[:, 0] - mean[:, 1], strain[:, 0] - strain[:, 1], atol=1e-15)


def test_a_turned_over_element_is_refused():
    for bad in (KITE[:, ::-1], np.array([[[0, 0], [1, 0], [0.2, 0.2], [0, 1.0]]])):
        with pytest.raises(ValueError, match="element 1 is turned over or not convex"):
            plane_elements(np.concatenate([KITE, bad]), DERIVATIVES)
