"""Beds: counts, balance of forces, refusals, failures."""

from dataclasses import replace

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.particles.bed import HISTORY, BedRecipe, make_bed, numbers
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


def test_a_bed_that_does_not_come_to_rest_says_so():
    with pytest.raises(NumericsFailed, match="did not come to rest"):
        make_bed(law(), recipe(max_steps=1000), seed=0)


def test_lost_energy_stops_the_run():
    with pytest.raises(NumericsFailed, match="energy balance"):
        make_bed(law(), recipe(energy_limit=1e-9), seed=0)


def test_soft_grains_stop_the_run():
    with pytest.raises(NumericsFailed, match="overlap"):
        make_bed(law(pressure=0.05), recipe(pressure=3000.0), seed=0)


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
