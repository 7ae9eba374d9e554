"""Loads and wall speeds that run over time: courses, unloading, cycles; held against closed forms."""

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel, Damping
from graben.mechanics.blocks.loading.biaxial import Courses, compress, consolidate
from graben.mechanics.blocks.loading.courses import Clock, Course
from graben.mechanics.blocks.record.history import History, mean_stress
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons, voronoi_blocks

E, NU, KN, S, ROWS = 10e9, 0.2, 5e9, 0.5, 4
DT = 2e-2


def test_a_course_jumps_and_keeps_its_ends():
    course = Course([(1.0, 2.0), (3.0, 6.0), (3.0, -1.0), (4.0, -1.0)])
    assert [course.at(t) for t in (0.0, 1.0, 2.0, 3.0, 9.0)] == [2.0, 2.0, 4.0, -1.0, -1.0]
    assert [course.slope(t) for t in (0.0, 1.5, 3.5, 5.0)] == [0.0, 2.0, 0.0, 0.0]
    assert [course.next_point(t) for t in (0.0, 1.0, 3.0, 4.0)] == [1.0, 3.0, 4.0, np.inf]
    assert course.integral(5.0) == pytest.approx(2.0 + 8.0 - 2.0)
    assert Course([(0.0, 3.0)], 0.5).at(4.0) == 5.0
    assert course.in_steps(0.3).times.tolist() == [3.0, 10.0, 10.0, 13.0]
    for points in ([], [(1.0, 0.0), (0.0, 0.0)], [(0.0, np.nan)]):
        with pytest.raises(ValueError, match="course"):
            Course(points)


def test_a_clock_stands_while_a_load_jumps():
    """Two jumps of one load, one of another at the same time as the second; a third load has no jump."""
    one = Course([(0.0, 0.0), (2.0, 1.0), (2.0, 5.0), (4.0, 5.0), (4.0, 2.0)], 1.0)
    two = Course([(0.0, 7.0), (4.0, 7.0), (4.0, 9.0)])
    even = Course([(0.0, 0.0)], 0.5)
    clock = Clock([one, two, even], 10.0, 1.0)
    assert clock.jumps.tolist() == [2.0, 4.0] and clock.end == 12.0
    readings = np.array([0.0, 2.0, 2.5, 3.0, 4.0, 5.0, 5.5, 6.0, 12.0])
    assert clock.time(readings).tolist() == [0.0, 2.0, 2.0, 2.0, 3.0, 4.0, 4.0, 4.0, 10.0]
    assert [clock.reading(t) for t in (0.0, 2.0, 3.0, 4.0, 10.0)] == [0.0, 2.0, 4.0, 5.0, 12.0]
    for course, middles in ((one, (3.0, 3.5)), (two, (7.0, 8.0)), (even, (1.0, 2.0))):
        slow = clock.stretched(course)
        assert np.diff(slow.times).min(initial=1.0) > 0.0
        assert [slow.at(2.5), slow.at(5.5)] == pytest.approx(middles)
        for reading in (0.5, 1.5, 3.5, 4.5, 6.5, 11.0):
            assert slow.at(reading) == pytest.approx(course.at(float(clock.time(reading))))
    alone = Clock([even], 10.0, 1.0)
    assert alone.end == 10.0 and alone.stretched(even) is even and alone.time(3.0) == 3.0
    # What jumps at the start is there at the start.
    assert len(Clock([Course([(0.0, 1.0), (0.0, 3.0)])], 10.0, 1.0).jumps) == 0


def loaded(bodies, joint, courses, steps=6000, states=31, **more):
    model = BlockModel(bodies, young=E, poisson=NU, density=2500.0, joint=joint, rounding=1e-3, dt=DT, **more)
    consolidate(model, -1e5, -1e5, tolerance=1e-4)
    history = History(model)
    for _ in compress(model, 0.0, steps, states, courses=courses):
        history.save()
    return model, history.arrays()


def column():
    shapes = [np.array([(0, j), (1, j), (1, j + 1), (0, j + 1)], float) * S for j in range(ROWS)]
    return build_bodies(from_polygons(shapes, np.array([(0, 0), (1, 0), (1, ROWS), (0, ROWS)], float) * S))


