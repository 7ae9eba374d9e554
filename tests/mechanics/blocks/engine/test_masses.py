"""Masses of blocks: against dense matrices, and against what a step makes of forces."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine import masses
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

SQUARE = np.array([(0, 0), (4, 0), (4, 4), (0, 4)], dtype=float)
JOINT = Joint(1e10, 1e9, 0.6, 0.0, 0.0, 0.0, np.inf)


def model_of(bodies, **more):
    keys = {"young": 65e9, "poisson": 0.2, "density": 2700.0, "joint": JOINT, "rounding": 0.02, "dt": 1e-2} | more
    return BlockModel(bodies, **keys)


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def inverse(table, x, b):
    """M_eff^-1 of block b, by the words of the module."""
    these = np.arange(table.first[b], table.first[b + 1])
    m, n = table.vertex[these], len(these)
    r = x[these] - (m[:, None] * x[these]).sum(axis=0) / m.sum()
    arm = np.column_stack([-r[:, 1], r[:, 0]]).ravel()
    one = np.zeros((2, 2 * n))
    one[0, 0::2] = one[1, 1::2] = 1.0
    _, lighter, nimbler = table.block[b]
    return these, np.diag(1.0 / np.repeat(m, 2)) + lighter * one.T @ one + nimbler * np.outer(arm, arm)


def test_inertial_force_undoes_what_forces_do():
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.8, seed=2))
    model = model_of(bodies)
    table = model.masses
    assert np.median(table.block[:, masses.LIGHTER] * table.block[:, masses.WHOLE]) > 2.0
    acceleration = np.random.default_rng(1).standard_normal(bodies.position.shape)
    force = masses.inertial_force(table, bodies.position, acceleration)
    for b in range(len(table.block)):
        these, matrix = inverse(table, bodies.position, b)
        assert matrix @ force[these].ravel() == pytest.approx(acceleration[these].ravel(), rel=1e-9, abs=1e-9)
    power = 0.5 * (force * acceleration).sum()
    assert masses.kinetic_energies(table, bodies.position, acceleration).sum() == pytest.approx(power)
    assert masses.mobility(table, bodies.position, force) == pytest.approx(2.0 * power)


@pytest.mark.parametrize("tied", [(), ((0, 1),), ((0, 0), (0, 1), (2, 1))])
def test_a_step_is_what_dense_matrices_make_of_it(tied):
    bodies = build_bodies(from_polygons([rectangle(0, 0, 2, 1)], rectangle(0, 0, 2, 1)))
    alpha = 3.0
    model = model_of(bodies, damping=Damping(ratio=-1.0, coefficient=alpha))
    rng = np.random.default_rng(4)
    model.motion.v[:] = 1e-3 * rng.standard_normal(bodies.position.shape)
    model.skeleton.steady[:] = 1e5 * rng.standard_normal(bodies.position.shape)
    for vertex, axis in tied:
        model.hold(np.array([vertex]), axis, 2e-3)
    model.set_speed(1.0)
    held = model.held.ravel()
    old, dt = model.motion.v.ravel().copy(), model.dt
    force = model.skeleton.steady.ravel().copy()
    _, matrix = inverse(model.skeleton.mass, bodies.position, 0)
    model.advance(1)
    new = model.motion.v.ravel()
    # The walls' forces are those that make the held velocities what they are; held motion is not damped.
    drag = np.where(held, 0.0, alpha * 0.5 * (old + new))
    wall = np.linalg.solve(matrix, (new - old) / dt + drag) - force
    assert wall[~held] == pytest.approx(np.zeros((~held).sum()), abs=1e-6 * np.abs(force).max())
    assert wall[held] == pytest.approx(model.motion.reaction.ravel()[held], rel=1e-6)
    assert new[held] == pytest.approx(np.full(held.sum(), 2e-3))
    # What the ledger says of this step: zones bear nothing yet.
    e = model.energies()
    before = masses.kinetic_energies(model.skeleton.mass, bodies.position, old.reshape(-1, 2)).sum()
    assert e["kinetic"] - before == pytest.approx(e["external"] + e["boundary"] - e["damping"])


@pytest.mark.parametrize("zone_edge", [None, 0.4])
@pytest.mark.parametrize("dt", [None, 1e-2])
def test_no_motion_of_blocks_and_springs_is_too_fast_for_the_step(dt, zone_edge):
    bodies = build_bodies(voronoi_blocks(SQUARE, 1.0, seed=5), zone_edge)
    loose = Joint(1e10, 1e10, 1e9, 1e12, 1e12, 0.0, np.inf)
    model = model_of(bodies, dt=dt, joint=loose, damping=Damping(ratio=-1.0))
    rng = np.random.default_rng(3)
    model.motion.v[:] = 1e-7 * rng.standard_normal(bodies.position.shape) / model.dt
    first = model.kinetic_energy(np.ones(len(bodies.block_area), dtype=bool))
    model.advance(3000)
    e = model.energies()
    assert e["kinetic"] + e["strain"] + e["joint"] < 1.5 * first
    # Nor is it much shorter than it has to be: a step of twice the length is unstable.
    model.dt *= 2.0
    with pytest.raises(Exception, match=r"speed|overlap|finite"):
        model.advance(3000)


@pytest.mark.parametrize("every", [3, 8])
def test_stopping_a_block_over_and_over_feeds_no_vibration(every):
    # Close to the limit of the step, a vibration whose velocity is set to nothing again and again would grow.
    bodies = build_bodies(from_polygons([rectangle(0, 0, 1, 1)], rectangle(0, 0, 1, 1)))
    model = model_of(bodies, damping=Damping(ratio=-1.0))
    rng = np.random.default_rng(7)
    model.motion.v[:] = 1e-4 * rng.standard_normal(bodies.position.shape) + [0.01, -0.02]
    strain = []
    for _ in range(300):
        model.advance(every)
        model.calm_loose_blocks()
        strain.append(model.energies()["strain"])
    assert max(strain[200:]) < 1.2 * max(strain[:50])
    # It stays where it was stopped first, a few steps from its start.
    middle = model.motion.x.mean(axis=0) - [0.5, 0.5]
    assert np.abs(middle).max() < 0.021 * every * model.dt


def test_blocks_looked_at_in_turn_have_the_masses_of_all_together(monkeypatch):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.8, seed=2))
    whole = model_of(bodies).masses
    monkeypatch.setattr(masses, "_TOGETHER", 300)
    for together, in_turn in zip(whole, model_of(bodies).masses, strict=True):
        assert in_turn == pytest.approx(together, rel=1e-12)


def test_a_long_block_turns_with_the_moment_of_inertia_of_its_area():
    bodies = build_bodies(from_polygons([rectangle(0, 0, 4, 1)], rectangle(0, 0, 4, 1)))
    model = model_of(bodies, dt=None, damping=Damping(ratio=-1.0))
    couple = 100.0
    model.skeleton.steady[:, 1] = couple * np.where(bodies.position[:, 0] > 2.0, 1.0, -1.0)
    forces = model.skeleton.steady
    moment = float((bodies.position[:, 0] * forces[:, 1]).sum())
    steps = 4000
    model.advance(steps)
    r = bodies.position - [2.0, 0.5]
    spin = (r[:, 0] * model.motion.v[:, 1] - r[:, 1] * model.motion.v[:, 0]).sum() / (r**2).sum()
    inertia = 2700.0 * 4.0 * (4.0**2 + 1.0) / 12.0
    assert spin == pytest.approx(moment / inertia * steps * model.dt, rel=1e-3)
