"""Shape functions of the quadrilateral: one at their own node, linear fields exactly, derivatives by differences."""

import numpy as np

from graben.mechanics.elements.quad4 import GAUSS, shape_functions

NODES = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def test_each_shape_function_is_one_at_its_own_node_and_none_at_the_others():
    np.testing.assert_array_equal(shape_functions(NODES)[0], np.eye(4))


def test_positions_are_reproduced_and_derivatives_are_those_of_the_values():
    values, derivatives = shape_functions(GAUSS)
    np.testing.assert_allclose(values.sum(axis=1), 1.0)
    np.testing.assert_allclose(values @ NODES, GAUSS, atol=1e-15)
    for axis, step in enumerate(1e-6 * np.eye(2)):
        slope = (shape_functions(GAUSS + step)[0] - shape_functions(GAUSS - step)[0]) / 2e-6
        np.testing.assert_allclose(derivatives[..., axis], slope, atol=1e-9)
