"""Blocks against closed forms: waves, joints that pass them, jointed moduli, a joint's cycle."""

import numpy as np
import pytest

from graben.mechanics.averaging.network import build_network
from graben.mechanics.averaging.outline import find_outline
from graben.mechanics.averaging.rev import Circle
from graben.mechanics.averaging.strain import outline_gradient
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.shape.bodies import Bodies, build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

E, NU, RHO = 65e9, 0.2, 2700.0
GLUED = Joint(1e12, 1e12, 0.0, 1e12, 1e12, 0.0, np.inf)


def strips(lengths, height, cell):
    """Rectangular blocks in a row, each meshed evenly with pairs of triangles."""
    position, zone, start, block, zone_block = [], [], [], [], []
    corner, count = [], []
    left, offset = 0.0, 0
    for b, length in enumerate(lengths):
        nx, ny = round(length / cell), max(1, round(height / cell))
        xs, ys = np.meshgrid(left + np.linspace(0, length, nx + 1), np.linspace(0, height, ny + 1))
        position.append(np.column_stack([xs.ravel(), ys.ravel()]))
        index = offset + np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
        a, c, d, e = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
        zone += [np.column_stack([a, c, d]), np.column_stack([a, d, e])]
        zone_block += [np.full(2 * len(a), b)]
        loop = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
        start.append(loop)
        block.append(np.full(index.size, b))
        corner.append([index[0, 0], index[0, -1], index[-1, -1], index[-1, 0]])
        count.append(length * height)
        left, offset = left + length, offset + index.size
    x = np.vstack(position)
    total = left
    outline = np.array([(0, 0), (total, 0), (total, height), (0, height)])
    edge_from = np.concatenate(start)
    edge_to = np.concatenate([np.roll(s, -1) for s in start])
    return Bodies(
        position=x,
        vertex_block=np.concatenate(block),
        block_start=4 * np.arange(len(lengths) + 1),
        block_corner=np.concatenate(corner),
        block_area=np.array(count),
        zone_vertex=np.vstack(zone),
        zone_block=np.concatenate(zone_block),
        edge_from=edge_from,
        edge_to=edge_to,
        outline=outline,
        vertex_side=np.column_stack([x[:, 1] == 0, x[:, 0] == total, x[:, 1] == height, x[:, 0] == 0]),
        edge_side=np.full(len(edge_from), -1),
    )


def undamped(bodies, joint, rounding=1e-4):
    return BlockModel(
        bodies, young=E, poisson=NU, density=RHO, joint=joint, rounding=rounding, damping=Damping(ratio=-1.0)
    )


@pytest.mark.parametrize(("axis", "speed"), [(0, 5172.0), (1, 3167.0)])
def test_wave_speed(axis, speed):
    bodies = strips([40.0], 0.5, 0.25)
    model = undamped(bodies, GLUED)
    model.hold(slice(None), 1 - axis)
    x = bodies.position[:, 0]
    pulse = 20.0 / speed
    probes = [np.isclose(x, p) for p in (10.0, 30.0)]
    peak = np.zeros((2, 2))
    for _ in range(int((35.0 / speed + 0.5 * pulse) / model.dt)):
        t = model.time
        wall = 1e-3 * np.sin(np.pi * t / pulse * 2) ** 2 if t < 0.5 * pulse else 0.0
        model.hold(x == 0.0, axis, wall)
        model.set_speed(1.0)
        model.advance(1)
        for k, probe in enumerate(probes):
            v = model.motion.v[probe, axis].mean()
            if v > peak[k, 0]:
                peak[k] = v, model.time
    assert 20.0 / (peak[1, 1] - peak[0, 1]) == pytest.approx(speed, rel=0.01)
    assert peak[1, 0] == pytest.approx(peak[0, 0], rel=0.03)


