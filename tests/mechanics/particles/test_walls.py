"""Walls are planes at any angle: a sphere on an incline, and boxes that are turned with their gravity."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.particles.walls import box_walls, planes

R, RHO, K, G = 1e-3, 2500.0, 1e5, 9.81


def law(friction: float, **changes) -> LinearLaw:
    values = {"radius": np.array([R]), "density": np.array([RHO]), "normal_stiffness": np.array([K])} | changes
    return LinearLaw(**values, wall_stiffness=K, friction=friction, wall_friction=friction)


def turning(degrees: float) -> np.ndarray:
    """About y, and a little about z, so that no wall stays along an axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    d, t = np.cos(0.3), np.sin(0.3)
    return np.array([[d, -t, 0.0], [t, d, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
    )


def on_incline(angle: float, friction: float) -> tuple[Assembly, np.ndarray]:
    """A sphere that rests with its own overlap on an incline, and the unit vector downhill."""
    turn = turning(angle)
    normal, downhill = turn @ [0.0, 0.0, 1.0], turn @ [1.0, 0.0, 0.0]
    downhill = downhill if downhill[2] < 0.0 else -downhill
    mass = law(friction).mass[0]
    sunk = mass * G * np.cos(np.radians(angle)) / (K / 2.0)
    point = np.array([[0.3, -0.2, 0.1]])
    box = Assembly(
        law(friction), point + (R - sunk) * normal, np.zeros(1), (1.0, 1.0), periodic=False, gravity=G,
        walls=planes(point, [3.0 * normal]),
    )  # fmt: skip
    return box, downhill


@pytest.mark.parametrize(("angle", "mu"), [(20.0, 0.5), (50.0, 0.2)])
def test_sphere_on_an_incline(angle, mu):
    """Rolls with 5/7 g sin where mu >= 2/7 tan, else slides with g (sin - mu cos), turning with 5/2 mu g cos / r."""
    box, downhill = on_incline(angle, mu)
    box.advance(round(0.05 / box.dt))
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    rolls = mu >= 2.0 / 7.0 * np.tan(np.radians(angle))
    expected = 5.0 / 7.0 * G * sine if rolls else G * (sine - mu * cosine)
    turn = expected / R if rolls else 2.5 * mu * G * cosine / R
    speed, spin = box.bodies.velocity[0], box.bodies.spin[0]
    assert speed @ downhill == pytest.approx(expected * box.time, rel=2e-3)
    assert np.linalg.norm(speed - (speed @ downhill) * downhill) < 1e-4 * np.linalg.norm(speed)
    assert np.linalg.norm(spin) == pytest.approx(turn * box.time, rel=2e-3)
    mass, normal = box.law.mass[0], box.walls.normal[0]
    assert box.walls.push[0] == pytest.approx(mass * G * cosine, rel=1e-6)
    friction = 2.0 / 7.0 * sine if rolls else mu * cosine
    np.testing.assert_allclose(box.walls.rub[0], friction * mass * G * downhill, atol=0.02 * mass * G)
    assert abs(box.walls.rub[0] @ normal) < 1e-12 * mass * G


def boxes(position, kind, width, friction, velocity) -> tuple[Assembly, Assembly, np.ndarray]:
    """The same spheres in an upright box and in one turned by 30 degrees with its gravity."""
    both = law(
        friction, radius=np.array([R, 0.6 * R]), density=np.array([RHO, RHO]), normal_stiffness=np.array([3e3, 2e3])
    )
    upright = Assembly(both, position, kind, width, periodic=False, gravity=G, safety=0.6)
    turn = turning(30.0)
    walls = box_walls(np.array(width), False)
    turned = Assembly(
        both, position @ turn.T, kind, width, periodic=False, gravity=turn @ [0.0, 0.0, -G], safety=0.6,
        walls=planes(walls.point @ turn.T, walls.normal @ turn.T),
    )  # fmt: skip
    upright.bodies.velocity[:] = velocity[upright.bodies.identity]
    turned.bodies.velocity[:] = (velocity @ turn.T)[turned.bodies.identity]
    return upright, turned, turn


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_one_grain_in_a_turned_box(friction):
    """It bounces from floor and sides and is pressed by the piston as in the upright box."""
    upright, turned, turn = boxes(
        np.array([[2e-3, 1.5e-3, 3e-3]]), np.zeros(1), (4e-3, 3e-3), friction, np.array([[0.4, 0.3, 0.0]])
    )
    for box in (upright, turned):
        box.advance(2500)
        box.set_piston(4e-3, 1e-6, 1e-3, 1e-3, 1.0)
        box.shake_floor(1e-4, 100.0)
        box.advance(2500)
    assert (upright.walls.slip is not None) == (friction > 0.0)
    assert upright.piston_height < 4e-3
    np.testing.assert_allclose(turned.bodies.position @ turn, upright.bodies.position, atol=1e-9 * R)
    np.testing.assert_allclose(turned.bodies.velocity @ turn, upright.bodies.velocity, atol=1e-9)
    np.testing.assert_allclose(turned.walls.push, upright.walls.push, atol=1e-9)
    assert turned.piston_height == pytest.approx(upright.piston_height, abs=1e-9 * R)


def test_bed_in_a_turned_box():
    """The same paths at first; at rest, the floor and the friction of the sides carry the weight."""
    kind = np.array([0] * 20 + [1] * 30)
    width = (6e-3, 5.5e-3)
    rng = np.random.Generator(np.random.PCG64(2))
    x = insert(np.array([R, 0.6 * R])[kind], width, 12e-3, rng, periodic=False)
    upright, turned, turn = boxes(x, kind, width, 0.4, 0.3 * rng.normal(size=x.shape))
    for box in (upright, turned):
        box.advance(400)
    ours, theirs = (box.by_identity(box.bodies.position) for box in (turned, upright))
    np.testing.assert_allclose(ours @ turn, theirs, atol=1e-6 * R)
    before = turned.energy()["total"]
    height = []
    for box in (upright, turned):
        box.advance(120_000)
        state, _, _ = box.survey()
        weight = float(box.bodies.mass.sum()) * G
        assert state.floor_push + state.wall_lift == pytest.approx(weight, rel=0.05)
        up = box.walls.normal[box.drive.floor]
        height.append(float(box.bodies.mass @ (box.bodies.position @ up) / box.bodies.mass.sum()))
    assert height[1] == pytest.approx(height[0], rel=0.1)
    energy = turned.energy()
    assert energy["friction"] > 0.0
    assert energy["total"] == pytest.approx(before, abs=0.02 * (energy["friction"] + energy["dashpots"]))


def test_a_moving_wall_does_work():
    """A plane that pushes a free sphere: what it gives is what the sphere gets."""
    free = law(0.0)
    box = Assembly(
        free, np.array([[1.01e-3, 0.0, 0.0]]), np.zeros(1), (1.0, 1.0), periodic=False, gravity=0.0, safety=0.02,
        walls=planes([[0.0, 0.0, 0.0]], [[1.0, 1.0, 0.0]], [[0.0, 0.2, 0.0]]),
    )  # fmt: skip
    box.bodies.position[0, 1] = 0.5e-3
    box.advance(20_000)
    speed = box.bodies.velocity[0]
    assert speed[0] == pytest.approx(speed[1]) and speed[0] > 0.1  # along the normal
    energy = box.energy()
    assert energy["floor_work"] > energy["kinetic"] > 0.0
    assert energy["total"] == pytest.approx(0.0, abs=5e-3 * energy["kinetic"])


def test_a_wall_from_afar_is_felt():
    """A plane comes to a sphere at rest, from many skins away, while the neighbour list holds."""
    box = Assembly(
        law(0.0), np.array([[30e-3, 0.0, 0.0]]), np.zeros(1), (1.0, 1.0), periodic=False, gravity=0.0, skin=0.02,
        walls=planes([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [[0.5, 0.0, 0.0]]),
    )  # fmt: skip
    box.advance(round(0.05 / box.dt))  # the wall goes 25 mm of the 29 mm: not yet
    assert box.bodies.velocity[0, 0] == 0.0 and box.rebuilds == 1
    box.advance(round(0.03 / box.dt))
    assert box.bodies.velocity[0, 0] > 0.5
    assert box.bodies.position[0, 0] - box.walls.point[0, 0] > R


@pytest.mark.parametrize(
    ("point", "normal", "words"),
    [
        ([[0, 0, 0]], [[0, 0, 0]], "length"),
        ([[0, 0, 0]], [[0, 0, 1], [1, 0, 0]], "rows"),
        ([[0, 0]], [[0, 1]], "rows"),
    ],
)
def test_no_planes(point, normal, words):
    with pytest.raises(Refused, match=words):
        planes(point, normal)
