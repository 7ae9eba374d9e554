"""Rigid blocks against closed forms: sliding, toppling, pendulum, walls, energy; and against stiff elastic ones."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.biaxial import compress, consolidate
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History, mean_stress
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

G = 9.81
SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
ROCK = {"young": 65e9, "poisson": 0.2, "density": 2500.0, "rigid": True}


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def on_incline(width, height, slope, friction, rounding=0.02, steps=6000):
    """A block on a held base, gravity turned by `slope` [deg]: brought to rest with locked sliding, then let go."""
    base = rectangle(0, -0.5, 4, 0)
    block = rectangle(1.0, 0, 1.0 + width, height)
    bodies = build_bodies(from_polygons([base, block], base))
    t = np.radians(slope)
    model = BlockModel(
        bodies,
        **ROCK,
        joint=Joint(1e9, 1e9, np.tan(np.radians(friction)), 0.0, 0.0, 0.0, np.inf),
        rounding=rounding,
        gravity=(G * np.sin(t), -G * np.cos(t)),
        damping=Damping(ratio=-1.0, local=0.8),
    )
    held = bodies.vertex_block == 0
    model.hold(held, 1)
    model.hold(slice(None), 0)
    model.advance(steps)
    model.release(~held, 0)
    model.damp(Damping(ratio=-1.0))
    return model


def velocity(model):
    """(blocks in order of storage, 3) velocity and spin."""
    return model.skeleton.zones.place[:, 3:]


def stored(model, number):
    """Row of a block."""
    return list(model.bodies.vertex_block[model.skeleton.zones.first[:-1]]).index(number)


@pytest.mark.parametrize(("slope", "expected"), [(35.0, 0.987), (25.0, 0.0)])
def test_block_slides_as_it_must(slope, expected):
    model = on_incline(1.0, 0.5, slope, 30.0)
    speeds, times = [], []
    for _ in range(60):
        model.advance(max(1, round(0.01 / model.dt)))
        times.append(model.time)
        speeds.append(velocity(model)[stored(model, 1), 0])
    assert np.polyfit(times[15:], speeds[15:], 1)[0] == pytest.approx(expected, rel=0.01, abs=0.005)


# The corner is cut at 1 mm, so the block tips over a base narrower by 2 mm.
@pytest.mark.parametrize(("ratio", "falls"), [(0.97, True), (1.03, False)])
def test_block_topples_beyond_its_width_over_height(ratio, falls):
    slope, height = 20.0, 1.0
    width = ratio * height * np.tan(np.radians(slope)) + 0.002
    model = on_incline(width, height, slope, 50.0, rounding=1e-3)
    # Whether it goes over, not how it rocks when let go.
    model.damp(Damping(ratio=-1.0, coefficient=2.0))
    model.advance(round(2.0 / model.dt))
    turned = abs(model.skeleton.zones.place[stored(model, 1), 2])
    assert (turned > 0.2) == falls
    if not falls:
        assert turned < 0.01


def lone(shape, outline=None, **options):
    bodies = build_bodies(from_polygons([shape], shape if outline is None else outline))
    joint = Joint(1e9, 1e9, 0.6, 0.0, 0.0, 0.0, np.inf)
    return BlockModel(bodies, **ROCK, joint=joint, rounding=1e-3, **options)


def test_block_hung_by_a_corner_swings_as_a_physical_pendulum():
    # Small swings about a corner: omega^2 = m g d / (J + m d^2), d the distance to the middle; nothing drifts.
    w, h = 0.8, 0.5
    shape = rectangle(0, 0, w, h)
    d = 0.5 * np.hypot(w, h)
    inertia = (w**2 + h**2) / 12.0 + d**2
    lean = 0.05
    towards = np.arctan2(h, w) + np.pi  # from the upper right corner to the middle
    model = lone(
        shape,
        dt=1e-3,
        gravity=(G * np.cos(towards + lean), G * np.sin(towards + lean)),
        damping=Damping(ratio=-1.0),
    )
    blocks = model.skeleton.zones
    mass_ratio = blocks.inertia[0, 0] / (2500.0 * w * h)
    corner = int(np.argmax(model.bodies.position.sum(axis=1)))
    for axis in (0, 1):
        model.hold([corner], axis)
    period = 2 * np.pi / np.sqrt(G * d / inertia / mass_ratio) * (1 + lean**2 / 16)
    angle, weight = [], model.weight.sum(axis=0)
    for _ in range(400):
        model.advance(round(period / 200 / model.dt))
        angle.append(blocks.place[0, 2])
    assert model.motion.x[corner] == pytest.approx([w, h], abs=1e-8)
    # Two periods: starts at rest at 0, swings to twice the lean and back.
    assert max(angle) == pytest.approx(2 * lean, rel=1e-3)
    back = 100 + int(np.argmin(angle[100:300]))
    assert (back + 1) * round(period / 200 / model.dt) * model.dt == pytest.approx(period, rel=0.01)
    e = model.energies()
    assert abs(e["error"]) < 1e-3 * np.abs(weight).max() * d * lean
    assert e["external"] == pytest.approx(e["kinetic"], abs=1e-3 * np.abs(weight).max() * d * lean)


def test_walls_carry_weight_and_its_moment():
    model = lone(SQUARE, dt=1e-3, gravity=(-2.0, -G), damping=Damping(ratio=-1.0))
    sides = model.bodies.vertex_side
    model.hold(sides[:, 0], 1)
    model.hold(sides[:, 3], 0)
    model.press(model.bodies.edge_side == 2, -1e4)
    model.advance(50)
    force, x = model.boundary_force() + model.weight, model.motion.x
    assert np.abs(force.sum(axis=0)).max() < 1e-6
    assert abs((x[:, 0] * force[:, 1] - x[:, 1] * force[:, 0]).sum()) < 1e-6
    assert x == pytest.approx(model.bodies.position, abs=1e-12)
    assert model.unbalanced_ratio() < 1e-9
    # Uniform pressure from above and below: the mean of 1e4 at the top and, with the weight, more at the bottom.
    stress = model.block_stress()[0]
    assert stress == pytest.approx([-0.5 * 2.0 * 2500.0, -1e4 - 0.5 * G * 2500.0, 0.0], rel=1e-9, abs=1e-6)


def test_a_free_block_keeps_its_momentum_spin_and_energy_and_feels_no_stress():
    shape = np.array([(0.0, 0.0), (1.0, 0.1), (1.3, 0.8), (0.2, 0.9)])
    model = lone(shape, damping=Damping(ratio=-1.0))
    velocity(model)[0] = (0.3, -0.2, 1.5)
    model.motion.v[:] = 0.0
    start = model.motion.x.copy()
    centre = model.skeleton.zones.place[0, :2].copy()
    model.advance(3000)
    place = model.skeleton.zones.place[0]
    assert place[:2] == pytest.approx(centre + model.time * np.array([0.3, -0.2]), abs=1e-9)
    assert place[2] == pytest.approx(1.5 * model.time, rel=1e-9)
    assert place[3:] == pytest.approx((0.3, -0.2, 1.5), rel=1e-12)
    c, s = np.cos(place[2]), np.sin(place[2])
    turned = (start - centre) @ np.array([[c, s], [-s, c]]) + place[:2]
    assert model.motion.x == pytest.approx(turned, abs=1e-12)
    assert np.abs(model.block_stress()).max() == 0.0
    # Area, middle and moment of inertia of the polygon by Green's theorem.
    a, b = shape - centre, np.roll(shape - centre, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert ((a + b) * cross[:, None]).sum(axis=0) == pytest.approx([0, 0], abs=1e-12)
    polar = (cross * (a * a + a * b + b * b).sum(axis=1)).sum() / 12.0
    mass, gyration, _ = model.skeleton.zones.inertia[0]
    assert mass == pytest.approx(2500.0 * 0.5 * cross.sum())
    assert mass * gyration**2 == pytest.approx(2500.0 * polar)
    assert model.kinetic_energy(np.array([True])) == pytest.approx(0.5 * mass * 0.13 + 0.5 * 2500.0 * polar * 1.5**2)


def squeezed(threads=1, size=3.0, edge=0.6):
    bodies = build_bodies(voronoi_blocks(size * SQUARE, edge, seed=4))
    joint = Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, np.tan(np.radians(5)), np.inf)
    return BlockModel(bodies, **ROCK, joint=joint, rounding=0.05, dt=1e-2, threads=threads)


def test_compression_closes_its_ledger_balances_and_goes_on_from_a_snapshot():
    model, halfway = squeezed(), {}
    consolidate(model, -0.5e6, -0.25e6)
    history = History(model)
    for k in compress(model, -0.0006, 5000, 6):
        history.save()
        if k == 3:
            halfway.update(snapshot.take(model))
    a = history.arrays()
    assert a["zone_stress"].shape == (6, 0, 4)
    work = np.abs(a["energy_boundary"]) + np.abs(a["energy_external"]) + a["energy_joint"]
    assert np.abs((a["energy_error"] - a["energy_error"][0]) / work).max() < 0.03
    top, bottom = a["wall_reaction"][:, 2, 1], a["wall_reaction"][:, 0, 1]
    assert np.abs(bottom[1:] / -top[1:] - 1.0).max() < 0.05
    # Stress of the blocks, summed, against the forces on the outline.
    for k in (0, 5):
        x = a["vertex_position"] + a["displacement"][k]
        by_force = np.einsum("vi,vj->ij", x, a["boundary_force"][k])
        by_block = np.einsum("b,bc->c", a["block_area"], a["block_stress"][k])
        assert by_block[:2] == pytest.approx(np.diag(by_force), rel=0.05)
    first = mean_stress(np.insert(a["block_stress"], 2, 0.0, axis=2)[0], a["block_area"], a["block_area"] > 0.0)
    assert first[:2] == pytest.approx([-0.5e6, -0.25e6], rel=0.03)
    # Shapes do not change.
    x = a["vertex_position"] + a["displacement"][-1]
    for b in (0, 5):
        here = a["vertex_block"] == b
        sides = [np.linalg.norm(np.diff(p[here], axis=0), axis=1) for p in (x, model.bodies.position)]
        assert sides[0] == pytest.approx(sides[1], rel=1e-12)
    again = squeezed()
    snapshot.bring_back(again, halfway)
    again.advance(model.steps_done - again.steps_done)
    assert np.array_equal(again.motion.x, model.motion.x)


def test_threads_give_bitwise_the_same():
    one, other = (squeezed(n, 4.0, 0.15) for n in (1, 2))
    assert len(one.parts.node) > 3
    for model in (one, other):
        model.hold(model.bodies.vertex_side[:, 0], 1)
        model.hold(model.bodies.vertex_side[:, 2], 1, -0.01)
        model.set_speed(1.0)
        model.advance(400)
    assert np.array_equal(one.motion.x, other.motion.x)
    assert np.array_equal(one.motion.reaction, other.motion.reaction)


def test_energy_is_conserved_without_damping_and_friction():
    bodies = build_bodies(voronoi_blocks(3.0 * SQUARE, 0.6, seed=4))
    joint = Joint(1e9, 1e8, 0.0, 0.0, 0.0, 0.0, np.inf)
    model = BlockModel(bodies, **ROCK, joint=joint, rounding=0.05, damping=Damping(ratio=-1.0))
    rng = np.random.default_rng(3)
    velocity(model)[:] = 0.02 * rng.standard_normal(velocity(model).shape)
    start = model.kinetic_energy(np.ones(len(bodies.block_area), dtype=bool))
    held = []
    for _ in range(20):
        model.advance(20)
        e = model.energies()
        held.append(e["joint"] / start)
        assert e["kinetic"] + e["joint"] == pytest.approx(start, rel=0.03)
    assert max(held) > 0.05


def test_rigid_is_the_limit_of_stiff_elastic_blocks():
    peaks = []
    for rigid in (True, False):
        bodies = build_bodies(voronoi_blocks(3.0 * SQUARE, 0.6, seed=4))
        joint = Joint(1e9, 1e8, np.tan(np.radians(32)), 1e5, 0.0, 0.0, np.inf)
        model = BlockModel(
            bodies,
            young=1e12,
            poisson=0.2,
            density=2500.0,
            rigid=rigid,
            joint=joint,
            rounding=0.05,
            dt=1e-2 if rigid else 2e-3,
        )
        consolidate(model, -0.5e6, -0.25e6)
        history = History(model)
        for _ in compress(model, -0.0006, 3000 if rigid else 15000, 4):
            history.save()
        peaks.append(history.arrays()["wall_reaction"][1:, 2, 1])
    assert peaks[0] == pytest.approx(peaks[1], rel=0.05)
