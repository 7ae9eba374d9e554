"""Motion of whole models against closed forms: sliding, consolidation, stiffness of jointed rock."""

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.biaxial import compress, consolidate
from graben.mechanics.blocks.record.history import History, mean_stress
from graben.mechanics.blocks.shape import partition
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.rectangle import rectangle_sides
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks


def rectangle(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


@pytest.mark.parametrize(("slope", "expected"), [(35.0, 0.987), (25.0, 0.0)])
def test_block_on_an_incline(slope, expected):
    # a = g (sin 35 - cos 35 tan 30) = 0.987 m/s2; at 25 degrees the block stays.
    stack = from_polygons([rectangle(0, -0.5, 4, 0), rectangle(0.5, 0, 1.5, 0.5)], rectangle(0, -0.5, 4, 0))
    bodies = build_bodies(stack)
    g, t = 9.81, np.radians(slope)
    model = BlockModel(
        bodies,
        young=1e8,
        poisson=0.2,
        density=2500.0,
        joint=Joint(1e9, 1e9, np.tan(np.radians(30)), 0.0, 0.0, 0.0, np.inf),
        rounding=0.02,
        gravity=(g * np.sin(t), -g * np.cos(t)),
        damping=Damping(ratio=-1.0, local=0.8),
    )
    base = bodies.vertex_block == 0
    model.hold(base, 1)
    model.hold(slice(None), 0)
    model.advance(4000)
    # At rest on the base: let it go, without any damping.
    model.release(~base, 0)
    model.damping = Damping(ratio=-1.0)
    start = model.motion.x[~base, 0].copy()
    mass = model.true_mass[~base]
    times, speeds = [], []
    for _ in range(100):
        model.advance(round(0.01 / model.dt))
        times.append(model.time)
        speeds.append(float((mass * model.motion.v[~base, 0]).sum() / mass.sum()))
    half = slice(20, None)
    assert np.polyfit(times[half], speeds[half], 1)[0] == pytest.approx(expected, rel=0.01, abs=0.005)
    if expected == 0.0:
        assert abs(model.motion.x[~base, 0] - start).max() < 1e-3


@pytest.mark.parametrize("flying", [1, 2, 3])
def test_a_block_of_any_part_hits_the_one_that_it_flies_to(monkeypatch, flying):
    # Parts of one block; one flies over a gap of many times the reach while all before it drift a little more each.
    monkeypatch.setattr(partition, "PART_BLOCKS", 1)
    squares = [rectangle(2 * k, 0, 2 * k + 1, 1) for k in range(5)]
    bodies = build_bodies(from_polygons(squares, rectangle(0, 0, 9, 1)))
    model = BlockModel(
        bodies, young=1e8, poisson=0.2, density=2500.0, joint=Joint(1e9, 1e9, 0.5, 0.0, 0.0, 0.0, np.inf),
        rounding=0.02, damping=Damping(ratio=-1.0),
    )  # fmt: skip
    assert len(model.parts.node) == 6
    for k in range(flying):
        model.motion.v[bodies.vertex_block == k, 0] = -1e-3 * (k + 1)
    model.motion.v[bodies.vertex_block == flying, 0] = 1.0
    model.advance(round(1.5 / model.dt))
    mean = [
        np.average(model.motion.v[bodies.vertex_block == k, 0], weights=model.true_mass[bodies.vertex_block == k])
        for k in (flying, flying + 1)
    ]
    # Equal masses: the impulse passes on, less what shakes on in the blocks.
    assert mean[0] + mean[1] == pytest.approx(1.0, abs=1e-9)
    assert mean[1] > 0.6
    assert model.rebuilds > 10


def brick_column(size, count, spacing):
    """A square of count x count square blocks."""
    shapes = [
        rectangle(i * spacing, j * spacing, (i + 1) * spacing, (j + 1) * spacing)
        for j in range(count)
        for i in range(count)
    ]
    return from_polygons(shapes, rectangle(0, 0, size, size))


def test_jointed_rock_is_as_stiff_as_rock_and_joints_in_series():
    # Plane strain modulus of rock and joints in a row, at lateral stress 0: 1 / E* = (1 - nu^2) / E + 1 / (kn s).
    e, nu, kn, s = 10e9, 0.2, 5e9, 0.5
    bodies = build_bodies(brick_column(2.0, 4, s))
    rounding = 1e-3
    model = BlockModel(
        bodies,
        young=e,
        poisson=nu,
        density=2500.0,
        joint=Joint(kn, 0.1e9, 0.6, 1e9, 0.0, 0.0, np.inf),
        rounding=rounding,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    sides = rectangle_sides(bodies.outline)
    top = bodies.vertex_side[:, sides.top]
    model.hold(bodies.vertex_side[:, sides.bottom], 1)
    stress = -1e5
    model.press(bodies.edge_side == sides.top, stress)
    model.advance(6000)
    assert model.unbalanced_ratio() < 1e-3
    sunk = (model.motion.x - bodies.position)[top, 1].mean()
    # Three joints in a column of four blocks; chamfers take 2 rounding of each edge of length s.
    joint_part = stress / (kn * (s - 2 * rounding) / s) * 3
    assert sunk == pytest.approx(stress * (1 - nu**2) / e * 2.0 + joint_part, rel=0.02)


@pytest.fixture(scope="module")
def small_run():
    bodies = build_bodies(voronoi_blocks(rectangle(0, 0, 3, 3), 0.5, seed=1))
    model = BlockModel(
        bodies,
        young=65e9,
        poisson=0.2,
        density=2700.0,
        joint=Joint(1e10, 1e9, np.tan(np.radians(32)), 1e5, 0.0, np.tan(np.radians(5)), np.inf),
        rounding=0.05,
        dt=100 / 10000,
    )
    ratio = consolidate(model, -0.5e6, -0.25e6)
    at_start = model.zone_stress(), model.boundary_force()
    history = History(model)
    for _ in compress(model, -0.0006, 10000, 11):
        history.save()
    return model, ratio, at_start, history.arrays()


def test_consolidation_reaches_the_applied_stress(small_run):
    model, ratio, (stress, force), _ = small_run
    assert ratio < 1e-3
    mean = mean_stress(stress, model.zone_area, np.ones(len(stress), bool))
    assert mean[0] == pytest.approx(-0.5e6, rel=0.02)
    assert mean[1] == pytest.approx(-0.25e6, rel=0.02)
    bottom = model.bodies.vertex_side[:, 0]
    assert force[bottom, 1].sum() == pytest.approx(0.25e6 * 3.0, rel=0.01)


def test_compression_balances_and_gains_strength(small_run):
    model, _, _, a = small_run
    top, bottom = a["wall_reaction"][:, 2, 1], a["wall_reaction"][:, 0, 1]
    assert np.abs(bottom[1:6] / -top[1:6] - 1.0).max() < 0.03
    assert -top.min() / 3.0 > 5e6
    held = model.bodies.vertex_side[:, 2]
    assert np.ptp(a["displacement"][-1][held, 1]) < 1e-12
    assert a["displacement"][-1][held, 1].mean() == pytest.approx(-0.06, rel=0.02)
    assert not a["displacement"][0].any()
    # Averaged stress equals what the boundary forces say: sum of x (x) f over the area.
    x = a["vertex_position"] + a["displacement"][3]
    by_force = np.einsum("vi,vj->ij", x, a["boundary_force"][3])
    zones = np.einsum("z,zc->c", model.zone_area, a["zone_stress"][3])
    assert by_force[1, 1] == pytest.approx(zones[1], rel=0.03)


def test_energy_ledger_closes(small_run):
    _, _, _, a = small_run
    work = np.abs(a["energy_boundary"]) + np.abs(a["energy_external"]) + a["energy_strain"] + a["energy_joint"]
    error = a["energy_error"] - a["energy_error"][0]
    assert np.abs(error / work).max() < 0.03
    assert np.all(np.diff(a["energy_friction"]) >= 0.0)


def test_contacts_add_up_to_the_forces_on_blocks(small_run):
    model, _, _, a = small_run
    last = slice(int(a["contact_count"][:-1].sum()), int(a["contact_count"].sum()))
    blocks = a["contact_block"][last]
    force = a["contact_force"][last]
    total = np.zeros((len(a["block_area"]), 2))
    np.add.at(total, blocks[:, 0], force)
    np.add.at(total, blocks[:, 1], -force)
    kernel = np.zeros_like(total)
    np.add.at(kernel, a["vertex_block"], model.motion.joint_force)
    # Forces of the saved state are of one step later than the kernel's.
    assert total == pytest.approx(kernel, abs=0.02 * np.abs(kernel).max())


def test_consolidation_that_cannot_end_says_so():
    bodies = build_bodies(voronoi_blocks(rectangle(0, 0, 2, 2), 0.5, seed=1))
    model = BlockModel(
        bodies,
        young=65e9,
        poisson=0.2,
        density=2700.0,
        joint=Joint(1e10, 1e9, 0.6, 1e5, 0.0, 0.0, np.inf),
        rounding=0.05,
        dt=1e-2,
    )
    with pytest.raises(NumericsFailed, match="consolidation"):
        consolidate(model, -0.5e6, -0.25e6, tolerance=1e-12, limit=250)


def test_loose_blocks_are_found_and_stopped():
    # Two blocks rest on each other, a third flies off.
    shapes = [rectangle(0, 0, 1, 1), rectangle(0, 1, 1, 2), rectangle(1.2, 1, 2.2, 2)]
    bodies = build_bodies(from_polygons(shapes, rectangle(0, 0, 2.2, 2)))
    joint = Joint(1e9, 1e9, 0.6, 0.0, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies, young=1e9, poisson=0.2, density=2500.0, joint=joint, rounding=0.02, damping=Damping(ratio=-1.0)
    )
    model.hold(bodies.vertex_block == 0, 1)
    model.motion.v[bodies.vertex_block == 2, 0] = 0.5
    model.motion.v[bodies.vertex_block == 1, 1] = -0.01
    model.advance(4)
    loose = model.loose_blocks()
    assert loose.tolist() == [False, False, True]
    assert model.kinetic_energy(loose) == pytest.approx(0.5 * 2500.0 * 0.25, rel=1e-9)
    before = model.energies()
    model.calm_loose_blocks()
    after = model.energies()
    assert model.kinetic_energy(loose) < 1e-15 * before["kinetic"]
    assert after["error"] == pytest.approx(before["error"], abs=1e-9)
    place = model.motion.x[bodies.vertex_block == 2].copy()
    model.advance(100)
    assert model.motion.x[bodies.vertex_block == 2] == pytest.approx(place, rel=0, abs=1e-12)


def test_wrong_properties_are_refused():
    bodies = build_bodies(voronoi_blocks(rectangle(0, 0, 2, 2), 0.5, seed=1))
    joint = Joint(1e10, 1e9, 0.6, 1e5, 0.0, 0.0, np.inf)
    with pytest.raises(ValueError, match="young"):
        BlockModel(bodies, young=-1.0, poisson=0.2, density=2700.0, joint=joint, rounding=0.05)
    with pytest.raises(ValueError, match="poisson"):
        BlockModel(bodies, young=1e9, poisson=0.5, density=2700.0, joint=joint, rounding=0.05)
    with pytest.raises(ValueError, match="upright rectangle"):
        rectangle_sides(np.array([(0, 0), (2, 0), (1, 1.0)]))


@pytest.mark.parametrize("guided", [False, True])
@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_that_dead_loads_drive_off_is_stopped_and_others_run_away(guided, rigid):
    shapes = [rectangle(0, 0, 1, 1), rectangle(3, 0, 4, 1)]
    bodies = build_bodies(from_polygons(shapes, rectangle(0, 0, 4, 1)))
    joint = Joint(1e9, 1e9, 0.6, 0.0, 0.0, 0.0, np.inf)
    keys = {"young": 1e9, "poisson": 0.2, "density": 2500.0, "joint": joint, "rounding": 0.05, "dt": 1e-3}
    model = BlockModel(bodies, **keys, rigid=rigid)
    off = bodies.vertex_block == 1
    if guided:  # as by a roller: it still flies along
        model.hold(off & (bodies.position[:, 1] == 1.0), 1)
    model.skeleton.steady[off, 0] = 1e5
    model.advance(20_000)
    assert model.flown_at[0] == np.inf and 0.0 < model.flown_at[1] < model.time
    assert np.hypot(*model.motion.v.T).max() <= 0.11 * model.fastest
    e = model.energies()
    assert abs(e["error"]) < 0.01 * e["external"]
    again = BlockModel(bodies, **keys, rigid=rigid, gravity=(0.0, -1e-9))
    again.skeleton.steady[off, 0] = 1e5
    with pytest.raises(NumericsFailed, match="speed"):
        again.advance(40_000)


def test_loads_of_every_kind_are_seen_when_they_come():
    # A step passes over blocks without loads; each of these pushes its block all the same.
    shapes = [rectangle(2 * k, 0, 2 * k + 1, 1) for k in range(3)]
    bodies = build_bodies(from_polygons(shapes, rectangle(0, 0, 5, 1)))
    joint = Joint(1e9, 1e9, 0.6, 0.0, 0.0, 0.0, np.inf)
    model = BlockModel(
        bodies, young=1e9, poisson=0.2, density=2500.0, joint=joint, rounding=0.05, damping=Damping(ratio=-1.0)
    )
    model.advance(5)
    assert not model.motion.v.any()
    model.skeleton.steady[bodies.vertex_block == 0, 0] = 1e3
    model.skeleton.rising[bodies.vertex_block == 2, 1] = 1e3
    model.set_load(1.0)
    model.advance(5)
    for block, pushed in enumerate(([True, False], [False, False], [False, True])):
        there = bodies.vertex_block == block
        mean = np.average(model.motion.v[there], axis=0, weights=model.true_mass[there])
        assert (np.abs(mean) > 1e-6).tolist() == pushed