@pytest.mark.verify
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_transmission_through_a_joint(ratio):
    # |T| = [1 + (omega Z / 2 k)^2]^(-1/2), Z = rho c_p.
    c = 5172.0
    omega = 2 * np.pi * c / 10.0
    k = omega * RHO * c / (2.0 * ratio)
    joint = Joint(k, k, 0.0, 1e12, 1e12, 0.0, np.inf)
    bodies = strips([30.0, 40.0], 0.5, 0.25)
    model = undamped(bodies, joint)
    model.hold(slice(None), 1)
    x = bodies.position[:, 0]
    behind = np.isclose(x, 35.0)
    seen = []
    amplitude = 1e-4
    while model.time < (35.0 + 50.0) / c:
        t = model.time
        rise = min(1.0, t * omega / (4 * np.pi))
        model.hold(x == 0.0, 0, amplitude * rise * np.sin(omega * t))
        model.set_speed(1.0)
        model.advance(1)
        seen.append((model.time, model.motion.v[behind, 0].mean()))
    t, v = np.array(seen).T
    late = t > (35.0 + 35.0) / c
    fit = np.linalg.lstsq(np.column_stack([np.sin(omega * t), np.cos(omega * t)])[late], v[late], rcond=None)[0]
    assert np.hypot(*fit) / amplitude == pytest.approx((1 + ratio**2) ** -0.5, rel=0.03)


def wall_of_bricks(rows, columns, s):
    shapes = [
        np.array([(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)], float) * s
        for j in range(rows)
        for i in range(columns)
    ]
    return build_bodies(
        from_polygons(shapes, np.array([(0, 0), (columns, 0), (columns, rows), (0, rows)], float) * s)
    )


def relaxed(model, steps=8000):
    model.advance(steps)
    assert model.unbalanced_ratio() < 2e-3


