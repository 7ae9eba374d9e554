"""Balance at a saved state: contacts, walls, weight and inertia of each block add up to nothing."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.masses import inertial_force
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.biaxial import compress, consolidate
from graben.mechanics.blocks.record.balance import balance, zone_pull
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks

SQUARE = np.array([(0, 0), (3, 0), (3, 3), (0, 3)], dtype=float)


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def zone_areas(model):
    p = model.motion.x[model.bodies.zone_vertex]
    return 0.5 * cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def sums(count, block, force, moment):
    """Resultants (count, 2) and moments (count,) on the blocks."""
    total = np.column_stack([np.bincount(block, c, minlength=count) for c in (*force.T, moment)])
    return total[:, :2], total[:, 2]


@pytest.fixture(scope="module")
def moving():
    """A model at the peak, and Newton's view of its next step: what mass, acceleration and damping leave."""
    model = BlockModel(
        build_bodies(voronoi_blocks(SQUARE, 0.5, seed=1)),
        young=65e9,
        poisson=0.2,
        density=2700.0,
        # No dilation: slip within the step would move the stress that the saved state has.
        joint=Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, 0.0, np.inf),
        rounding=0.05,
        dt=1e-2,
    )
    consolidate(model, -0.5e6, -0.25e6)
    for _ in compress(model, -0.0006, 2000, 2):
        pass
    m = model.motion
    x, v, alpha = m.x.copy(), m.v.copy(), model.damping_coefficient
    model.advance(1)
    slowed = (m.v - v) / model.dt + np.where(model.held, 0.0, alpha * 0.5 * (m.v + v))
    newton = -inertial_force(model.skeleton.mass, x, slowed)
    outside = model.boundary_force()
    m.x[:] = x
    return model, newton, outside


def test_body_force_is_what_newton_leaves(moving):
    model, newton, outside = moving
    found = balance(model, model.zone_stress(), outside)
    assert np.abs(newton).max() > 1e3
    # To round-off of the forces that it is left of.
    scale = np.abs(model.motion.zone_force).max()
    assert found.body_force == pytest.approx(newton, abs=1e-10 * scale)
    pull = zone_pull(model.motion.x, model.bodies.zone_vertex, model.zone_stress())
    assert pull == pytest.approx(-model.motion.zone_force, abs=1e-10 * scale)


def test_contacts_balance_each_block_with_its_inertia(moving):
    model, newton, outside = moving
    out, ints, _ = model.contacts()
    x, owner, n = model.motion.x, model.bodies.vertex_block, len(model.bodies.block_area)
    force, moment = sums(n, owner, newton + outside, cross(x, newton + outside))
    by_middle = moment.copy()
    for edge, sign in ((model.pairs.first, 1.0), (model.pairs.second, -1.0)):
        block, push = model.skin.block[edge[ints[:, 0]]], sign * out[:, 2:4]
        about_middle = sign * cross(out[:, 9:11], out[:, 11:13])
        f, m = sums(n, block, push, cross(out[:, :2], push) + about_middle)
        force, moment = force + f, moment + m
        by_middle += sums(n, block, push, cross(out[:, :2], push))[1]
    scale = np.abs(out[:, 2:4]).max()
    assert np.abs(force).max() < 1e-13 * scale
    assert np.abs(moment).max() < 1e-13 * scale * 3.0
    # Taken to act in the middle of each contact, the forces would leave a moment.
    assert np.abs(by_middle).max() > 1e-3 * scale * 0.5


def test_overlap_is_a_small_part_of_the_stress(moving):
    model, _, outside = moving
    stress = model.zone_stress()
    overlap = balance(model, stress, outside).overlap_moment
    whole = np.einsum("z,zc->c", zone_areas(model), stress)
    # sigma / kn over the size of a block.
    assert 0.0 < abs(overlap[:, 1].sum() / whole[1]) < 3.0 * abs(whole[1] / 9.0) / 1e10 / 0.5
