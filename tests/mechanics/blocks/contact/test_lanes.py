"""Batches of contacts: bitwise what each row gives when it goes alone."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact import forces, lanes
from graben.mechanics.blocks.contact.joints import Joint, joint_table
from graben.mechanics.blocks.engine import relaxation
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

SQUARE = 4.0 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
PLAIN = Joint(1e10, 1e9, 0.6, 1e5, 0.0, 0.05, np.inf)
FULL = PLAIN._replace(tension=1e5, residual_friction=0.5, residual_cohesion=0.0, closure=1e-3)


@pytest.mark.parametrize("joint", [PLAIN, FULL, PLAIN._replace(face=1), FULL._replace(face=2)])
def test_a_batch_gives_bitwise_what_its_rows_give_alone(joint):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.5, seed=1))
    model = BlockModel(bodies, young=65e9, poisson=0.2, density=2700.0, joint=joint, rounding=0.05, dt=2e-3)
    model.press(bodies.edge_side >= 0, -1e6)
    model.advance(150)
    m = model.motion
    relaxation.begin(model.skeleton, m, model.pairs)
    count = int(m.turn[0, -1])
    assert count > 3 * lanes.LANES and count % lanes.LANES
    found = []
    for step in (count, 1):
        rows = forces.Rows(*(a.copy() for a in m.rows))
        fn, far, sums = np.zeros_like(m.fn), np.zeros_like(m.far), np.zeros(2)
        for r in range(0, count, step):
            bad = forces.contact_forces(
                rows, r, r + step, m.node, joint_table([joint]), 0, 1.0, model.dt, fn, len(fn), far, sums
            )
            assert bad == -1
        found.append((fn, rows.hold, rows.mark, sums))
    assert np.abs(found[0][0]).max() > 1e3
    for together, alone in zip(*found, strict=True):
        assert together.tobytes() == alone.tobytes()
