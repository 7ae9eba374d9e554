"""Joints: the kernel against a slow reference, balance of forces and moments, candidates against brute force."""

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.blocks.contact import forces, joints, nodes, search, sleeping
from graben.mechanics.blocks.contact.joints import SLIP, Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.shape.bodies import build_bodies, chamfered_skin
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

from .reference import boxes_meet, pair_force, shared_interval

JOINT = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, np.tan(np.radians(5)), np.inf)
SQUARE = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]])


def node_table(points, velocity, follow):
    node = np.zeros((len(points), nodes.COLUMNS))
    index = np.arange(len(points))
    nodes.node_motion(points, velocity, index, index, np.zeros(len(points)), follow, node, 0, len(points))
    return node


def one_pair(shear, slip):
    return joints.Pairs(
        np.array([2]),
        np.array([0], dtype=np.int32),
        np.array([2], dtype=np.int32),
        np.array([shear], dtype=float),
        np.array([slip], dtype=float),
        np.zeros((1, 2), dtype=np.int8),
        np.ones(1, dtype=np.int8),
        np.zeros(1, dtype=np.int8),
        np.zeros(1, dtype=np.int16),
    )


@pytest.mark.parametrize("face", [0, 1, 2])
@pytest.mark.parametrize("seed", range(40))
def test_kernel_against_reference(seed, face):
    joint = JOINT._replace(face=face)
    rng = np.random.default_rng(seed)
    # Edge e runs along x with its block above; edge f below runs back, turned by up to 55 degrees.
    angle = np.radians(rng.uniform(-55, 55)) if seed % 2 else np.radians(rng.uniform(-3, 3))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    e = np.array([[0.0, 0.0], [0.5, 0.0]])
    f = np.array([[0.3, 0.0], [-0.3, 0.0]]) @ turn.T + [rng.uniform(-0.2, 0.7), rng.uniform(-0.001, 0.02)]
    whole = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(whole), np.sin(whole)
    points = np.vstack([e, f]) @ np.array([[c, s], [-s, c]]) + rng.uniform(-5, 5, 2)
    velocity = rng.standard_normal((4, 2))
    follow = np.array([1, 0, 3, 2])
    dt = 1e-4
    shear, slip = rng.uniform(-1e5, 1e5, 2), rng.uniform(-0.01, 0.01, 2)
    pairs = one_pair(shear, slip)
    force, sums = np.zeros((4, 2)), np.zeros(2)
    node = node_table(points, velocity, follow)
    rows, far = forces.empty_rows(1), np.zeros((1, 4))
    forces.fill_row(rows, 0, pairs, 0, follow, 0)
    # The second edge may belong to another part: then its forces wait in `far`.
    end = 4 if seed % 3 else 2
    bad = forces.contact_forces(rows, 0, 1, node, joints.joint_table([joint]), 0, 1.0, dt, force, end, far, sums)
    forces.settle_rows(rows, 0, 1, pairs)
    assert np.any(force[2:]) != np.any(far) or not np.any(force)
    force[2:] += far.reshape(2, 2)
    assert bad == -1
    fe, ff, new_shear, new_slip = pair_force(
        points[:2], points[2:], velocity[:2], velocity[2:], shear, slip, joint, dt
    )
    assert force == pytest.approx(np.vstack([fe, ff]), rel=1e-9, abs=1e-3)
    assert pairs.shear[0] == pytest.approx(new_shear, rel=1e-9, abs=1e-6)
    assert pairs.slip[0] == pytest.approx(new_slip, rel=1e-9, abs=1e-15)
    size = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() <= 1e-14 * size
    assert abs((points[:, 0] * force[:, 1] - points[:, 1] * force[:, 0]).sum()) <= 1e-13 * size


@pytest.mark.parametrize("seed", range(20))
def test_pairs_cannot_bear_before_they_have_moved_as_far_as_is_safe(seed):
    rng = np.random.default_rng(seed)
    follow = np.array([1, 0, 3, 2])
    kinds = set()
    for _ in range(200):
        long, short = (rng.uniform(0.04, 0.5) for _ in range(2))
        angle = np.radians(rng.uniform(-75, 75))
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        middle = [rng.uniform(-0.5, 1.5) * long, -rng.uniform(-0.01, 0.05)]
        points = np.vstack([[(0.0, 0.0), (long, 0.0)], np.array([(short / 2, 0), (-short / 2, 0)]) @ turn + middle])
        node = node_table(points, np.zeros((4, 2)), follow)
        node[:, nodes.RIM] = rng.choice([0.0, 0.005])
        held = rng.choice([0.0, 0.003])
        kind, room = sleeping.safe_motion(0, 2, 3, node, held)
        if room <= 0.0:
            continue
        kinds.add(kind)
        for _ in range(20):
            share = rng.uniform(0, 1)
            way = rng.standard_normal((4, 2))
            way *= (room * np.array([share, share, 1 - share, 1 - share]) / np.hypot(*way.T))[:, None]
            moved = node_table(points + way, np.zeros((4, 2)), follow)
            length, gap = shared_interval(moved[:2, :2], moved[2:, :2])
            assert length <= 2 * node[0, nodes.RIM] or gap >= held
    assert len(kinds) > 1


