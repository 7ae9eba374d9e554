"""homogenize on beds of spheres: a lattice of known stress and strain, a real bed, faults."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact, write_artifact
from graben.schemas.layouts.particles import LAYOUT
from graben.schemas.provenance import Record
from graben.stages.homogenize import stage as homogenize
from graben.stages.particles import stage as particles
from graben.stages.shared.default_scene import default_scene

R, N = 0.01, 8
WIDTH = 2 * R * N
STRESS = np.array([-1e3, -2e3, -5e3])  # x, y, z (up) of the bed, Pa
GRADIENT = np.array([[0.0, 0.0, 0.004], [0.0, 0.0, 0.0], [0.0, 0.0, -0.01]])


def lattice(forces=True):
    """A periodic cubic lattice; contact forces 4 R^2 stress and an affine motion grow over the states."""
    grid = np.stack(np.meshgrid(*[np.arange(N)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    x = (2 * grid + 1.0) * R
    index = {tuple(g): k for k, g in enumerate(grid)}
    pair, normal = [], []
    for k, g in enumerate(grid):
        for axis in range(3):
            ahead = g + np.eye(3, dtype=int)[axis]
            if axis < 2:
                ahead = ahead % N
            pair.append((k, index.get(tuple(ahead), -1)))
            normal.append(np.eye(3)[axis])
        if g[2] == 0:
            pair.append((k, -1))
            normal.append(-np.eye(3)[2])
    pair, normal = np.array(pair), np.array(normal)
    push = -4 * R**2 * (normal**2 @ STRESS)
    size = {"class": 1, "bed": 1, "particle": N**3, "state": 4, "sample": 0, "side": 2, "axis": 3}
    between = pair[:, 1] >= 0
    size |= {"contact": int(between.sum()), "force": 3 * len(pair)}
    steps = np.array([0.0, 0.0, 0.5, 1.0])
    position = x + steps[:, None, None] * (x @ GRADIENT.T)
    position[..., :2] %= WIDTH
    position[0] += 0.3 * R  # poured: no matter
    arrays = {
        name: np.full([size[d] for d in v.dims], "a") if v.dtype == "U" else np.zeros([size[d] for d in v.dims])
        for name, v in LAYOUT.variables.items()
        if not v.optional
    }
    arrays |= {
        "bed_width": [WIDTH],
        "bed_piston_height": [WIDTH],
        "particle_radius": np.full(N**3, R),
        "position": position,
        "contact_particle": pair[between],
        "contact_normal": normal[between],
        "contact_force": push[between],
        "state_name": np.array(["inserted", "settled", "pressed", "quenched"]),
        "state_time": [[0.0, 1.0, 2.0, 3.0]],
    }
    if forces:
        scale = np.repeat(steps[1:], len(pair))[:, None]
        arrays |= {
            "bed_periodic": [1],
            "state_contact_count": [[0, len(pair), len(pair), len(pair)]],
            "state_contact_particle": np.tile(pair, (3, 1)),
            "state_contact_force": -scale * np.tile(push[:, None] * normal, (3, 1)),
            "state_contact_arm": np.tile(R * normal, (3, 1)),
        }
    return arrays


@pytest.mark.parametrize("centre", [None, (0.0, 0.9 * WIDTH, 0.5 * WIDTH)])
def test_a_lattice_gives_its_stress_and_strain(tmp_path, centre):
    """Also where the ball lies across the periodic sides."""
    write_artifact(tmp_path / "bed.nc", LAYOUT, lattice(), Record.begin())
    radius = 0.35 * WIDTH
    homogenize.run([tmp_path / "bed.nc"], tmp_path / "c.nc", radii=[radius], centre=centre)
    curve = read_artifact(tmp_path / "c.nc", "curves").isel(path=0)
    assert int(curve["step_count"]) == 3 and curve["time"].values.tolist() == [1.0, 2.0, 3.0]
    factor = np.array([0.0, 0.5, 1.0])
    # Vertical is z in the bed and yy in the curve; x z y become xx yy zz.
    strain = factor[:, None] * np.array([0.0, GRADIENT[2, 2], 0.0, 0.5 * GRADIENT[0, 2]])
    assert np.allclose(curve["strain"], strain, atol=1e-14)
    # Each sphere stands for a cube of the lattice, and the ball holds whole spheres.
    volume = 4 / 3 * np.pi * radius**3 * np.linalg.det(np.eye(3) + factor[:, None, None] * GRADIENT)
    share = int(curve["block_count"]) * 8 * R**3 / volume
    expected = np.append(STRESS[[0, 2, 1]], 0.0) * (factor * share)[:, None]
    assert np.allclose(curve["stress"], expected, rtol=1e-12, atol=1e-9)
    assert np.allclose(curve["solid_fraction"], np.pi / 6 * share) and 0.9 < share[0] < 1.1
    assert np.allclose(curve["coordination"], 6.0)
    assert np.allclose(curve["fabric"][:, :3], 1 / 3) and np.allclose(curve["moment_imbalance"], 0.0)


def test_older_artifacts_give_the_stress_of_the_last_state_only(tmp_path):
    write_artifact(tmp_path / "bed.nc", LAYOUT, lattice(forces=False), Record.begin())
    write_artifact(tmp_path / "new.nc", LAYOUT, lattice(), Record.begin())
    headline = homogenize.run([tmp_path / "bed.nc"], tmp_path / "c.nc", radii=[0.3 * WIDTH])
    homogenize.run([tmp_path / "new.nc"], tmp_path / "d.nc", radii=[0.3 * WIDTH])
    old, new = read_artifact(tmp_path / "c.nc", "curves"), read_artifact(tmp_path / "d.nc", "curves")
    assert np.isnan(old["stress"][0, :2]).all() and "last state only" in headline["forces"]
    assert np.allclose(old["stress"][0, 2], new["stress"][0, 2], rtol=1e-12)
    assert np.allclose(old["strain"], new["strain"], atol=1e-15)


def test_a_pressed_bed_carries_its_piston(tmp_path):
    """On average over a bed, vertical stress is the piston's pressure plus half the weight; friction takes part."""
    scene = default_scene(
        "particles",
        [
            "seed=4", "fidelity=draft", 'box.width="1 mm"', 'box.depth="0.7 mm"', 'loading.pressure="2 kPa"',
            'grains=[{name="g", diameter="100 um", share=1.0, density="2200 kg/m^3"}]', "output.vtk=false",
            "contact.friction=0.3", "contact.overlap=0.01",
        ],
    )  # fmt: skip
    particles.run(scene, tmp_path / "bed.nc")
    radius = 0.25e-3
    from graben.cli.homogenize import main

    call = [str(tmp_path / "bed.nc"), "--radius", "250 um", "-o", str(tmp_path / "c.nc"), "--json", "-q"]
    result = CliRunner().invoke(main, call)
    assert result.exit_code == 0, result.output
    path = json.loads(result.output)["paths"][0]
    assert path["volume_m3"] == pytest.approx(4 / 3 * np.pi * radius**3)
    curve = read_artifact(tmp_path / "c.nc", "curves").isel(path=0)
    assert path["vertical_stress_pa"] == pytest.approx(-2000.0, rel=0.15)
    assert -0.9 < path["lateral_stress_pa"] / 2000.0 < -0.3
    assert path["vertical_strain"] < 0.0 and 0.3 < path["porosity"] < 0.5
    # Under its own weight alone it carried hardly anything.
    assert abs(float(curve["stress"][0, 1])) < 50.0
    assert float(curve["moment_imbalance"][-1]) < 0.05


def test_faults(tmp_path):
    write_artifact(tmp_path / "bed.nc", LAYOUT, lattice(), Record.begin())
    bed, out = [tmp_path / "bed.nc"], tmp_path / "x.nc"
    with pytest.raises(BadInput, match="inside the bed"):
        homogenize.run(bed, out, radii=[0.6 * WIDTH])
    with pytest.raises(BadInput, match="inside the bed"):
        homogenize.run(bed, out, radii=[0.3 * WIDTH], centre=(0.0, 0.0, 0.1 * WIDTH))
    with pytest.raises(BadInput, match="10 spheres"):
        homogenize.run(bed, out, radii=[1.5 * R])
    with pytest.raises(BadInput, match="x, y, z"):
        homogenize.run(bed, out, radii=[0.3 * WIDTH], centre=(0.1, 0.1))
    with pytest.raises(BadInput, match="a step of the curve"):
        homogenize.run(bed, out, radii=[0.3 * WIDTH], chosen_at=3)
    with pytest.raises(BadInput, match="no outline"):
        homogenize.run(bed, out, radii=[0.3 * WIDTH], deformed=True)
    assert not out.exists()
