"""Counts of floor contacts in beds against known numbers. Long: `make verify`."""

import numpy as np
import pytest

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.bed import Bed, BedRecipe, make_bed
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.wear.counts import contacts_per_area

D = 1e-4


def beds(count: int, width: float, sizes=(1.0,), share=(1.0,), overlap=0.001, depth=6.0, **changes) -> list[Bed]:
    diameter = np.array(sizes) * D
    stiffness = 2.0 * 30.0 * diameter.min() / overlap
    law = LinearLaw(
        diameter / 2, np.full(diameter.shape, 2200.0), np.full(diameter.shape, stiffness), 10.0 * stiffness
    )
    values = {"safety": 0.6, "rest": 1e-2, "balance": 3e-3} | changes
    recipe = BedRecipe(np.array(share), (width * D, width * D), depth * D, 30.0, **values)
    return [make_bed(law, recipe, seed) for seed in range(count)]


def density(made: list[Bed], sizes) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard error of N_i D_i^2 (c,)."""
    d = np.array(sizes) * D
    found = np.array([b.floor_count(len(d)) / b.area * d**2 for b in made])
    return found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(len(made))


@pytest.mark.verify
def test_one_size_periodic():
    """N D^2 = 0.98 +- 0.01, not shaken."""
    mean, error = density(beds(10, 16.0), (1.0,))
    assert error[0] < 0.01
    assert mean[0] == pytest.approx(0.98, abs=0.01 + error[0])


@pytest.mark.verify
def test_shaking_raises_the_count():
    amplitude = 0.1 * D
    shaken = beds(
        4, 12.0, shakes=50, shake_amplitude=amplitude,
        shake_frequency=float(np.sqrt(2.0 * 9.81 / amplitude) / (2.0 * np.pi)),
    )  # fmt: skip
    mean, _ = density(shaken, (1.0,))
    still, _ = density(beds(4, 12.0), (1.0,))
    assert still[0] < mean[0] < 1.155


@pytest.mark.verify
def test_two_sizes_follow_the_house_law():
    """Ratio 2, half and half by volume: N_i D_i^2 = 0.98 theta^1.33 (large), 0.98 theta^0.63 (small)."""
    sizes = (2.0, 1.0)
    mean, error = density(beds(6, 20.0, sizes, (0.5, 0.5), overlap=0.002, depth=12.0), sizes)
    law = contacts_per_area("graben", np.array(sizes) * D, np.array([0.5, 0.5])) * (np.array(sizes) * D) ** 2
    np.testing.assert_allclose(mean, law, atol=0.03 + 2.0 * float(error.max()))


@pytest.mark.verify
def test_a_tall_silo_follows_janssen():
    """Floor share (1 - exp(-a)) / a, a = 4 mu K h / W, with K and the mobilised friction mu measured.

    Poured grains hardly mobilise the walls' friction; a floor that sinks by a third of a grain does.
    """
    width, mu = 5 * D, 0.3
    count = int(0.6 * width**2 * 30 * D / (np.pi / 6 * D**3))
    stiffness = np.array([2 * 30.0 * D / 0.005])
    law = LinearLaw(
        np.array([D / 2]), np.array([2200.0]), stiffness, 10.0 * float(stiffness[0]), friction=0.5, wall_friction=mu,
        damping=0.5, shear_damping=0.5,
    )  # fmt: skip
    column = count * np.pi / 6 * D**3 / (0.25 * width**2)
    x = insert(np.full(count, D / 2), (width, width), column, np.random.Generator(np.random.PCG64(0)), periodic=False)
    box = Assembly(law, x, np.zeros(count, int), (width, width), periodic=False, safety=0.6)
    weight = count * law.mass[0] * 9.81
    floor = box.drive.floor

    def shares() -> tuple[float, float, float]:
        """Floor's share of the weight, Janssen's, and the mobilised part of the walls' friction."""
        state, side = box.survey()[0], box.walls.push[:4].sum()
        height = 2.0 * float((box.bodies.position[:, 2] - box.walls.point[floor, 2]).mean())
        forces, place = box.contact_forces(), box.by_identity(box.bodies.position)
        first, second = forces.pair.T
        branch = np.where(second[:, None] >= 0, place[second] - place[first], forces.arm)
        vertical = -float((forces.force[:, 2] * branch[:, 2]).sum()) / (width**2 * height)
        a = state.wall_lift / (width**2 * vertical)  # lift = mu side, side = K vertical 4 W h
        return state.floor_push / weight, (1.0 - np.exp(-a)) / a, state.wall_lift / (mu * side)

    box.advance(40_000)
    found, janssen, mobilised = shares()
    assert found == pytest.approx(janssen, rel=0.03) and mobilised < 0.2
    box.walls.velocity[floor, 2] = -1e-3
    box.advance(25_000)
    rows = []
    for _ in range(3):
        box.advance(5_000)
        rows.append(shares())
    found, janssen, mobilised = np.mean(rows, axis=0)
    assert found == pytest.approx(janssen, rel=0.1)
    assert found < 0.25 and mobilised > 0.5
