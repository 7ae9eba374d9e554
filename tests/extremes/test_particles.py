"""Grains at the edges of what a scene may ask: closed forms, scaling laws, or a reason why not."""

import json

import numpy as np
import pytest

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.law import LinearLaw
from tests.conftest import PIPELINES, command, settings

R, RHO, K = 1e-3, 2500.0, 1e5
BED = {
    "fidelity": '"draft"', "box.width": '"0.6 mm"', "box.depth": '"0.3 mm"', "output.vtk": "false",
}  # fmt: skip


def law(**changes):
    values = {"radius": [R], "density": [RHO], "normal_stiffness": [K], "wall_stiffness": K} | changes
    return LinearLaw(**{k: np.array(v) if isinstance(v, list) else v for k, v in values.items()})


def bed(folder, **changes):
    values = BED | {k.replace("__", "."): v for k, v in changes.items()}
    return command(
        "dem-run", PIPELINES / "wear/bed.toml", *settings(f"{k}={v}" for k, v in values.items()),
        "-o", folder / "bed.nc", "--overwrite", "--json", "-q",
    )  # fmt: skip


def counted(result):
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def grains(diameter):
    return f'[{{name="grains", diameter="{diameter}", density="2200 kg/m^3"}}]'


def test_one_grain_bears_its_weight_and_is_one_contact(tmp_path):
    """Hard walls 1.1 grains apart: the floor bears all, and the count is one over the floor."""
    found = counted(bed(tmp_path, box__width='"0.11 mm"', box__depth='"0.1 mm"', box__sides='"walls"'))
    assert found["particles"] == 1
    assert found["floor_share_of_weight"] == pytest.approx(1.0, abs=1e-9)
    assert found["classes"][0]["contacts_per_m2"] == pytest.approx(1.0 / 0.11e-3**2)


@pytest.mark.parametrize(("unit", "width", "depth", "diameter", "pressure"), [
    (1e3, "0.6 m", "0.3 m", "100 mm", "30 kPa"), (1e-6, "0.6 nm", "0.3 nm", "0.1 nm", "30e-6 Pa"),
])  # fmt: skip
def test_beds_of_boulders_and_of_atoms_are_the_bed_of_sand(tmp_path, unit, width, depth, diameter, pressure):
    """Lengths by s and pressure by s, weight and pressure keep their ratio: the same count times diameter squared."""
    sand = counted(bed(tmp_path))["classes"][0]["contacts_times_diameter_squared"]
    other = bed(
        tmp_path, box__width=f'"{width}"', box__depth=f'"{depth}"', grains=grains(diameter),
        loading__pressure=f'"{pressure}"',
    )  # fmt: skip
    found = counted(other)
    # Where a bed comes to rest is chaotic; the count of 36 grains across the floor differs by one or two of them.
    assert found["classes"][0]["contacts_times_diameter_squared"] == pytest.approx(sand, abs=2.5 / 36)
    assert found["largest_overlap_over_radius"] < 0.02


@pytest.mark.parametrize(("setting", "words"), [
    ({"loading__gravity": '"0 m/s^2"'}, "greater than 0"),
    ({"loading__pressure": '"0 Pa"'}, "greater than 0"),
    ({"contact__damping": "0.0"}, "nothing else takes energy"),
    ({"loading__pressure": '"1e-9 Pa"'}, "their own weight"),
    ({"loading__gravity": '"1e6 m/s^2"'}, "their own weight"),
    ({"contact__normal_stiffness": '"1e-9 N/m"'}, "their own weight"),
    ({"loading__gravity": '"1e-9 m/s^2"'}, "steps of the fall alone"),
    ({"contact__normal_stiffness": '"1e12 N/m"'}, "steps of the fall alone"),
    ({"box__width": '"0.3 mm"'}, "three of its largest grains"),
])  # fmt: skip
def test_beds_that_cannot_be_are_refused_at_once(tmp_path, setting, words):
    result = bed(tmp_path, **setting)
    assert result.exit_code == 2 and words in result.stderr
    assert not any(tmp_path.iterdir())


