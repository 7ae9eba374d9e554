"""Laws of joints against closed forms: residual strength, stiffening, dilation that stops, sets of joints."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact import forces, joints, nodes
from graben.mechanics.blocks.contact.joints import BROKEN, OPEN, SLIP, STICK, Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons

FOLLOW = np.array([1, 0, 3, 2])


class Bench:
    """Edge e from (0, 0) to (1, 0), its block above; edge f below, moved along and towards e as told."""

    def __init__(self, joint, intact=1):
        self.table, self.dt = joints.joint_table([joint]), 1.0
        zero = np.zeros((1, 2))
        ones = np.full(1, intact, dtype=np.int8)
        self.pairs = joints.Pairs(
            np.array([2]),
            np.zeros(1, dtype=np.int32),
            np.full(1, 2, dtype=np.int32),
            zero.copy(),
            zero.copy(),
            np.full((1, 2), STICK if intact else OPEN, dtype=np.int8),
            np.ones(1, dtype=np.int8),
            ones,
            np.zeros(1, dtype=np.int16),
        )
        self.at, self.sums = np.zeros(2), np.zeros(2)

    def move(self, along, closure):
        """Normal (compression positive) and shear stress after f moved to `along` and `closure` [m]."""
        step = np.array([along, closure]) - self.at
        self.at += step
        x = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, closure], [0.0, closure]])
        v = np.zeros((4, 2))
        # Edges stay in place along the joint: slip is the integral of their relative velocity.
        v[2:] = step / self.dt
        node = np.zeros((4, nodes.COLUMNS))
        nodes.node_motion(x, v, np.arange(4), np.arange(4), np.zeros(4), FOLLOW, node, 0, 4)
        force, far, rows = np.zeros((4, 2)), np.zeros((1, 4)), forces.empty_rows(1)
        forces.fill_row(rows, 0, self.pairs, 0, FOLLOW, -1)
        bad = forces.contact_forces(rows, 0, 1, node, self.table, 0, 1.0, self.dt, force, 4, far, self.sums)
        forces.settle_rows(rows, 0, 1, self.pairs)
        assert bad == -1
        self.node = node
        return force[:2, 1].sum(), force[:2, 0].sum()

    def stored(self):
        out, ints, fn = np.zeros((1, 13)), np.zeros((1, 2), dtype=np.int64), np.zeros((4, 2))
        return joints.contact_state(self.pairs, FOLLOW, self.node, self.table, 1.0, out, ints, fn)[1], ints[0, 1]


def test_cohesion_is_lost_for_good_when_slip_breaks_a_joint():
    bench = Bench(Joint(1e10, 1e9, 0.5, 1e6, 1e5, 0.0, np.inf, residual_friction=0.3, residual_cohesion=0.0))
    path = np.concatenate(
        [np.linspace(0, 3e-3, 601), np.linspace(3e-3, -1e-3, 801)[1:], np.linspace(-1e-3, 0, 201)[1:]]
    )
    tau = np.array([bench.move(p, 1e-4)[1] for p in path])
    # Peak c + sigma tan(phi), then sigma tan(residual), in both directions.
    assert tau[:602].max() == pytest.approx(1.5e6, rel=1e-2)
    assert tau[600] == pytest.approx(0.3e6, rel=1e-9)
    assert tau[601:].min() == pytest.approx(-0.3e6, rel=1e-9)
    assert np.all(bench.pairs.flag == BROKEN)
    stored, state = bench.stored()
    assert state == BROKEN
    work = float((0.5 * (tau[1:] + tau[:-1]) * np.diff(path)).sum()) + 0.5 * 1e10 * 1e-8
    assert work == pytest.approx(stored + bench.sums[0], rel=5e-3)


def test_cycle_of_an_unbroken_joint_and_its_area():
    bench = Bench(Joint(1e10, 1e9, 0.5, 1e5, 0.0, 0.0, np.inf))
    amplitude, n = 2e-3, 400
    quarter = np.linspace(0.0, amplitude, n + 1)
    path = np.concatenate([quarter, quarter[-2::-1], -quarter[1:], -quarter[-2::-1], quarter[1:]])
    tau = np.array([bench.move(p, 1e-4)[1] for p in path])
    strength = 1e5 + 0.5 * 1e6
    assert tau.max() == pytest.approx(strength, rel=1e-9)
    # The closed loop: a parallelogram of height 2 tau and width 2 (amplitude - tau / ks).
    loop = slice(n, None)
    area = float((0.5 * (tau[loop][1:] + tau[loop][:-1]) * np.diff(path[loop])).sum())
    assert area == pytest.approx(4.0 * strength * (amplitude - strength / 1e9), rel=1e-2)
    assert bench.stored()[1] == SLIP


def test_tension_breaks_once():
    bench = Bench(Joint(1e10, 1e9, 0.5, 1e6, 2e5, 0.0, np.inf))
    assert bench.move(0.0, -1.9e-5)[0] == pytest.approx(-1.9e5)
    assert bench.move(0.0, -2.1e-5) == (0.0, 0.0)
    # The energy that it held, sigma^2 / 2 kn, is gone with it.
    assert bench.sums[0] == pytest.approx(0.5 * 2.1e5**2 / 1e10)
    assert bench.move(0.0, -1.0e-5) == (0.0, 0.0)
    assert bench.move(0.0, 1e-5)[0] == pytest.approx(1e5)
    assert bench.stored()[1] == BROKEN


def test_dilation_stops_at_its_slip():
    bench = Bench(Joint(1e10, 1e9, 0.5, 0.0, 0.0, 0.1, 2e-3))
    normal = [bench.move(p, 1e-4)[0] for p in np.linspace(0, 6e-3, 1201)]
    slip = float(bench.pairs.slip[0, 0])
    assert slip > 2e-3
    # Held at its closure, the joint pushes by the opening that slip would give.
    assert normal[0] == pytest.approx(1e6)
    assert normal[-1] == pytest.approx(1e10 * (1e-4 + 0.1 * 2e-3), rel=1e-9)


def test_joint_stiffens_hyperbolically():
    kn, most = 1e10, 1e-3
    bench = Bench(Joint(kn, 1e9, 0.5, 0.0, 0.0, 0.0, np.inf, closure=most))
    u = np.linspace(0.0, 9e-4, 181)[1:]
    sigma = np.array([bench.move(0.0, c)[0] for c in u])
    bend = most * (1.0 - 10.0**-0.5)
    curved = u < bend
    assert sigma[curved] == pytest.approx(kn * u[curved] / (1.0 - u[curved] / most), rel=1e-9)
    # At ten times its first stiffness it goes on straight.
    assert np.diff(sigma[~curved]) == pytest.approx(10.0 * kn * np.diff(u[~curved]), rel=1e-9)
    fine = np.linspace(0.0, u[-1], 4001)
    values = np.array([joints.closure_stress(c, kn, most) for c in fine])
    assert bench.stored()[0] == pytest.approx(np.trapezoid(values[:, 0], fine), rel=1e-6)


def test_each_set_of_joints_has_its_own_stiffness():
    # Three blocks on top of each other: joint 0 between the lower two, joint 1 between the upper two.
    shapes = [np.array([(0, y), (1, y), (1, y + 1), (0, y + 1.0)]) for y in (0.0, 1.0, 2.0)]
    bodies = build_bodies(from_polygons(shapes, np.array([(0, 0), (1, 0), (1, 3), (0, 3.0)])))
    soft, stiff = Joint(1e9, 1e9, 0.5, 0.0, 0.0, 0.0, np.inf), Joint(4e9, 1e9, 0.5, 0.0, 0.0, 0.0, np.inf)
    middle = 0.5 * (bodies.position[bodies.edge_from] + bodies.position[bodies.edge_to])
    model = BlockModel(
        bodies,
        young=1e12,
        poisson=0.0,
        density=2500.0,
        joint=soft,
        more_joints=[stiff],
        edge_set=(middle[:, 1] > 1.5).astype(int),
        rounding=0.01,
        dt=1e-3,
        damping=Damping(ratio=1.0),
    )
    model.hold(bodies.vertex_side[:, 0], 1)
    model.press(bodies.edge_side == 2, -1e5)
    model.advance(4000)
    assert model.unbalanced_ratio() < 1e-3
    sunk = [-(model.motion.x - bodies.position)[bodies.vertex_block == b, 1].mean() for b in range(3)]
    bearing = 1e5 / 0.98
    assert np.diff(sunk) == pytest.approx([bearing / 1e9, bearing / 4e9], rel=0.01)
    with pytest.raises(ValueError, match="edge_set"):
        BlockModel(bodies, young=1e9, poisson=0.2, density=1.0, joint=soft, rounding=0.01, edge_set=np.ones(3))