def test_a_column_unloads_along_its_modulus_and_feels_the_confinement():
    # 2e-4 down, half of it up again, then the confinement doubles.
    height, steps = ROWS * S, 6000
    v = 3e-4 * height / (0.4 * steps * DT)
    speed = Course([(0, 0.0), (600, -v), (2400, -v), (2400, 0.5 * v), (3600, 0.5 * v), (3600, 0.0)])
    pressure = Course([(0, 1e5), (4200, 1e5), (4800, 3e5)])
    joint = Joint(KN, KN, 0.0, 1e12, 1e12, 0.0, np.inf)
    model, d = loaded(column(), joint, Courses(speed, pressure), steps)
    sigma = mean_stress(d["zone_stress"], model.zone_area, model.zone_area > 0.0)
    strain = np.array([speed.integral(n) for n in np.linspace(0, steps, 31)]) * DT / height
    # Contacts are shorter than edges by two roundings.
    kn = KN * (1.0 - 2e-3 / S)
    modulus = 1.0 / ((1.0 - NU**2) / E + (ROWS - 1) / (kn * ROWS * S))
    assert (sigma[11, 1] - sigma[5, 1]) / (strain[11] - strain[5]) == pytest.approx(modulus, rel=0.01)
    assert (sigma[17, 1] - sigma[13, 1]) / (strain[17] - strain[13]) == pytest.approx(modulus, rel=0.01)
    assert strain[20] == pytest.approx(d["displacement"][20, :, 1].min() / height, rel=1e-9)
    # Held between plates, what pressure from the sides would lengthen is stress: nu (1 + nu) / E of it a strain.
    assert sigma[-1, 0] == pytest.approx(-3e5, rel=0.01)
    pushed = -2e5 * NU * (1.0 + NU) / E * modulus
    assert sigma[-1, 1] - sigma[20, 1] == pytest.approx(pushed, rel=0.03)
    assert abs(d["energy_error"] - d["energy_error"][0]).max() < 2e-3 * d["energy_strain"].max()


def test_a_cycle_of_jointed_rock_loses_what_its_joints_and_damping_took():
    bodies = build_bodies(voronoi_blocks(np.array([(0, 0), (2, 0), (2, 2), (0, 2)], float), 0.5, seed=3))
    v = 3e-3 * 2.0 / (1500 * DT)
    speed = Course([(0, -v), (1500, -v), (1500, v), (2200, v), (2200, -v), (2900, -v), (2900, 0.0)])
    joint = Joint(1e10, 1e9, 0.6, 1e4, 0.0, 0.0, np.inf)
    _, d = loaded(bodies, joint, Courses(speed), steps=3200, states=33)
    work = d["energy_boundary"] + d["energy_external"]
    stored = d["energy_strain"] + d["energy_joint"] + d["energy_kinetic"]
    # From the first turn to the second pass of the same shortening.
    lost = (work[29] - work[15]) - (stored[29] - stored[15])
    taken = (d["energy_friction"] + d["energy_damping"])[[15, 29]]
    assert d["energy_friction"][29] > 1.05 * d["energy_friction"][15]
    assert lost == pytest.approx(taken[1] - taken[0], abs=0.01 * work[29])
    # Unloading is stiffer than what came before: the loop is open.
    push = d["wall_reaction"][:, 2, 1]
    assert push[22] > 0.8 * push[15]


def test_damping_can_be_changed_and_starts_again():
    model, _ = loaded(column(), Joint(KN, KN, 0.0, 1e12, 1e12, 0.0, np.inf), None, 100, 2)
    before = model.damping_coefficient
    model.damp(Damping(ratio=0.7))
    assert model.damping_coefficient == before
    model.damp(Damping(ratio=-1.0, coefficient=3.0))
    model.advance(10)
    assert model.damping_coefficient == 3.0
    model.damp(Damping())
    assert model.damping_coefficient == pytest.approx(0.01 / DT)


def test_a_course_turns_where_it_jumps_or_changes_its_way():
    course = Course([(0, 0.0), (10, 1.0), (20, 3.0), (30, 1.0), (40, 1.0), (40, 2.0), (50, 4.0)])
    turns, time = [], -1.0
    while np.isfinite(time := course.next_turn(time)):
        turns.append(time)
    assert turns == [0.0, 20.0, 30.0, 40.0, 50.0]
    assert Course([(0.0, 5.0)], 1.0).next_turn(0.0) == np.inf
