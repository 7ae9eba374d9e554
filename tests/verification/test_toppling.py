"""Toppling of a slope of columns: Goodman and Bray (1976), 16 blocks 10 m wide and up to 40 m high."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.loads import Loads
from graben.mechanics.blocks.loading.programme import Control, Programme
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons

WIDTH, STEP, DIP = 10.0, 1.0, 30.0
HEIGHTS = [4.0 * n for n in range(1, 11)] + [40.0 - 6.2 * n for n in range(1, 7)]
EXACT = 38.15  # deg, of bases and sides alike, at the limit


def columns():
    """Polygons of bases and columns, and the outline; bases of 30 deg that rise by a step at each column."""
    dip = np.radians(DIP)
    turn = np.array([(np.cos(dip), np.sin(dip)), (-np.sin(dip), np.cos(dip))])
    shapes, outline = [], [(0.0, -10.0), (16 * WIDTH, -10.0)]
    tops = []
    for n, height in enumerate(HEIGHTS):
        x0, x1, y = n * WIDTH, (n + 1) * WIDTH, n * STEP
        shapes.append([(x0, -10.0), (x1, -10.0), (x1, y), (x0, y)])
        shapes.append([(x0, y), (x1, y), (x1, y + height), (x0, y + height)])
        tops += [(x0, y + height), (x1, y + height)]
    outline += tops[::-1]
    return [np.array(s) @ turn for s in shapes], np.array(outline) @ turn


@pytest.mark.parametrize("young", [20e9, 200e9, None])
@pytest.mark.parametrize(("share", "falls"), [(1.02, False), (0.98, True)])
def test_columns_topple_at_the_friction_of_goodman_and_bray(young, share, falls):
    shapes, outline = columns()
    bodies = build_bodies(from_polygons(shapes, outline))
    friction = share * np.tan(np.radians(EXACT))
    model = BlockModel(
        bodies, young=young or 20e9, poisson=0.2, density=2548.0,
        joint=Joint(1e10, 5e9, friction, 0.0, 0.0, 0.0, np.inf),
        rounding=0.02, dt=8e-3, gravity=(0.0, -9.81), rigid=young is None,
    )  # fmt: skip
    dip = np.radians(DIP)
    base = np.abs(bodies.position @ np.array([-np.sin(dip), np.cos(dip)]) + 10.0) < 1e-6
    for axis in (0, 1):
        model.hold(base, axis)
    test = Programme(model, Loads(len(base)), Control(), end=100.0, save_every=100.0, tolerance=1e-3)
    for _ in (*test.begin(), *test.run()):
        pass
    assert test.failed == falls and test.at_rest == (not falls)
