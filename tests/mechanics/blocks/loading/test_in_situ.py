"""In-situ stress meets its vertices in balance; blocks taken out let go of what they held."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.excavation import blocks_in
from graben.mechanics.blocks.loading.in_situ import InSitu, put_in
from graben.mechanics.blocks.loading.rest import imbalance
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.joint_sets import JointSet, cut_by_sets
from graben.mechanics.blocks.shape.mending import mend
from graben.mechanics.blocks.shape.rectangle import rectangle_sides
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

SQUARE = np.array([(0, 0), (4, 0), (4, 4), (0, 4)], dtype=float)
JOINT = Joint(10e9, 1e9, 0.7, 1e6, 0.0, 0.1, np.inf)
STIFFENS = JOINT._replace(closure=1e-4)
G = 9.81


def blocks(kind):
    if kind == "voronoi":
        return build_bodies(voronoi_blocks(SQUARE, 0.6, seed=3))
    if kind == "refined":
        return build_bodies(voronoi_blocks(SQUARE, 0.9, seed=3), 0.3)
    sets = [JointSet(0.3, 0.7), JointSet(1.9, 0.6, 0.5)]
    shapes = [ring for ring, _ in cut_by_sets(SQUARE, sets, 2)]
    return build_bodies(mend(shapes, shortest=0.05, thinnest=0.05))


def standing(kind, joint=JOINT, gravity=(0.0, 0.0), **more):
    """A square on rollers at the sides and the bottom."""
    bodies = blocks(kind)
    model = BlockModel(
        bodies, young=20e9, poisson=0.2, density=2500.0, joint=joint, rounding=0.05, dt=1e-2, gravity=gravity, **more
    )
    sides = rectangle_sides(bodies.outline)
    for side, axis in ((sides.bottom, 1), (sides.left, 0), (sides.right, 0)):
        model.hold(bodies.vertex_side[:, side], axis)
    return model


@pytest.mark.parametrize("joint", [JOINT, STIFFENS])
@pytest.mark.parametrize("kind", ["voronoi", "refined", "sets"])
def test_uniform_stress_under_balancing_pressures_does_not_move(kind, joint):
    bodies = blocks(kind)
    model = BlockModel(bodies, young=20e9, poisson=0.2, density=2500.0, joint=joint, rounding=0.05, dt=1e-2)
    sigma = np.array([[-5e6, 1e6], [1e6, -3e6]])
    put_in(model, InSitu((-5e6, -3e6, 1e6)))
    for side in range(4):
        on = bodies.edge_side == side
        d = bodies.position[bodies.edge_to[on]] - bodies.position[bodies.edge_from[on]]
        half = 0.5 * np.column_stack([d[:, 1], -d[:, 0]]) @ sigma
        np.add.at(model.skeleton.steady, bodies.edge_from[on], half)
        np.add.at(model.skeleton.steady, bodies.edge_to[on], half)
    model.advance(1)
    assert model.unbalanced_ratio() < 1e-9
    model.advance(500)
    assert np.abs(model.motion.x - bodies.position).max() < 1e-10
    stress = model.zone_stress()
    assert stress[:, [0, 1, 3]] == pytest.approx(np.tile([-5e6, -3e6, 1e6], (len(stress), 1)), rel=1e-6)


@pytest.mark.parametrize("kind", ["voronoi", "sets"])
def test_weight_and_k0_stand_from_the_start(kind):
    model = standing(kind, gravity=(0.0, -G))
    k0, rise = 0.8, 2500.0 * G
    put_in(model, InSitu((0.0, 0.0, 0.0), (k0 * rise, rise, 0.0), level=4.0))
    model.advance(1)
    assert model.unbalanced_ratio() < 1e-9
    model.advance(500)
    z = model.skeleton.zones
    depth = 4.0 - model.bodies.position[z.triangles][..., 1].mean(axis=1)
    stress = model.zone_stress()
    assert stress[:, 1] == pytest.approx(-rise * depth, abs=10.0)
    assert stress[:, 0] == pytest.approx(-k0 * rise * depth, abs=10.0)
    assert np.abs(model.motion.x - model.bodies.position).max() < 1e-10


def test_without_in_situ_stress_nothing_is_kept_and_soft_rock_is_refused():
    model = standing("voronoi")
    assert len(model.pairs.seat) == 0
    with pytest.raises(ValueError, match="5 %"):
        put_in(model, InSitu((-5e9, 0.0, 0.0)))


def column(**more):
    shapes = [np.array([(0, j), (1, j), (1, j + 1), (0, j + 1)], float) for j in range(4)]
    bodies = build_bodies(from_polygons(shapes, np.array([(0, 0), (1, 0), (1, 4), (0, 4)], float)))
    model = BlockModel(
        bodies,
        young=20e9,
        poisson=0.0,
        density=2500.0,
        joint=JOINT._replace(cohesion=0.0),
        rounding=0.01,
        gravity=(0.0, -G),
        **more,
    )
    model.hold(bodies.vertex_side[:, 0], 1)
    model.hold(bodies.vertex_side[:, 1], 0)
    model.hold(bodies.vertex_side[:, 3], 0)
    put_in(model, InSitu((0.0, 0.0, 0.0), (0.0, 2500.0 * G, 0.0), level=4.0))
    return model


def test_a_column_whose_support_is_taken_out_falls():
    model = column(damping=Damping(ratio=-1.0))
    model.advance(200)
    assert np.abs(model.motion.v).max() < 1e-8
    lowest = blocks_in(model, np.array([(-1, 0.2), (2, 0.2), (2, 0.8), (-1, 0.8)]))
    assert lowest.tolist() == [True, False, False, False]
    held = model.remove(lowest)
    # It bore what stands on it.
    assert held.sum(axis=0) == pytest.approx([0.0, 3 * 2500.0 * G], abs=1.0)
    error = model.energies()["error"]
    start = model.time
    model.advance(round(0.1 / model.dt))
    there = ~lowest[model.bodies.vertex_block]
    # Blocks spring apart as they let go: their mean falls freely.
    mass, fell = model.true_mass[there], model.motion.x[there, 1] - model.bodies.position[there, 1]
    time = model.time - start
    assert (mass * fell).sum() / mass.sum() == pytest.approx(-0.5 * G * time**2, rel=0.01)
    assert not model.motion.v[~there].any()
    assert not model.boundary_force()[~there].any()
    energy = model.energies()
    assert energy["excavated"] > 0.0
    assert abs(energy["error"] - error) < 1e-3 * energy["kinetic"]
    assert not model.zone_stress()[lowest[model.bodies.zone_block]].any()


def test_forces_of_what_was_taken_out_can_stand_in_for_it():
    model = column()
    model.advance(200)
    lowest = np.array([True, False, False, False])
    held = model.remove(lowest)
    model.skeleton.steady[:] += held
    before = model.motion.x.copy()
    model.advance(500)
    assert np.abs(model.motion.x - before).max() < 1e-8


def test_a_model_with_a_hole_is_brought_back_bitwise():
    def dug():
        model = standing("voronoi", gravity=(0.0, -G))
        put_in(model, InSitu((0.0, 0.0, 0.0), (0.5 * 2500.0 * G, 2500.0 * G, 0.0), level=4.0))
        return model

    model = dug()
    model.advance(100)
    model.remove(blocks_in(model, np.array([(1, 1), (3, 1), (3, 3), (1, 3)], float)))
    model.advance(500)
    state = snapshot.take(model)
    again = dug()
    snapshot.bring_back(again, state)
    for m in (model, again):
        m.advance(700)
    for name, value in snapshot.take(model).items():
        assert np.array_equal(value, snapshot.take(again)[name]), name
    assert model.energies() == again.energies()
    assert imbalance(model) < 1.0
