"""Compression between platens as bodies, against closed forms: joints and rock in series, friction at ends, sides."""

import json

import numpy as np
import pytest

from graben.schemas.artifact import read_artifact
from graben.stages.dem_run import stage as dem_run
from graben.stages.homogenize import stage as homogenize

# 16 bricks of 1 m in a square of 4 m, each corner cut off at 2 cm; 10 GPa make the joints a small part of it.
SCENE = """
kind = "blocks"
[domain]
width = "4 m"
height = "4 m"
[tessellation]
method = "file"
file = "bricks.geojson"
rounding = "0.02 m"
[rock]
young = "10 GPa"
[joints]
normal_stiffness = "40 GPa/m"
dilation = "0 deg"
[loading]
confining_pressure = "1 MPa"
speed = "40 um/s"
states = 3
[numerics]
steps = 6000
[output]
vtk = false
balance = true
"""
E, NU, KN, P, SIDE, CUT = 10e9, 0.2, 40e9, 1e6, 4.0, 0.96


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("platens")
    rings = [[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]] for y in range(4) for x in range(4)]
    features = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [r]}} for r in rings
    ]
    (path / "bricks.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    (path / "scene.toml").write_text(SCENE)
    return path


def run(folder, *settings):
    headline = dem_run.run(folder / "scene.toml", folder / "run.nc", overrides=settings, overwrite=True)
    return headline, read_artifact(folder / "run.nc", "blocks")


def areas(d):
    x = d.vertex_position.values[d.zone_vertex.values]
    a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def compliance(between, more=0.0):
    """Travel of the top over the vertical stress [m/Pa]: rock, three joints, two platens, and more in series."""
    return SIDE * (1 - NU**2) / E + 3 / (KN * CUT) + 2 / (between * CUT) + more


@pytest.mark.parametrize("sides", ["false", "true"])
def test_frictionless_platens_compress_evenly(folder, sides):
    stiffness = f'loading.platens={{normal_stiffness="20 GPa/m", sides={sides}}}'
    headline, d = run(folder, stiffness)
    stress = d.zone_stress.values
    force = -d.wall_reaction.values[:, 2, 1] / SIDE
    # Dead loads on a side that has become shorter.
    shorter = SIDE / (SIDE - 40e-6 * d.time.values)
    assert stress[1:, :, 1] / -force[1:, None] == pytest.approx(1.0, abs=2e-3)
    assert stress[1:, :, 0] / (-P * shorter[1:, None]) == pytest.approx(1.0, abs=3e-3)
    assert d.lateral_over_applied_stress.values == pytest.approx(shorter, abs=1e-3)
    assert d.friction_over_confinement.values == pytest.approx(0.0, abs=1e-4)
    assert headline["side_over_top_reaction"] == pytest.approx(0.0, abs=1e-4)
    assert headline["bottom_over_top_reaction"] == pytest.approx(1.0, abs=1e-4)
    travel = 40e-6 * (d.time.values[-1] - d.time.values[1])
    assert (force[-1] - force[1]) * compliance(20e9) == pytest.approx(travel, rel=1e-2)


def test_platens_that_deform_add_their_own_compliance(folder):
    platens = 'loading.platens={young="5 GPa", poisson=0.0, thickness="1 m", overhang="1 cm"}'
    _, d = run(folder, platens)
    force = -d.wall_reaction.values[:, 2, 1] / SIDE
    travel = 40e-6 * (d.time.values[-1] - d.time.values[1])
    assert (force[-1] - force[1]) * compliance(KN, 2 * 1.0 / 5e9) == pytest.approx(travel, rel=2e-2)


def test_friction_at_the_ends_confines_as_the_balance_of_forces_says(folder):
    """All contacts slip outwards: mu sigma on both halves of both platens, mu sigma W / (2 H) in the mean."""
    headline, d = run(folder, 'loading.platens={friction="3 deg", shear_stiffness="400 GPa/m"}')
    sigma = -d.wall_reaction.values[-1, 2, 1] / SIDE
    mu = np.tan(np.radians(3.0))
    share = d.friction_over_confinement.values[-1]
    assert share == pytest.approx(mu * sigma / (2.0 * P), rel=2e-2)
    assert d.wall_reaction.values[-1, [0, 2], 0] == pytest.approx(0.0, abs=1e-2 * mu * sigma * SIDE)
    # The mean of all zones has what the boundary forces say.
    mean = np.average(d.zone_stress.values[-1, :, 0], weights=areas(d))
    shorter = SIDE / (SIDE - 40e-6 * d.time.values[-1])
    assert mean / -P == pytest.approx(shorter * (1.0 + share), rel=3e-3)
    assert headline["friction_over_confinement"] > 0.1


def test_friction_at_the_sides_takes_its_share_of_the_load(folder):
    """All contacts slip: the sides bear 2 mu p H, and the vertical stress falls evenly downwards."""
    headline, d = run(folder, 'loading.platens={sides=true, side_friction="20 deg", shear_stiffness="400 GPa/m"}')
    mu = np.tan(np.radians(20.0))
    reaction = d.wall_reaction.values[-1]
    assert reaction[[1, 3], 1] == pytest.approx(mu * P * SIDE, rel=2.5e-2)
    assert reaction[0, 1] + reaction[[1, 3], 1].sum() == pytest.approx(-reaction[2, 1], rel=5e-3)
    assert headline["bottom_over_top_reaction"] == pytest.approx(1.0, abs=5e-3)
    row = d.vertex_position.values[d.zone_vertex.values].mean(axis=1)[:, 1].astype(int)
    weights = areas(d)
    for k in range(4):
        mean = np.average(d.zone_stress.values[-1, row == k, 1], weights=weights[row == k])
        sigma = (-reaction[2, 1] - 2.0 * mu * P * (3.5 - k)) / SIDE
        assert -mean == pytest.approx(sigma, rel=1e-2)
    assert d.friction_over_confinement.values[-1] == pytest.approx(0.0, abs=2e-3)


def test_what_is_saved_of_the_rock_is_in_balance(folder):
    """The artifact knows platens as forces on the rock: zones and forces close to round-off."""
    run(folder, 'loading.platens={friction="20 deg", sides=true, side_friction="10 deg"}')
    homogenize.run([folder / "run.nc"], folder / "curves.nc", radii=[1.9], overwrite=True)
    curves = read_artifact(folder / "curves.nc", "curves")
    assert curves.block_count.values[0] == 16
    assert np.abs(curves.balance_residual.values).max() < 1e-12
    ratio = curves.stress.values[0, :, 0] / -P
    assert curves.lateral_over_applied_stress.values[0] == pytest.approx(ratio, rel=1e-12)


def test_a_strip_below_bears_all_and_a_glued_bottom_confines(folder):
    strip = 'loading.supports=[{name="strip", start=["1 m","0 m"], end=["3 m","0 m"], fix="y"}]'
    headline, d = run(folder, strip)
    pushed = d.boundary_force.values[-1, :, 1]
    low = d.vertex_position.values[:, 1] < 1e-3
    outside = low & (np.abs(d.vertex_position.values[:, 0] - 2.0) > 1.01)
    assert not pushed[outside].any()
    assert pushed[low].sum() == pytest.approx(-d.wall_reaction.values[-1, 2, 1], rel=5e-3)
    assert headline["friction_over_confinement"] == pytest.approx(0.0, abs=1e-9)
    glued = 'loading.supports=[{start=["0 m","0 m"], end=["4 m","0 m"], fix="both"}]'
    headline, d = run(folder, glued)
    # The bottom is in compression along x: it may not widen.
    assert headline["friction_over_confinement"] > 0.01
    mean = np.average(d.zone_stress.values[-1, :, 0], weights=areas(d))
    shorter = SIDE / (SIDE - 40e-6 * d.time.values[-1])
    share = d.friction_over_confinement.values[-1]
    assert mean / -P == pytest.approx(shorter * (1.0 + share), rel=5e-3)