@pytest.mark.parametrize("what", ["normal", "shear"])
def test_moduli_of_jointed_rock(what):
    # 1/E* = 1/E' + 1/(kn s), 1/G* = 1/G + 1/(ks s): E 10 GPa, nu 0.2, kn 5, ks 0.1 GPa/m, s 0.5 m.
    e, nu, kn, ks, s = 10e9, 0.2, 5e9, 0.1e9, 0.5
    rows, height = 6, 3.0
    bodies = wall_of_bricks(rows, 1, s)
    rounding = 1e-3
    model = BlockModel(
        bodies,
        young=e,
        poisson=nu,
        density=2500.0,
        joint=Joint(kn, ks, 0.0, 1e12, 1e12, 0.0, np.inf),
        rounding=rounding,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    top, bottom = bodies.vertex_side[:, 2], bodies.vertex_side[:, 0]
    # Measured between the middles of the lowest and the highest joint-free stretch: rows blocks, rows - 1 joints.
    share = (s - 2 * rounding) / s
    if what == "normal":
        model.hold(bottom, 1)
        model.hold(np.flatnonzero(bottom)[0], 0)
        model.press(bodies.edge_side == 2, -1e4)
        relaxed(model)
        moved = (model.motion.x - bodies.position)[top, 1].mean()
        expected = -1e4 * ((1 - nu**2) / e * height + (rows - 1) / (kn * share))
    else:
        # Simple shear: rotation is kept out by holding y everywhere.
        model.hold(slice(None), 1)
        model.hold(bottom, 0)
        pull = np.flatnonzero(top)
        model.skeleton.steady[pull, 0] = 1e4 * s / len(pull)
        relaxed(model)
        moved = (model.motion.x - bodies.position)[top, 0].mean()
        g = e / (2 * (1 + nu))
        expected = 1e4 * (height / g + (rows - 1) / (ks * share))
    assert moved == pytest.approx(expected, rel=0.02)


def shear_box(friction, normal, dilation=0.0):
    """Two blocks, the lower one held, the upper one pressed down; returns the model and the top's vertices."""
    lower = np.array([(0, 0), (2, 0), (2, 0.5), (0, 0.5)])
    upper = np.array([(0.5, 0.5), (1.5, 0.5), (1.5, 1.0), (0.5, 1.0)])
    bodies = build_bodies(from_polygons([lower, upper], np.array([(0, 0), (2, 0), (2, 1.0), (0, 1.0)])))
    model = BlockModel(
        bodies,
        young=E,
        poisson=NU,
        density=RHO,
        joint=Joint(1e10, 1e9, np.tan(friction), 0.0, 0.0, np.tan(dilation), np.inf),
        rounding=1e-3,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    below = bodies.vertex_block == 0
    model.hold(below, 0)
    model.hold(below, 1)
    over = ~below
    model.hold(over, 0)
    model.press((bodies.edge_side == 2) & over[bodies.edge_from], -normal)
    relaxed(model, 4000)
    return model, over


def test_joint_cycle_takes_the_area_of_its_loop():
    # Sliding to and fro by d: each half cycle after the first takes tau_max (2 d - 2 tau_max / ks), a parallelogram.
    friction, normal, ks, d = np.radians(30), 1e6, 1e9, 2e-3
    model, over = shear_box(friction, normal)
    tau = normal * np.tan(friction)
    steps = 20000
    push, moved = [], []
    for speed, n in ((1e-4, steps), (-1e-4, 2 * steps), (1e-4, 2 * steps)):
        model.hold(over, 0, speed)
        model.set_speed(1.0)
        for _ in range(n // 100):
            model.advance(100)
            push.append(model.motion.reaction[over, 0].sum())
            moved.append(model.motion.x[over, 0].mean())
    push, moved = np.array(push), np.array(moved)
    assert np.abs(push).max() == pytest.approx(tau * 1.0, rel=0.02)
    loop = slice(steps // 100 - 1, None)
    work = float(np.sum(0.5 * (push[loop][1:] + push[loop][:-1]) * np.diff(moved[loop])))
    assert work == pytest.approx(2 * tau * (2 * d - 2 * tau / ks), rel=0.03)
    friction_work = model.energies()["friction"]
    first = tau * (d - tau / ks)
    assert friction_work == pytest.approx(work + first, rel=0.03)


def test_dilation_opens_by_its_angle():
    model, over = shear_box(np.radians(30), 1e6, np.radians(5))
    y0 = model.motion.x[over, 1].mean()
    x0 = model.motion.x[over, 0].mean()
    model.hold(over, 0, 1e-4)
    model.set_speed(1.0)
    model.advance(40000)
    slid = model.motion.x[over, 0].mean() - x0 - 1e6 * np.tan(np.radians(30)) / 1e9
    assert model.motion.x[over, 1].mean() - y0 == pytest.approx(slid * np.tan(np.radians(5)), rel=0.03)


def voronoi_model():
    bodies = build_bodies(voronoi_blocks(4.0 * np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)]), 0.5, seed=4))
    joint = Joint(1e10, 1e9, 0.6, 1e5, 0.0, 0.0, np.inf)
    return BlockModel(bodies, young=E, poisson=NU, density=RHO, joint=joint, rounding=0.05, dt=1e-2)


@pytest.mark.parametrize("radius", [0.6, 1.1, 1.7])
def test_voronoi_patch_under_an_affine_field_is_exact(radius):
    model = voronoi_model()
    b, gradient = model.bodies, np.array([[2e-3, 1e-3], [-4e-4, -3e-3]])
    f = np.eye(2) + gradient
    model.motion.x[:] = b.position @ f.T + [1.0, -2.0]
    # Green's strain, second Piola-Kirchhoff stress, Cauchy stress: the same in every zone.
    strain = 0.5 * (f.T @ f - np.eye(2))
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    s = f @ (lam * np.trace(strain) * np.eye(2) + 2 * mu * strain) @ f.T / np.linalg.det(f)
    expected = [s[0, 0], s[1, 1], lam * np.trace(strain) / np.linalg.det(f), s[0, 1]]
    stress = model.zone_stress()
    assert stress == pytest.approx(np.tile(expected, (len(stress), 1)), abs=1e-12 * E)
    counts = np.diff(b.block_start)
    network = build_network(b.position, len(counts), b.zone_vertex, b.zone_block, counts, b.block_corner)
    outline = find_outline(network, Circle((2.0, 2.0), radius))
    found = outline_gradient(outline.follow(b.position), outline.follow(model.motion.x - b.position))
    assert found == pytest.approx(gradient, abs=1e-14)


def test_rotation_of_all_blocks_loads_neither_zones_nor_joints():
    model = voronoi_model()
    for angle in (0.3, 2.0):
        c, s = np.cos(angle), np.sin(angle)
        model.motion.x[:] = model.bodies.position @ np.array([[c, s], [-s, c]])
        model.motion.v[:] = 0.0
        model.advance(1)
        assert np.abs(model.zone_stress()).max() < 1e-12 * E
        out, _, stored = model.contacts()
        assert len(out) > 100
        # Overlaps of some 1e-15 m.
        assert np.abs(model.motion.joint_force).max() < 1e-13 * model.joints[0].normal_stiffness
        assert stored < 1e-12