@pytest.mark.parametrize("seed", range(20))
def test_the_safe_way_holds_on_a_face_too(seed):
    """On a long face, as platens have, contacts are judged along the face; the bound on sleeping knows no faces."""
    rng = np.random.default_rng(seed)
    follow = np.array([1, 0, 3, 2])
    for _ in range(200):
        short, angle = rng.uniform(0.04, 0.5), np.radians(rng.uniform(-75, 75))
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        middle = [rng.uniform(0.5, 4.5), -rng.uniform(-0.01, 0.05)]
        block = np.array([(short / 2, 0), (-short / 2, 0)]) @ turn + middle
        points = np.vstack([[(0.0, 0.0), (5.0, 0.0)], block])
        _, room = sleeping.safe_motion(0, 2, 3, node_table(points, np.zeros((4, 2)), follow), 0.0)
        if room <= 0.0:
            continue
        for _ in range(20):
            share, way = rng.uniform(0, 1), rng.standard_normal((4, 2))
            way *= (room * np.array([share, share, 1 - share, 1 - share]) / np.hypot(*way.T))[:, None]
            moved = points + way
            length, gap = shared_interval(moved[:2], moved[2:], face=1)
            assert length <= 0.0 or gap >= 0.0


def test_search_finds_what_brute_force_finds():
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.6, seed=4))
    skin = chamfered_skin(bodies, 0.05)
    rng = np.random.default_rng(1)
    x = bodies.position + 0.05 * rng.standard_normal((len(bodies.block_area), 2))[bodies.vertex_block]
    points = (1 - skin.weight)[:, None] * x[skin.first] + skin.weight[:, None] * x[skin.second]
    node = node_table(points, np.zeros_like(points), skin.follow)
    reach, deepest = 0.08, 10.0
    none = np.empty(0, dtype=np.int64)
    keys = search.find_keys(
        node, skin.follow, skin.block, reach, deepest, np.array([0.5, 0.5]), 0.4, 5, 5, none, none
    )
    n = len(points)
    expected = []
    for e, f in boxes_meet(points, skin.follow, skin.block, reach):
        facing = -(node[e, nodes.TX] * node[f, nodes.TX] + node[e, nodes.TY] * node[f, nodes.TY])
        if facing >= joints.FACING_NONE - 2 * reach / min(node[e, nodes.LENGTH], node[f, nodes.LENGTH]):
            expected.append(e * n + f)
    assert keys.tolist() == sorted(expected)


def squeezed_model(**changes):
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.6, seed=4))
    model = BlockModel(
        bodies, young=65e9, poisson=0.2, density=2700.0, joint=JOINT, rounding=0.05, dt=1e-3, **changes
    )
    model.hold(bodies.vertex_side[:, 0], 1)
    model.hold(bodies.vertex_side[:, 2], 1, -0.01)
    model.set_speed(1.0)
    return model


def awake(model):
    turn = model.motion.turn
    return int((turn[:, -1] - turn[:, 0]).sum())


def test_sleeping_pairs_change_nothing():
    # With reach 0 spared, every candidate is active: same forces, bit for bit.
    one, other = squeezed_model(), squeezed_model()
    other.near = 10.0
    other.rebuild()
    one.advance(1500)
    other.advance(1500)
    assert awake(other) > 2 * awake(one)
    assert one.motion.x == pytest.approx(other.motion.x, rel=0, abs=1e-9)


def test_frequent_search_changes_nothing():
    one, other = squeezed_model(), squeezed_model()
    other.reach = 0.02
    one.advance(1500)
    other.advance(1500)
    assert other.rebuilds > one.rebuilds
    assert one.motion.x == pytest.approx(other.motion.x, rel=0, abs=1e-9)


def test_forces_and_moments_of_all_joints_balance():
    model = squeezed_model()
    model.advance(2000)
    # Forces belong to the positions before the last step.
    f, x = model.motion.joint_force, model.motion.x - model.dt * model.motion.v
    assert np.any(model.pairs.flag == SLIP)
    size = np.abs(f).sum()
    assert np.abs(f.sum(axis=0)).max() < 1e-13 * size
    assert abs((x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]).sum()) < 1e-12 * size


def test_same_run_twice_is_bitwise_the_same():
    one, other = squeezed_model(), squeezed_model()
    for model in (one, other):
        model.advance(800)
    assert np.array_equal(one.motion.x, other.motion.x)
    assert np.array_equal(one.pairs.shear, other.pairs.shear)