def test_huge_friction_and_no_friction_both_come_to_rest(tmp_path):
    """Friction of 1000 holds more room between grains than none."""
    smooth = counted(bed(tmp_path))["solid_fraction"]
    rough = counted(bed(tmp_path, contact__friction="1000.0", contact__wall_friction="1000.0"))["solid_fraction"]
    assert 0.4 < rough < smooth < 0.66


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("speed", [1e-6, 1.0, 1000.0])
def test_an_impact_at_any_speed_has_the_same_restitution(damping, speed):
    """Linear contacts know no speed: overlap v sqrt(m / k) undamped, restitution of the dashpot that never pulls.

    At 1,000 m/s the sphere sinks in by many of its own radii: the wall still turns it.
    """
    box = Assembly(
        law(damping=damping), np.array([[0.05, 0.05, R]]), np.zeros(1), (0.1, 0.1), gravity=0.0, safety=0.01
    )
    box.bodies.position[0, 2] += 5.0 * speed * box.dt
    box.bodies.velocity[0, 2] = -speed
    deepest = 0.0
    for _ in range(4000):
        box.advance(1)
        deepest = max(deepest, R - box.bodies.position[0, 2])
        if box.bodies.position[0, 2] > R and box.bodies.velocity[0, 2] > 0.0:
            break
    w = np.sqrt(1.0 - damping**2)
    restitution = np.exp(-damping / w * (np.pi - np.arctan2(2.0 * damping * w, 1.0 - 2.0 * damping**2)))
    assert box.bodies.velocity[0, 2] / speed == pytest.approx(restitution, rel=5e-3)
    if damping == 0.0:
        assert deepest == pytest.approx(speed * np.sqrt(law().mass[0] / (K / 2)), rel=5e-3)


def test_two_spheres_at_1000_m_s_keep_energy_and_momentum():
    """Stiff enough that they meet within a tenth of a radius: elastic exchange of velocities."""
    hard = law(normal_stiffness=[1e12], wall_stiffness=1e12, damping=0.0)
    x = np.array([[0.018, 0.02, 0.02], [0.0202, 0.02, 0.02]])
    box = Assembly(hard, x, np.zeros(2), (0.04, 0.04), gravity=0.0, safety=0.02)
    box.bodies.velocity[box.bodies.identity == 0, 0] = 1000.0
    before = box.energy()["total"]
    while not box.survey()[0].contacts:
        box.advance(20)
    box.advance(3000)
    v = box.by_identity(box.bodies.velocity)[:, 0]
    assert v[0] == pytest.approx(0.0, abs=2.0) and v[1] == pytest.approx(1000.0, rel=2e-3)
    assert box.energy()["total"] == pytest.approx(before, rel=1e-4)


def test_a_size_ratio_of_50_keeps_the_step_of_its_smallest_grain():
    """A grain a fiftieth of its neighbour rests on it: the estimated step is stable and conserves energy.

    Dashpots of large grains do not touch the small one. Each body's own rows bound the step.
    """
    two = law(radius=[50 * R, R], density=[RHO, RHO], normal_stiffness=[K, K], damping=0.0)
    width = 400 * R
    x = np.array([[0.5 * width, 0.5 * width, 50 * R], [0.5 * width, 0.5 * width, 101 * R - 1e-5]])
    box = Assembly(two, x, np.array([0, 1]), (width, width), gravity=0.0, safety=0.4)
    before = box.energy()["total"]
    assert 0.0 < box.survey()[0].step_over_critical < 1.0
    box.advance(2000)
    assert box.energy()["total"] == pytest.approx(before, rel=1e-2)
    damped = law(radius=[50 * R, R], density=[RHO, RHO], normal_stiffness=[K, K], damping=0.3)
    box = Assembly(damped, x, np.array([0, 1]), (width, width), gravity=0.0, safety=0.4)
    assert box.survey()[0].step_over_critical < 1.0


def test_grains_without_gravity_fly_on():
    """No force, no change: a straight line at constant speed, as far as the box repeats."""
    box = Assembly(law(), np.array([[0.01, 0.01, 0.01]]), np.zeros(1), (0.02, 0.02), gravity=0.0)
    box.bodies.velocity[0] = [0.3, -0.2, 0.1]
    box.advance(2000)
    np.testing.assert_array_equal(box.bodies.velocity[0], [0.3, -0.2, 0.1])
    assert box.bodies.position[0, 2] == pytest.approx(0.01 + 0.1 * box.time, rel=1e-12)


@pytest.mark.parametrize("turn", ["mirrored", "turned"])
def test_a_mirrored_or_turned_heap_moves_mirrored_or_turned(turn):
    """Four grains that fall onto one another, all axes in the plane exchanged or one reversed."""
    width = 0.02
    x = np.array([[0.008, 0.0101, 0.004], [0.0103, 0.011, 0.0062], [0.0092, 0.0089, 0.008], [0.0115, 0.0095, 0.0033]])

    def change(p, about):
        q = p.copy()
        q[:, 0] = 2.0 * about - q[:, 0]
        return q if turn == "mirrored" else np.column_stack([p[:, 1], p[:, 0], p[:, 2]])

    rough = law(friction=0.5, wall_friction=0.5)
    one = Assembly(rough, x, np.zeros(4), (width, width), periodic=False)
    other = Assembly(rough, change(x, 0.5 * width), np.zeros(4), (width, width), periodic=False)
    for box in (one, other):
        box.advance(1500)
    there = change(one.by_identity(one.bodies.position), 0.5 * width)
    np.testing.assert_allclose(other.by_identity(other.bodies.position), there, atol=1e-9 * width)
