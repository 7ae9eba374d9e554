"""Zones that yield: against the law of the material room, closed forms, rotation, energy."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.biaxial import compress, consolidate
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks
from graben.mechanics.blocks.zones import elastic
from graben.mechanics.blocks.zones import plastic as pz
from graben.mechanics.materials.laws import update

YOUNG, POISSON = 10e9, 0.2
TRIANGLE = np.array([(0.0, 0.0), (1.0, 0.1), (0.3, 0.9)])
SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
LOOSE = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, np.tan(np.radians(5)), np.inf)


def one_zone(strength):
    corners = np.array([[0, 1, 2]])
    gradient, area = elastic.shape_gradients(TRIANGLE, corners)
    lam, mu = elastic.lame(YOUNG, POISSON)
    zones = elastic.ElasticZones(corners.astype(np.int32), gradient, area, np.full(1, lam), np.full(1, mu))
    return pz.plastic_zones(zones, YOUNG, POISSON, strength)


def second_stress(zone, f):
    """Stress S of the unrotated zone (3, 3) from what its vertex forces say: -force = area F S grad N."""
    x = TRIANGLE @ f.T
    force = np.zeros_like(x)
    work = pz.plastic_zone_forces(x, zone, force, 0, 1)
    # The gradients of two corners span the plane.
    push = -np.linalg.solve(zone.gradient[0, :2], force[:2]).T / zone.area[0]
    return np.linalg.solve(f, push), work


@pytest.mark.parametrize("seed", range(4))
def test_any_history_is_that_of_the_material_law_whatever_the_rotation(seed):
    rng = np.random.default_rng(seed)
    strength = pz.Strength(np.radians(35), 2e6, rng.uniform(0.2e6, 3e6), np.radians(rng.choice([0, 12, 35])))
    zone, turning = one_zone(strength), one_zone(strength)
    sig, state, none = np.zeros(4), np.zeros(1), np.empty((0, 0))
    old = np.zeros(4)
    h = np.zeros((2, 2))
    seen = set()
    for step in range(400):
        if step % 50 == 0:
            way = 4e-5 * rng.standard_normal((2, 2))
        h = h + way
        f = np.eye(2) + h
        green = 0.5 * (f.T @ f - np.eye(2))
        new = np.array([green[0, 0], green[1, 1], 0.0, 2.0 * green[0, 1]])
        assert update(2, new - old, sig, state, zone.par, 1.0, none) == 0
        old = new
        s, work = second_stress(zone, f)
        assert s == pytest.approx(np.array([[sig[0], sig[3]], [sig[3], sig[1]]]), rel=1e-6, abs=1.0)
        assert work >= 0.0
        angle = 0.02 * step
        c, sn = np.cos(angle), np.sin(angle)
        second_stress(turning, np.array([[c, -sn], [sn, c]]) @ f)
        seen.add(int(zone.flag[0]))
    assert zone.plastic[0, pz.EQUIVALENT] == pytest.approx(state[0], rel=1e-6)
    assert state[0] > 1e-4
    assert turning.plastic == pytest.approx(zone.plastic, rel=1e-6, abs=1e-12)
    assert pz.SHEAR in seen or pz.TENSION in seen
    # What saved states show is that very stress.
    x = TRIANGLE @ f.T
    cauchy, _ = elastic.zone_state(x, *zone[:5], zone.plastic)
    assert cauchy[0, [0, 1, 3]] == pytest.approx((f @ s @ f.T / np.linalg.det(f))[[0, 1, 0], [0, 1, 1]], rel=1e-9)
    assert cauchy[0, 2] == pytest.approx(sig[2] / np.linalg.det(f), rel=1e-6)


def test_rotation_alone_never_yields():
    zone = one_zone(pz.Strength(np.radians(30), 1.0, 0.5))
    for angle in (0.3, 2.0, np.pi):
        c, s = np.cos(angle), np.sin(angle)
        stress, work = second_stress(zone, np.array([[c, -s], [s, c]]))
        assert np.abs(stress).max() < 1e-5
        assert work == 0.0
    assert zone.flag[0] == pz.ELASTIC


def lone_block(strength, lateral, speed, steps):
    """A block between smooth platens under lateral pressure; the top moves. Returns (model, ledger at the start)."""
    bodies = build_bodies(from_polygons([SQUARE], SQUARE), 0.5)
    model = BlockModel(
        bodies,
        young=YOUNG,
        poisson=POISSON,
        density=2500.0,
        joint=LOOSE,
        rounding=1e-3,
        dt=1e-3,
        damping=Damping(ratio=1.0),
        strength=strength,
    )
    model.hold(bodies.vertex_side[:, 0], 1)
    for side in (1, 3):
        model.press(bodies.edge_side == side, -lateral)
    model.advance(1500)
    model.begin_ledger()
    start = model.energies()["error"]
    model.hold(bodies.vertex_side[:, 2], 1, speed)
    model.set_speed(0.0, 1e-3)
    model.advance(steps)
    return model, start


def test_biaxial_strength_and_dilation():
    phi, psi, cohesion, lateral = np.radians(30), np.radians(10), 1e6, 1e5
    model, start = lone_block(pz.Strength(phi, cohesion, 0.2e6, psi), lateral, -1e-3, 2500)
    n = np.tan(np.pi / 4 + phi / 2) ** 2
    expected = -(lateral * n + 2 * cohesion * np.sqrt(n))
    zone = model.skeleton.zones
    force = model.boundary_force()[model.bodies.vertex_side[:, 2], 1].sum()
    assert force == pytest.approx(expected, rel=5e-3)
    assert np.all(zone.flag == pz.SHEAR)
    p = zone.plastic
    assert p[:, pz.XX] / p[:, pz.YY] == pytest.approx(-(1 + np.sin(psi)) / (1 - np.sin(psi)), rel=1e-3)
    e = model.energies()
    assert e["plastic"] > 0.5 * e["boundary"]
    assert e["error"] - start == pytest.approx(0.0, abs=2e-3 * e["boundary"])


def test_tension_cut_off():
    model, start = lone_block(pz.Strength(np.radians(51), 55.1e6, 1e6), 1e4, 1e-3, 2000)
    force = model.boundary_force()[model.bodies.vertex_side[:, 2], 1].sum()
    assert force == pytest.approx(1e6, rel=5e-3)
    assert set(model.skeleton.zones.flag) <= {pz.TENSION, pz.PAST}
    e = model.energies()
    assert e["error"] - start == pytest.approx(0.0, abs=5e-3 * e["boundary"])


def weak_rock(threads=1, size=3.0, edge=0.5):
    bodies = build_bodies(voronoi_blocks(size * SQUARE, edge, seed=1))
    return BlockModel(
        bodies,
        young=65e9,
        poisson=0.2,
        density=2700.0,
        joint=LOOSE,
        rounding=0.05,
        dt=1e-2,
        threads=threads,
        strength=pz.Strength(np.radians(40), 4e6, 1e6, np.radians(5)),
    )


def test_weak_blocks_yield_the_ledger_closes_and_a_snapshot_goes_on():
    model = weak_rock()
    consolidate(model, -0.5e6, -0.25e6)
    history = History(model)
    stored = {}
    for k in compress(model, -0.0006, 10000, 11):
        history.save()
        if k == 6:
            stored.update(snapshot.take(model))
    a = history.arrays()
    assert (a["zone_state"][-1] != pz.ELASTIC).mean() > 0.1
    assert set(np.unique(a["zone_state"])) <= {0, 1, 2, 3}
    assert np.all(np.diff(a["zone_plastic_strain"], axis=0) >= 0.0)
    assert np.all(np.diff(a["energy_plastic"]) >= 0.0)
    work = np.abs(a["energy_boundary"]) + np.abs(a["energy_external"]) + a["energy_strain"] + a["energy_joint"]
    error = (a["energy_error"] - a["energy_error"][0]) / work
    assert np.abs(error).max() < 0.03
    again = weak_rock()
    snapshot.bring_back(again, stored)
    again.advance(model.steps_done - again.steps_done)
    assert np.array_equal(again.motion.x, model.motion.x)
    assert np.array_equal(again.skeleton.zones.plastic, model.skeleton.zones.plastic)


def test_threads_give_bitwise_the_same():
    one, other = (weak_rock(n, 4.0, 0.15) for n in (1, 2))
    assert len(one.parts.node) > 3
    for model in (one, other):
        model.hold(model.bodies.vertex_side[:, 0], 1)
        model.hold(model.bodies.vertex_side[:, 2], 1, -0.01)
        model.set_speed(1.0)
        model.advance(400)
    assert (one.skeleton.zones.flag != pz.ELASTIC).any()
    assert np.array_equal(one.motion.x, other.motion.x)
    assert np.array_equal(one.skeleton.zones.plastic, other.skeleton.zones.plastic)


def test_strengths_out_of_bounds_are_refused():
    with pytest.raises(ValueError, match="dilation"):
        one_zone(pz.Strength(0.3, 1e6, 1e5, 0.4))
    with pytest.raises(ValueError, match="cohesion"):
        one_zone(pz.Strength(0.3, -1e6, 1e5))