def test_two_threads_give_bitwise_the_same():
    models = []
    for threads in (1, 2, 3):
        bodies = build_bodies(voronoi_blocks(2.0 * SQUARE, 0.25, seed=4))
        model = BlockModel(
            bodies, young=65e9, poisson=0.2, density=2700.0, joint=JOINT, rounding=0.02, dt=1e-3, threads=threads
        )
        assert len(model.parts.node) > 2
        model.hold(bodies.vertex_side[:, 0], 1)
        model.hold(bodies.vertex_side[:, 2], 1, -0.02)
        model.set_speed(1.0)
        model.advance(400)
        models.append(model)
    one = models[0]
    assert np.any(one.pairs.flag == SLIP)
    assert np.any(one.motion.far)
    for other in models[1:]:
        for name in ("x", "v", "joint_force", "ledger"):
            assert np.array_equal(getattr(one.motion, name), getattr(other.motion, name)), name
        assert np.array_equal(one.pairs.shear, other.pairs.shear)


def test_pieces_of_a_run_are_the_run():
    one, other = squeezed_model(), squeezed_model()
    one.advance(800)
    for n in (1, 299, 500):
        other.advance(n)
    assert np.array_equal(one.motion.x, other.motion.x)
    assert np.array_equal(one.pairs.shear, other.pairs.shear)


def test_rotation_of_all_blocks_keeps_joints_quiet():
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.6, seed=4))
    model = BlockModel(
        bodies,
        young=65e9,
        poisson=0.2,
        density=2700.0,
        joint=JOINT,
        rounding=0.05,
        dt=1e-5,
        damping=Damping(ratio=-1.0),
    )
    # Turned bodily by 40 degrees, without strain: no forces.
    c, s = np.cos(0.7), np.sin(0.7)
    model.motion.x[:] = bodies.position @ np.array([[c, s], [-s, c]])
    model.advance(1)
    assert np.abs(model.motion.joint_force).max() < 1.0
    assert np.abs(model.zone_stress()).max() < 10.0


def test_energy_is_conserved_without_damping_and_friction():
    free = Joint(1e9, 1e9, 0.0, 0.0, 0.0, 0.0, np.inf)
    bodies = build_bodies(voronoi_blocks(SQUARE, 0.6, seed=4))
    model = BlockModel(
        bodies, young=1e9, poisson=0.2, density=2700.0, joint=free, rounding=0.05, damping=Damping(ratio=-1.0)
    )
    rng = np.random.default_rng(3)
    centre = bodies.position.mean(axis=0)
    # Blocks run into one another, and bounce.
    model.motion.v[:] = (
        0.3 * (centre - bodies.position) + 0.1 * rng.standard_normal((len(bodies.block_area), 2))[bodies.vertex_block]
    )
    begin = model.kinetic_energy(np.ones(len(bodies.block_area), dtype=bool))
    stored, total = [], []
    for _ in range(40):
        model.advance(5)
        e = model.energies()
        stored.append(e["joint"])
        total.append(e["kinetic"] + e["strain"] + e["joint"])
    assert max(stored) > 0.1 * begin
    assert total == pytest.approx(np.full(40, begin), rel=0.05)


def test_a_time_step_that_is_too_long_stops_the_run():
    model = squeezed_model()
    model.dt *= 2.5
    with pytest.raises(NumericsFailed, match="speed") as failure:
        model.advance(5000)
    assert "block" in failure.value.where
    assert failure.value.advice


def test_blocks_pressed_through_each_other_stop_the_run():
    soft = Joint(1e6, 1e6, 0.5, 0.0, 0.0, 0.0, np.inf)
    stack = from_polygons(
        [np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)]), np.array([(0, 1), (1, 1), (1, 2), (0, 2.0)])],
        np.array([(0, 0), (1, 0), (1, 2), (0, 2.0)]),
    )
    bodies = build_bodies(stack)
    model = BlockModel(bodies, young=1e9, poisson=0.2, density=2700.0, joint=soft, rounding=0.05, dt=1e-3)
    model.hold(bodies.vertex_side[:, 0], 1)
    model.hold(bodies.vertex_side[:, 2], 1, -0.5)
    model.set_speed(1.0)
    with pytest.raises(NumericsFailed, match="overlap") as failure:
        model.advance(2000)
    assert "blocks 0 and 1" in failure.value.where


def test_tension_holds_until_it_breaks():
    glued = Joint(1e10, 1e10, 0.5, 1e6, 1e5, 0.0, np.inf)
    stack = from_polygons(
        [np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)]), np.array([(0, 1), (1, 1), (1, 2), (0, 2.0)])],
        np.array([(0, 0), (1, 0), (1, 2), (0, 2.0)]),
    )
    bodies = build_bodies(stack)
    model = BlockModel(bodies, young=1e10, poisson=0.2, density=2700.0, joint=glued, rounding=0.05, dt=1e-3)
    model.hold(bodies.vertex_side[:, 0], 1)
    model.hold(bodies.vertex_side[:, 2], 1, 1e-4)
    model.set_speed(1.0)
    pulls = []
    for _ in range(60):
        model.advance(20)
        pulls.append(model.motion.reaction[bodies.vertex_side[:, 2], 1].sum())
    # The contact is one metre less two chamfers of 0.05 m; the strength acts on that.
    assert max(pulls) == pytest.approx(0.9e5, rel=0.06)
    assert abs(pulls[-1]) < 1e3
    assert np.all(model.pairs.flag[model.pairs.intact == 1] == joints.BROKEN)
