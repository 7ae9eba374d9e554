"""Blocks at the edges of what a scene may ask: closed forms, scaling laws, or a reason why not."""

import json
import math

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks
from graben.mechanics.plane.polygons import signed_area
from tests.conftest import command
from tests.extremes.columns import NU, PLANE, E, column, compress, rectangle

DIAGONAL = [[(0, 0), (1, 0), (1, 1.5), (0, 0.5)], [(0, 0.5), (1, 1.5), (1, 2), (0, 2)]]


# The speed rises over the first hundredth of the time.
MOVED = 0.995e-3


def rise(headline):
    """Of the wall stress [Pa] above the 0.25 MPa of consolidation."""
    return -headline["peak_wall_stress_pa"] - 0.5 * 0.5e6


@pytest.mark.parametrize("ratio", [1e-3, 1.0, 1e3])
def test_stiffness_of_joints_over_rock(tmp_path, ratio):
    """Three bricks and two joints in series: u / (H / E' + 2 / (kn c)), c the length between cut corners."""
    kn = ratio * PLANE / 1.0
    headline, _ = compress(tmp_path, column(3), kn=kn, ks=0.1 * kn)
    assert rise(headline) == pytest.approx(MOVED / (3.0 / PLANE + 2.0 / (0.98 * kn)), rel=0.02)
    assert not headline["warnings"]


def test_joints_a_million_times_as_stiff_as_the_rock_stop_with_the_reason(tmp_path):
    """Masses that such joints ask for hardly move in the steps of consolidation: no state is written."""
    result = compress(tmp_path, column(3), kn=1e6 * PLANE, ks=1e5 * PLANE, check=False)
    assert result.exit_code == 3 and "unbalanced force ratio" in result.stderr
    assert not (tmp_path / "run.nc").exists()


def test_a_single_block_is_the_rock_itself(tmp_path):
    headline, _ = compress(tmp_path, column(1))
    assert headline["blocks"] == 1
    assert rise(headline) == pytest.approx(MOVED * PLANE, rel=3e-3)


def test_frictionless_joints_carry_no_deviator(tmp_path):
    """A joint at 45 degrees without friction and cohesion bears the lateral pressure, no more."""
    headline, data = compress(tmp_path, DIAGONAL, friction="0 deg", cohesion="0 Pa", duration="100 s", ratio=1.0)
    wall = data["wall_reaction"].values[-1, :, 1]
    assert np.abs(wall).max() == pytest.approx(0.5e6, rel=0.05)
    assert headline["peak_wall_stress_pa"] > -0.55e6


def test_friction_of_80_degrees_holds_a_joint_at_45(tmp_path):
    """tan 80 > tan 45: the joint sticks at any load and gives by its springs only, sigma / 2 on either."""
    headline, _ = compress(tmp_path, DIAGONAL, friction="80 deg", cohesion="0 Pa", ks=10e9)
    soft = 0.5 * (1 / 10e9 + 1 / 10e9) * math.sqrt(0.5)
    assert rise(headline) == pytest.approx(MOVED / (2.0 / PLANE + soft), rel=0.03)


def test_confinement_of_nothing_is_refused_and_a_huge_one_says_why(tmp_path):
    none = compress(tmp_path, column(3), pressure=0.0, check=False)
    assert none.exit_code == 2 and "confining_pressure" in none.stderr and "greater than 0" in none.stderr
    huge = compress(tmp_path, column(3), pressure=3e9, check=False)
    assert huge.exit_code == 2 and "closes joints" in huge.stderr


def test_a_single_block_bears_a_huge_confinement(tmp_path):
    """No joint, nothing to close: 100 MPa on the sides, half of it on top."""
    _, data = compress(tmp_path, column(1), pressure=1e8, speed=1e-7)
    stress = data["zone_stress"].values[0]
    np.testing.assert_allclose(stress[:, 0], -1e8, rtol=5e-3)
    np.testing.assert_allclose(stress[:, 1], -0.5e8, rtol=5e-3)


def test_a_strain_of_30_percent_follows_the_large_strain_law(tmp_path):
    """One block, F = diag(a, 1 - e): S = C : (F^T F - 1) / 2, nominal lateral stress a S_xx = -p (a dead load)."""
    headline, data = compress(tmp_path, column(1), speed=0.03, duration="10 s")
    e = -headline["strain_at_peak"]
    assert e == pytest.approx(0.2985, rel=1e-4)
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    b = 1.0 - e
    low, high = 1.0, 1.5
    for _ in range(60):
        a = 0.5 * (low + high)
        exx, eyy = 0.5 * (a * a - 1), 0.5 * (b * b - 1)
        low, high = (low, a) if a * (lam * (exx + eyy) + 2 * mu * exx) > -0.5e6 else (a, high)
    nominal = b * (lam * (exx + eyy) + 2 * mu * eyy)
    assert np.abs(data["wall_reaction"].values[-1, :, 1]).max() == pytest.approx(-nominal, rel=5e-3)
    assert np.isfinite(data["zone_stress"].values).all()


def test_a_block_a_thousandth_of_its_neighbours_joins_one_of_them_and_the_run_says_so(tmp_path):
    """Area 1e-3: below 2 % of the median, so that it cannot rule the masses of the others."""
    e = math.sqrt(1e-3)
    cut = [(0, 0), (1, 0), (1, 1 - e), (1 - e, 1 - e), (1 - e, 1), (0, 1)]
    small, _ = compress(tmp_path, [cut, rectangle(1 - e, 1 - e, 1, 1), rectangle(0, 1, 1, 2)], rounding=1e-3)
    whole, _ = compress(tmp_path, column(2), rounding=1e-3)
    assert small["merged_blocks"] == 1 and small["merged_area_m2"] == pytest.approx(1e-3)
    assert rise(small) == pytest.approx(rise(whole), rel=1e-6)


