"""Rings that users give: what is a simple polygon does not depend on its place, size or direction."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.averaging.rev import Polygon
from graben.mechanics.meshes.paved import paved_mesh
from graben.mechanics.meshes.sizing import SizeField
from graben.mechanics.plane.rings import refuse_crossing, turning_corners

BOX = np.array([(0.0, 0.0), (5.0, 0.0), (5.0, 3.5), (0.0, 3.5)])
CORNERS = np.array([(0, 0), (2, 0), (5, 0), (5, 0), (5, 3.5), (0, 3.5), (0, 1), (0, 0)], float)
SPIKE = np.array([(0, 0), (5, 0), (7, 0), (5, 0), (5, 3), (0, 3)], float)
BOW_TIE = BOX[[0, 2, 1, 3]]


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("offset", [0.0, 1e6, 1e7])
@pytest.mark.parametrize("turn", [np.eye(2), np.array([(0.0, 1.0), (-1.0, 0.0)]), np.diag([-1.0, 1.0])])
def test_simple_polygons_anywhere(scale, offset, turn):
    if scale < 1.0 and offset:
        offset *= scale
    refuse_crossing(BOX @ turn * scale + offset)
    refuse_crossing(CORNERS @ turn * scale + offset)
    for wrong in (SPIKE, BOW_TIE):
        with pytest.raises(Refused, match="simple"):
            refuse_crossing(wrong @ turn * scale + offset)


def test_outlines_are_freed_of_corners_that_do_not_turn_but_not_of_spikes():
    assert np.array_equal(turning_corners(BOX), BOX)
    assert sorted(map(tuple, turning_corners(CORNERS))) == sorted(map(tuple, BOX))
    assert (7.0, 0.0) in map(tuple, turning_corners(SPIKE))
    with pytest.raises(Refused, match=r"at \(7"):
        refuse_crossing(SPIKE)


def test_regions_and_bodies_take_repeated_corners_and_refuse_spikes():
    assert Polygon(tuple(map(tuple, CORNERS))).radius == pytest.approx(np.sqrt(17.5 / np.pi))
    nowhere = SizeField(1.0, np.zeros((0, 2, 2)), np.zeros(0), np.zeros(0))
    assert paved_mesh(CORNERS, nowhere).areas().sum() == pytest.approx(17.5)
    for wrong in (SPIKE, BOW_TIE):
        with pytest.raises(Refused, match="simple"):
            Polygon(tuple(map(tuple, wrong)))
        with pytest.raises(Refused, match="simple"):
            paved_mesh(wrong, nowhere)
