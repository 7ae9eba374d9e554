"""Beds: counts, balance of forces, refusals, failures."""

from dataclasses import replace

import numpy as np
import pytest

from graben.errors import NumericsFailed, Refused
from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.bed import HISTORY, BedRecipe, _Run, make_bed, numbers
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.particles.sampling import interval_over_areas, interval_over_beds

D = 1e-4


def law(sizes=(D,), pressure=30.0, overlap=0.005) -> LinearLaw:
    stiffness = 2.0 * pressure * min(sizes) / overlap
    size = np.array(sizes)
    return LinearLaw(size / 2, np.full(size.shape, 2200.0), np.full(size.shape, stiffness), 10.0 * stiffness)


def recipe(**changes) -> BedRecipe:
    return replace(BedRecipe(np.array([1.0]), (6 * D, 6 * D), 4 * D, 30.0, safety=0.6, balance=3e-3), **changes)


@pytest.fixture(scope="module")
def bed():
    return make_bed(law(), recipe(), seed=4)


def test_forces_balance(bed):
    column = dict(zip(HISTORY, bed.history.T))
    weight = law().mass[0] * 9.81 * len(bed.radius)
    push = 30.0 * bed.area
    assert bed.floor_force.sum() == pytest.approx(weight + push, rel=5e-3)
    assert column["piston_push"][-1] == pytest.approx(push, rel=5e-3)
    assert bed.survey.unbalanced < 3e-3
    assert bed.energy_error < 0.03
    assert 0.0 < bed.step_over_critical < 1.0


def test_what_touches_the_floor_lies_on_it(bed):
    touching = bed.floor_force > 0.0
    assert np.all(bed.position[touching, 2] < bed.radius[touching])
    assert bed.floor_count(1)[0] == touching.sum()
    assert 0.8 < touching.sum() * D**2 / bed.area < 1.155  # the hexagonal layer is an upper bound
    assert 0.55 < bed.solid_fraction < 0.68


def test_contacts_and_coordination_agree(bed):
    walls = (bed.floor_force > 0.0).sum() + (bed.position[:, 2] + bed.radius > bed.piston_height).sum()
    assert bed.coordination.sum() == 2 * len(bed.pair) + walls
    gap = bed.position[bed.pair[:, 1]] - bed.position[bed.pair[:, 0]]
    gap[:, :2] -= 6 * D * np.rint(gap[:, :2] / (6 * D))
    assert np.all(np.linalg.norm(gap, axis=1) < D)
    assert bed.push.min() > 0.0


def test_two_sizes_in_a_shaken_box_with_walls():
    """Everything else at once: classes, hard walls, shaking."""
    both = make_bed(
        law((D, 0.6 * D)),
        recipe(
            share=np.array([0.5, 0.5]), periodic=False, shakes=3, shake_amplitude=0.1 * D,
            shake_frequency=float(np.sqrt(2 * 9.81 / (0.1 * D)) / (2 * np.pi)), balance=1e-2,
        ),
        seed=1,
    )  # fmt: skip
    assert list(both.states) == ["inserted", "settled", "shaken", "pressed", "quenched"]
    assert both.floor_count(2).min() > 0
    assert np.all(both.position[:, :2] > 0.0) and np.all(both.position[:, :2] < 6 * D)
    assert dict(zip(HISTORY, both.history[-1]))["floor_work"] != 0.0
    assert both.energy_error < 0.05


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"depth": 1e-9}, "empty"),
        ({"share": np.array([0.7])}, "sum 1"),
        ({"pressure": -1.0}, "pressure"),
        ({"gravity": 0.0}, "gravity"),
        ({"width": (1e-4, 1e-4), "depth": 1e-2}, "periodic box"),
    ],
)
def test_impossible_recipes(changes, words):
    with pytest.raises(ValueError, match=words):
        make_bed(law(), recipe(**changes), seed=0)


def test_a_bed_between_rough_walls_rests_though_its_floor_alone_does_not_carry_the_weight():
    rough = make_bed(
        replace(law(), friction=0.5, wall_friction=0.8),
        recipe(width=(4 * D, 4 * D), depth=8 * D, periodic=False, balance=5e-3, rest=1e-2),
        seed=2,
    )
    assert rough.wall_share_of_weight != 0.0
    assert rough.floor_share_of_weight + rough.wall_share_of_weight == pytest.approx(1.0, abs=0.021)
    column = dict(zip(HISTORY, rough.history[-1]))
    weight = rough.radius.size * law().mass[0] * 9.81
    load = weight + column["piston_push"]
    assert column["floor_push"] + column["wall_lift"] == pytest.approx(load, rel=0.021)
    assert rough.survey.unbalanced < 5e-3


