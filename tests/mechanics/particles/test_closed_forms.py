"""Collisions, sliding and stacks that have closed forms, and what must be conserved."""

import numpy as np
import pytest

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.particles.measures import largest_eigenvalue

R, RHO, K = 1e-3, 2500.0, 1e5


def law(**changes) -> LinearLaw:
    values = {
        "radius": np.array([R]),
        "density": np.array([RHO]),
        "normal_stiffness": np.array([K]),
        "wall_stiffness": K,
    }
    return LinearLaw(**(values | changes))


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.3, 0.6])
def test_restitution_of_two_spheres(ratio):
    """A dashpot that never pulls (Schwager & Poeschel 2007):

    e = exp(-z/w (pi - atan2(2 z w, 1 - 2 z^2))), w = sqrt(1 - z^2).
    """
    box = Assembly(
        law(damping=ratio), np.array([[9e-3, 0.01, 0.01], [11.1e-3, 0.01, 0.01]]), np.zeros(2), (0.02, 0.02),
        gravity=0.0, safety=0.005,
    )  # fmt: skip
    box.bodies.velocity[:, 0] = np.where(box.bodies.identity == 0, 0.1, -0.1)
    before = box.energy()["total"]
    box.advance(80_000)
    w = np.sqrt(1.0 - ratio**2)
    expected = np.exp(-ratio / w * (np.pi - np.arctan2(2.0 * ratio * w, 1.0 - 2.0 * ratio**2)))
    v = box.by_identity(box.bodies.velocity)[:, 0]
    assert v[1] > 0.0
    assert v[1] / 0.1 == pytest.approx(expected, rel=3e-3)
    assert v.sum() == pytest.approx(0.0, abs=1e-12)
    assert box.energy()["total"] == pytest.approx(before, rel=1e-3)


def test_sliding_sphere_starts_to_roll():
    """v falls to 5/7 v0 at t = 2 v0 / (7 mu g); afterwards it rolls: v = omega r."""
    mu, g, v0 = 0.2, 9.81, 0.1
    rest = law().mass[0] * g / (K / 2)
    box = Assembly(
        law(friction=mu, wall_friction=mu), np.array([[5e-3, 0.01, R - rest]]), np.zeros(1), (0.02, 0.02), gravity=g
    )
    box.bodies.velocity[0, 0] = v0
    start = 2.0 * v0 / (7.0 * mu * g)
    box.advance(round(0.5 * start / box.dt))
    assert box.bodies.velocity[0, 0] == pytest.approx(v0 - mu * g * box.time, rel=1e-3)
    assert box.bodies.spin[0, 1] * R == pytest.approx(2.5 * mu * g * box.time, rel=2e-3)
    box.advance(round(1.5 * start / box.dt))
    assert box.bodies.velocity[0, 0] == pytest.approx(5.0 / 7.0 * v0, rel=1e-3)
    assert box.bodies.spin[0, 1] * R == pytest.approx(box.bodies.velocity[0, 0], rel=1e-3)
    energy = box.energy()
    assert energy["friction"] == pytest.approx(law().mass[0] * v0**2 / 7.0, rel=5e-3)  # 2/7 of the kinetic energy


def test_column_stands_with_its_weight():
    count, g = 6, 9.81
    x = np.column_stack([np.full(count, 0.01), np.full(count, 0.01), R * (1 + 2.0 * np.arange(count))])
    box = Assembly(law(damping=0.9), x, np.zeros(count), (0.02, 0.02), gravity=g)
    box.advance(60_000)
    weight = law().mass[0] * g
    survey, floor, touching = box.survey()
    assert survey.floor_push == pytest.approx(count * weight, rel=1e-9)
    assert np.count_nonzero(floor) == 1
    pair, normal, push = box.touching()
    below = pair.min(axis=1)
    np.testing.assert_allclose(push[np.argsort(below)], weight * np.arange(count - 1, 0, -1), rtol=1e-8)
    np.testing.assert_allclose(np.abs(normal[:, 2]), 1.0)
    assert sorted(touching) == [1, 2, 2, 2, 2, 2]


