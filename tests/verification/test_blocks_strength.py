"""Blocks against closed forms: strength with inclined joints, rock with two sets, a disc, a block that topples."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.loads import pressure_forces
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.joint_sets import JointSet, cut_by_sets
from graben.mechanics.blocks.shape.mending import mend
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

E, NU, RHO = 65e9, 0.2, 2700.0


def rectangle(width, height, x=0.0, y=0.0):
    return np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], dtype=float)


def on_side(bodies, which, tolerance=1e-9):
    """Vertices and outline edges on the bottom, right, top or left of an upright rectangle."""
    axis, end = {"bottom": (1, 0), "right": (0, 1), "top": (1, 1), "left": (0, 0)}[which]
    at = (bodies.outline.min(axis=0), bodies.outline.max(axis=0))[end][axis]
    vertex = np.abs(bodies.position[:, axis] - at) < tolerance
    return vertex, vertex[bodies.edge_from] & vertex[bodies.edge_to]


def biaxial_curve(bodies, joints, between, s3, shortening, steps=30000):
    """Vertical compression [Pa] of the top at 60 moments, shortened under lateral pressure s3."""
    model = BlockModel(
        bodies,
        young=E,
        poisson=NU,
        density=RHO,
        joint=joints[0],
        more_joints=joints[1:],
        edge_set=bodies.edge_set,
        set_between=between,
        rounding=1e-3,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    (bottom, _), (top, top_edge) = on_side(bodies, "bottom"), on_side(bodies, "top")
    model.hold(bottom, 1)
    model.hold(bottom, 0)
    for side in ("left", "right"):
        model.press(on_side(bodies, side)[1], -s3)
    model.press(top_edge, -s3)
    model.advance(4000)
    model.skeleton.steady[top, 1] = 0.0
    model.hold(top, 1, -shortening / (steps * model.dt))
    model.set_speed(1.0)
    push = []
    for _ in range(60):
        model.advance(steps // 60)
        push.append(-model.motion.reaction[top, 1].sum())
    return np.array(push) / np.ptp(bodies.position[top, 0])


def jaeger(dip, phi, cohesion, s3):
    """Strength of rock with one joint at an angle from the horizontal; infinite where it cannot slip."""
    left = (1.0 - np.tan(phi) / np.tan(dip)) * np.sin(2 * dip) if 0.0 < dip < np.pi / 2 else 0.0
    return s3 + 2 * (cohesion + s3 * np.tan(phi)) / left if left > 1e-9 else np.inf


@pytest.mark.verify
@pytest.mark.parametrize("dip", [*range(0, 91, 10), 35, 45, 55, 61, 65, 75, 85])
def test_strength_of_rock_with_one_inclined_joint(dip):
    phi, cohesion, s3, w = np.radians(30), 0.2e6, 1e6, 1.0
    beta = np.radians(dip)
    expected = jaeger(beta, phi, cohesion, s3)
    # The joint leaves through the sides, not through the platens; upright, it stands from one to the other.
    h = 3.0 if dip == 90 else max(3.0, w * np.tan(beta) + 1.0)
    if dip == 90:
        shapes = [rectangle(0.5 * w, h), rectangle(0.5 * w, h, 0.5 * w)]
    else:
        rise = 0.5 * w * np.tan(beta)
        a, b = (0.0, 0.5 * h - rise), (w, 0.5 * h + rise)
        shapes = [np.array([(0, 0), (w, 0), b, a]), np.array([a, b, (w, h), (0, h)])]
    bodies = build_bodies(from_polygons(shapes, rectangle(w, h)), 0.5)
    joint = Joint(1e11, 1e11, np.tan(phi), cohesion, 0.0, 0.0, np.inf)
    target = min(expected, 15e6)
    # Twice what rock and joint would give elastically.
    shortening = 2.0 * (target / E * h + target / 1e11)
    # A tall specimen swings for longer.
    push = biaxial_curve(bodies, [joint], None, s3, shortening, 30000 if h < 8.0 else 90000)
    if np.isfinite(expected):
        assert push.max() == pytest.approx(expected, rel=0.02)
        assert push[-1] == pytest.approx(push.max(), rel=0.03)
    else:
        # It sticks: the rock goes on as stiff as at first, far beyond the strength at other angles.
        rise = np.diff(push[10:])
        assert push[-1] > 20e6
        assert rise.min() > 0.95 * rise[:10].mean()


def cut_rock(outline, sets, seed):
    shapes, marks = (list(part) for part in zip(*cut_by_sets(outline, sets, seed)))
    return mend(shapes, marks, shortest=0.02, thinnest=0.02)


@pytest.mark.verify
def test_one_weak_set_among_strong_ones_decides_by_its_friction():
    dip, phi, cohesion, s3, w, h = np.radians(58), np.radians(24), 0.1e6, 1e6, 1.0, 6.0
    blocks = cut_rock(rectangle(w, h), [JointSet(dip, 0.8), JointSet(np.radians(8), 1.0)], seed=3)
    bodies = build_bodies(blocks, 0.5)
    none, weak, strong = (
        Joint(1e11, 1e11, np.tan(f), c, 0.0, 0.0, np.inf)
        for f, c in ((np.radians(45), 50e6), (phi, cohesion), (np.radians(45), 50e6))
    )
    between = np.array([[0, 1, 2], [1, 1, 1], [2, 1, 2]])
    expected = jaeger(dip, phi, cohesion, s3)
    shortening = 3.0 * expected * (h / E + 8 / 1e11)
    push = biaxial_curve(bodies, [none, weak, strong], between, s3, shortening)
    assert push.max() == pytest.approx(expected, rel=0.02)
    # With the properties of the sets exchanged it stands.
    other = np.array([[0, 1, 2], [1, 1, 2], [2, 2, 2]])
    push = biaxial_curve(bodies, [none, strong, weak], other, s3, shortening)
    assert push[-1] > 1.5 * expected


def test_two_sets_of_different_stiffness_make_the_rock_orthotropic():
    # 1 / E_n = (1 - nu^2) / E + 1 / (kn s) across each set: rock and joints in series.
    e, nu, kn, s, size = 10e9, 0.2, (5e9, 1.5e9), (1.0, 0.5), 4.0
    blocks = cut_rock(rectangle(size, size), [JointSet(0.0, s[0]), JointSet(np.pi / 2, s[1])], seed=1)
    bodies = build_bodies(blocks)
    joints = [Joint(k, 0.2 * k, 0.0, 1e12, 1e12, 0.0, np.inf) for k in (1e12, *kn)]
    for across, low, high in ((0, "bottom", "top"), (1, "left", "right")):
        model = BlockModel(
            bodies,
            young=e,
            poisson=nu,
            density=2500.0,
            joint=joints[0],
            more_joints=joints[1:],
            edge_set=bodies.edge_set,
            rounding=1e-3,
            dt=1e-3,
            damping=Damping(ratio=1.0),
        )
        axis = 1 - across
        held, (loaded, edges) = on_side(bodies, low)[0], on_side(bodies, high)
        model.hold(held, axis)
        model.press(edges, -1e5)
        model.advance(15000)
        assert model.unbalanced_ratio() < 2e-3
        moved = -(model.motion.x - bodies.position)[loaded, axis].mean() / size
        cuts = len(np.unique(np.round(bodies.position[:, axis], 6))) - 2
        # Cut corners do not bear.
        rows = len(np.unique(np.round(bodies.position[:, 1 - axis], 6))) - 1
        share = 1.0 - 2e-3 * rows / size
        assert cuts == size / s[across]
        expected = (1 - nu**2) / e + cuts / size / (kn[across] * share)
        assert moved == pytest.approx(1e5 * expected, rel=0.02)


def test_brazilian_disc():
    # Two forces P at the ends of a diameter: -2 P cos(theta) / (pi r) along each ray, and P / (pi R) all round. In
    # the middle 2 P / (pi D) across and -6 P / (pi D) along; strips: integrated over their angle.
    sides, radius = 48, 0.5
    angle = np.pi / 2 + (np.arange(sides) + 0.0) * 2 * np.pi / sides
    disc = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    bodies = build_bodies(voronoi_blocks(disc, 0.1, seed=2), 0.04)
    model = BlockModel(
        bodies,
        young=E,
        poisson=NU,
        density=RHO,
        joint=Joint(1e13, 1e13, 1.0, 1e12, 1e12, 0.0, np.inf),
        rounding=1e-3,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    p, alpha = 1e6, 2 * np.pi / sides
    force = 2.0 * p * radius * alpha
    for corner in (0, sides // 2):
        for k in (corner - 1, corner):
            model.skeleton.steady[:] += p * pressure_forces(bodies, disc[k], disc[(k + 1) % sides])
    total = model.skeleton.steady[:, 1]
    assert abs(total.sum()) < 1e-9 * np.abs(total).sum()
    model.advance(6000)
    assert model.unbalanced_ratio() < 5e-3
    stress = model.zone_stress()
    middle = bodies.position[bodies.zone_vertex].mean(axis=1)
    near = np.hypot(*middle.T) < 0.2 * radius
    mean = np.average(stress[near], axis=0, weights=model.zone_area[near])
    expected = np.zeros(2)
    strip = np.pi / 2 + alpha * (2 * (np.arange(20) + 0.5) / 20 - 1)
    for end in radius * np.column_stack([np.cos(strip), np.sin(strip)]):
        for a in (end, -end):
            ray = middle[near] - a
            r = np.hypot(*ray.T)
            along = -2.0 * (force / 20) / np.pi * (ray @ (-a / radius)) / r**2
            expected += np.average(along[:, None] * (ray / r[:, None]) ** 2, axis=0, weights=model.zone_area[near])
    expected += force / (np.pi * radius)
    assert mean[:2] == pytest.approx(expected, rel=0.03)
    assert expected == pytest.approx(force / (np.pi * radius) * np.array([1.0, -3.0]), rel=0.1)


@pytest.mark.parametrize(("slope", "falls"), [(0.95, False), (1.05, True)])
def test_a_slender_deformable_block_topples_at_its_limit(slope, falls):
    # tan(slope) = breadth of the base / height: the weight then points at the edge.
    b, h, rounding, g = 0.4, 1.2, 0.01, 9.81
    base = rectangle(2.0, 0.4)
    block = rectangle(b, h, 0.8, 0.4)
    bodies = build_bodies(from_polygons([base, block], rectangle(2.0, 1.6)), 0.45)
    model = BlockModel(
        bodies,
        young=1e8,
        poisson=0.2,
        density=2500.0,
        joint=Joint(1e9, 1e9, np.tan(np.radians(45)), 0.0, 0.0, 0.0, np.inf),
        rounding=rounding,
        gravity=(0.0, -g),
        damping=Damping(ratio=0.5),
    )
    model.hold(bodies.vertex_block == 0, 0)
    model.hold(bodies.vertex_block == 0, 1)
    model.advance(3000)
    # Tilted slowly, by turning the weight.
    limit = np.arctan((b - 2 * rounding) / h)
    mass = model.true_mass
    for turn in np.linspace(0.0, slope * limit, 41)[1:]:
        model.skeleton.steady[:] = mass[:, None] * g * np.array([np.sin(turn), -np.cos(turn)])
        model.advance(200)
    model.advance(12000)
    own = np.flatnonzero(bodies.vertex_block == 1)
    x, y = bodies.position[own].T
    foot, head = own[(y < 0.41) & (x < 0.81)], own[(y > 1.59) & (x < 0.81)]
    lean = np.arctan2(*(model.motion.x[head] - model.motion.x[foot])[0])
    assert (lean > np.radians(20)) == falls
    if not falls:
        assert lean < np.radians(1)
        assert model.unbalanced_ratio() < 0.05