def test_a_grain_jammed_between_rough_walls_hangs_on_them():
    """Statics: four walls push with k times the overlap and lift together with the weight; the floor has nothing."""
    rough = replace(law(), friction=0.5, wall_friction=0.5, damping=0.9, shear_damping=0.9)
    width = 0.999 * D
    box = Assembly(rough, np.array([[width / 2, width / 2, 2 * D]]), np.array([0]), (width, width), periodic=False)
    box.advance(20_000)
    state, floor_force, _ = box.survey()
    weight = rough.mass[0] * 9.81
    assert state.wall_lift == pytest.approx(weight, rel=1e-6)
    assert state.floor_push == 0.0 and floor_force.sum() == 0.0
    sunk = weight / (4.0 * rough.walls.kt[0, 0])
    assert box.bodies.position[0, 2] == pytest.approx(2 * D - sunk, abs=1e-3 * sunk)


@pytest.mark.parametrize("walls", [True, False])
@pytest.mark.parametrize("depth", [0.03 * D, 0.3 * D, D])
def test_single_grains_and_less_than_a_layer_come_to_rest(walls, depth):
    made = make_bed(
        replace(law(), friction=0.4, wall_friction=0.4), recipe(depth=depth, periodic=not walls, rest=1e-2), seed=1
    )
    assert made.floor_count(1)[0] > 0
    assert made.floor_share_of_weight + made.wall_share_of_weight == pytest.approx(1.0, abs=0.021)
    assert np.abs(made.velocity).max() < 0.05 * np.sqrt(9.81 * D)


def test_a_bed_in_the_air_is_not_at_rest():
    """Grains that have not landed have no contact and little speed: no rest, and the reason is told."""
    fall = _Run(law(), recipe(), 0, lambda fraction, message: None)
    state, _, _ = fall.box.survey()
    assert "unbalanced" in fall.unrest(state, 1.0)
    hanging = replace(state, mean_contact_force=1.0, mean_net_force=0.0, kinetic=0.0, floor_push=0.0)
    assert "floor and walls carry 0 N" in fall.unrest(hanging, 1.0)
    rolling = replace(hanging, kinetic=1.0, floor_push=1.0)
    assert "grains move" in fall.unrest(rolling, 1.0)


def test_a_bed_that_does_not_come_to_rest_says_so():
    with pytest.raises(NumericsFailed, match="did not come to rest"):
        make_bed(law(), recipe(max_steps=1000), seed=0)


def test_lost_energy_stops_the_run():
    with pytest.raises(NumericsFailed, match="energy balance"):
        make_bed(law(), recipe(energy_limit=1e-9), seed=0)


def test_soft_grains_stop_the_run():
    with pytest.raises(NumericsFailed, match="overlap"):
        make_bed(law(pressure=0.05), recipe(pressure=3000.0), seed=0)


def test_nothing_that_takes_energy_is_refused():
    with pytest.raises(Refused, match="damping"):
        make_bed(replace(law(), damping=0.0), recipe(), seed=0)


def test_numbers_follow_volume_shares():
    found = numbers(law((D, D / 2)), recipe(share=np.array([0.75, 0.25]), width=(20 * D, 20 * D)))
    volume = found * np.array([1.0, 0.125])
    np.testing.assert_allclose(volume / volume.sum(), [0.75, 0.25], atol=2e-3)


def test_intervals_cover_the_truth():
    """Counts of a Poisson process: nine of ten times at least, the 95 % interval holds the density."""
    rng = np.random.Generator(np.random.PCG64(0))
    inside = 0
    for _ in range(200):
        n = rng.poisson(100.0)
        _, low, high = interval_over_areas(rng.random((n, 2)), np.zeros(n, int), 1, (1.0, 1.0), 4)
        inside += bool(low[0] <= 100.0 <= high[0])
    assert 180 <= inside <= 200
    mean, low, high = interval_over_beds(np.array([[1.0], [2.0], [3.0]]))
    assert mean[0] == 2.0
    assert high[0] - 2.0 == pytest.approx(4.302653 / np.sqrt(3.0))
    assert low[0] == 0.0  # 2 - 2.48, cut at zero