def crowd(rubbing: float, damping: float, **options) -> Assembly:
    pair = LinearLaw(
        radius=np.array([1e-3, 0.7e-3]), density=np.array([RHO, RHO]), normal_stiffness=np.array([3e3, 3e3]),
        wall_stiffness=3e3, friction=rubbing, wall_friction=rubbing, damping=damping, shear_damping=damping,
    )  # fmt: skip
    kind = np.array([0] * 60 + [1] * 140)
    rng = np.random.Generator(np.random.PCG64(1))
    width = (10e-3, 10e-3)
    x = insert(pair.radius[kind], width, 13e-3, rng)
    box = Assembly(pair, x, kind, width, **options)
    box.bodies.velocity[:] = 0.4 * rng.normal(size=x.shape)
    return box


def test_energy_without_damping():
    box = crowd(0.0, 0.0, safety=0.1)
    before = box.energy()
    box.advance(12_000)
    after = box.energy()
    assert after["dashpots"] == 0.0
    assert after["total"] == pytest.approx(before["total"], rel=2e-3)


@pytest.mark.parametrize("rubbing", [0.0, 0.5])
def test_ledger_with_dissipation(rubbing):
    box = crowd(rubbing, 0.3, safety=0.1)
    before = box.energy()
    box.advance(12_000)
    after = box.energy()
    assert after["dashpots"] > 0.3 * before["kinetic"]
    assert (after["friction"] > 0.0) == (rubbing > 0.0)
    assert after["total"] == pytest.approx(before["total"], rel=1e-2)


@pytest.mark.parametrize("rubbing", [0.0, 0.5])
def test_momentum_of_a_gas_without_gravity(rubbing):
    box = crowd(rubbing, 0.2, gravity=0.0)
    box.bodies.position[:, 2] += 1.0  # far from the floor
    box._rebuild()
    mass = box.law.mass[box.bodies.kind]
    before = mass @ box.bodies.velocity
    box.advance(2000)
    np.testing.assert_allclose(
        box.law.mass[box.bodies.kind] @ box.bodies.velocity, before, atol=1e-12 * np.abs(mass).sum()
    )


def test_same_seed_same_bits():
    first, second = crowd(0.3, 0.2), crowd(0.3, 0.2)
    first.advance(1500)
    for _ in range(15):  # how a run is cut into pieces does not matter either
        second.advance(100)
    assert first.bodies.position.tobytes() == second.bodies.position.tobytes()
    assert first.bodies.spin.tobytes() == second.bodies.spin.tobytes()


def test_stable_step_is_not_far_from_the_real_limit():
    """The estimate lies below the step at which an undamped crystal blows up, and not by more than a factor 2."""
    # face-centred cubic: every second site of a simple cubic grid of spacing sqrt(2) R, slightly compressed
    spacing = np.sqrt(2.0) * R * 0.999
    sites = np.array([[i, j, k] for i in range(8) for j in range(8) for k in range(8) if (i + j + k) % 2 == 0])
    x = sites * spacing + np.array([0.0, 0.0, R])
    steady = {}
    for factor in (0.9, 2.2):
        box = Assembly(law(damping=0.0), x, np.zeros(len(x)), (8 * spacing, 8 * spacing), gravity=0.0, safety=1.0)
        box.dt *= factor
        rng = np.random.Generator(np.random.PCG64(2))
        box.bodies.velocity[:] = 1e-5 * rng.normal(size=x.shape)
        box.advance(60)
        steady[factor] = float(np.abs(box.bodies.velocity).max()) < 1.0
    assert steady == {0.9: True, 2.2: False}


def test_largest_eigenvalue():
    rng = np.random.Generator(np.random.PCG64(0))
    for _ in range(20):
        a = rng.normal(size=(3, 3))
        k = a @ a.T
        six = np.array([k[0, 0], k[1, 1], k[2, 2], k[0, 1], k[1, 2], k[2, 0]])
        assert largest_eigenvalue(six) == pytest.approx(np.linalg.eigvalsh(k)[-1], rel=1e-12)
    assert largest_eigenvalue(np.array([2.0, 2.0, 2.0, 0.0, 0.0, 0.0])) == 2.0


def test_bad_arrays_are_refused():
    with pytest.raises(ValueError, match="normal_stiffness"):
        law(normal_stiffness=np.array([-1.0]))
    with pytest.raises(ValueError, match="friction"):
        law(friction=-0.1)
    with pytest.raises(ValueError, match="n >= 1"):
        Assembly(law(), np.zeros((0, 3)), np.zeros(0), (1.0, 1.0))
    with pytest.raises(ValueError, match="periodic box"):
        Assembly(law(), np.zeros((1, 3)), np.zeros(1), (3e-3, 1.0))