def test_a_needle_between_bricks_is_two_joints_in_series(tmp_path):
    """1 m by 3 cm; rigid bricks in comparison, joints far stiffer than the default."""
    kn, t = 100e9, 0.03
    bricks = [rectangle(0, 0, 1, 1), rectangle(0, 1, 1, 1 + t), rectangle(0, 1 + t, 1, 2)]
    more = 'shortest_edge = "1 cm"\nthinnest = "1 cm"'
    headline, _ = compress(tmp_path, bricks, kn=kn, ks=kn, rounding=1e-3, more=more)
    assert headline["blocks"] == 3 and headline["merged_blocks"] == 0
    assert rise(headline) == pytest.approx(MOVED / (2.0 / PLANE + 2.0 / (0.998 * kn)), rel=0.02)


def test_places_of_1e7_m_change_not_a_bit(tmp_path):
    near, data = compress(tmp_path, column(3))
    far, there = compress(tmp_path, column(3, x0=1e7, y0=-1e7))
    assert far["peak_wall_stress_pa"] == near["peak_wall_stress_pa"]
    assert np.array_equal(data["zone_stress"].values, there["zone_stress"].values)


@pytest.mark.parametrize("unit", [1e-6, 1e3])
def test_scenes_of_micrometres_and_kilometres_have_the_same_stress(tmp_path, unit):
    """No length in the model: lengths by s, stiffness of joints by 1 / s, and every stress stays."""
    one, _ = compress(tmp_path, column(3))
    other, _ = compress(tmp_path, column(3, side=unit), unit=unit)
    assert other["peak_wall_stress_pa"] == pytest.approx(one["peak_wall_stress_pa"], rel=1e-6)
    assert other["energy_error"] == pytest.approx(one["energy_error"], rel=1e-3)


def test_a_mirrored_scene_has_the_same_stress(tmp_path):
    """Of two bricks of unequal width under a third."""
    bricks = [rectangle(0, 0, 0.3, 1), rectangle(0.3, 0, 1, 1), rectangle(0, 1, 1, 2)]
    mirrored = [[(1 - x, y) for x, y in p][::-1] for p in bricks]
    one, _ = compress(tmp_path, bricks)
    other, _ = compress(tmp_path, mirrored)
    assert other["peak_wall_stress_pa"] == pytest.approx(one["peak_wall_stress_pa"], rel=1e-3)


def test_a_scene_in_mm_and_mpa_is_the_same_scene(tmp_path):
    one, _ = compress(tmp_path, column(3))
    scene = tmp_path / "scene.toml"
    text = scene.read_text()
    for old, new in (
        ("500000.0 Pa", "0.5 N/mm^2"), ("10000000000.0 Pa/m", "10 N/mm^2/mm"), ("1000000000.0 Pa/m", "1 MPa/mm"),
        ("0.0001 m/s", "0.1 mm/s"), ("65000000000.0 Pa", "65000 MPa"), ('"0.01 m"', '"10 mm"'),
        ('"0.5 m"', '"500 mm"'),
    ):  # fmt: skip
        assert old in text, old
        text = text.replace(old, new)
    scene.write_text(text)
    result = command("dem-run", scene, "-o", tmp_path / "mm.nc", "--json", "-q")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["peak_wall_stress_pa"] == pytest.approx(one["peak_wall_stress_pa"], rel=1e-6)


def test_rock_that_hardly_changes_its_volume_says_where_its_result_fails(tmp_path):
    """nu 0.4999 scales masses by the bulk modulus: lateral stress is out of balance, and the run must say so."""
    headline, _ = compress(tmp_path, column(3), poisson=0.4999, numerics="steps = 1000", speed=5e-3)
    lateral = headline["lateral_over_applied_stress"]
    assert 0.7 <= lateral <= 1.3 or any("lateral stress" in w for w in headline["warnings"])


@pytest.mark.verify
def test_100_000_blocks_fill_their_square_and_come_nearer_to_rest():
    """Areas sum to the square; stress of consolidation is even; unbalanced forces fall."""
    side = math.sqrt(0.955 * 100_000)
    outline = side * np.array([(0, 0), (1, 0), (1, 1), (0, 1.0)])
    tessellation = voronoi_blocks(outline, 1.0, seed=1, lloyd_passes=1)
    assert 90_000 < tessellation.size < 110_000
    areas = sum(signed_area(tessellation.points[ring]) for ring in tessellation.rings)
    assert areas == pytest.approx(side**2, rel=1e-9)
    bodies = build_bodies(tessellation)
    joint = Joint(10e9, 1e9, 0.6, 1e5, 0.0, 0.0, np.inf)
    model = BlockModel(bodies, young=E, poisson=NU, density=2700.0, joint=joint, rounding=0.05, dt=1e-3)
    for k in range(4):
        model.press(bodies.edge_side == k, -1e6)
    model.advance(50)
    begun = model.unbalanced_ratio()
    model.advance(450)
    assert np.isfinite(model.motion.x).all()
    assert model.unbalanced_ratio() < 0.5 * begun
