"""Fits at the edges: exact data, thousands of points, all on bounds, nothing to see, failures in between."""

import json

import numpy as np
import pytest

from tests.conftest import command

E, NU, CELL = 10e9, 0.25, 1e6
PLANE = E / (1 - NU**2)
FREE = (
    '[free]\nyoung_modulus = {lower = "1 GPa", upper = "50 GPa", scale = "log"}\n'
    "poisson_ratio = {lower = 0.05, upper = 0.45}\n"
)


def curve(path, strain, stress, lateral):
    rows = "".join(
        f"{k},{-CELL!r},{s!r},{x!r},{y!r}\n"
        for k, (y, s, x) in enumerate(zip(strain.tolist(), stress.tolist(), lateral.tolist(), strict=True))
    )
    path.write_text("time_s,stress_xx_pa,stress_yy_pa,strain_xx,strain_yy\n" + rows)


def elastic(path, points=40):
    e = -np.linspace(0.0, 0.004, points)
    curve(path, e, -CELL + PLANE * e, -NU / (1 - NU) * e)


def fitted(folder, free=FREE, law="elastic", fixed="", starts=2):
    (folder / "scene.toml").write_text(
        f'kind = "calibrate"\ncurves = ["curve.csv"]\nlaw = "{law}"\n[fixed]\n{fixed}\n{free}'
        f"[swarm]\nstarts = {starts}\nparticles = 8\ngenerations = 5\n[refine]\nbest = 2\niterations = 15\n"
    )
    return command("calibrate", folder / "scene.toml", "-o", folder / "c.nc", "--overwrite", "--json", "-q")


def told(result):
    assert result.exit_code == 0, result.output
    assert "nan" not in result.stdout.lower()
    return json.loads(result.stdout)


@pytest.mark.parametrize("points", [2, 40, 10_000])
def test_exact_data_come_back_exactly(tmp_path, points):
    """One curve of the law itself, of two points and of ten thousand; no parameter is in doubt."""
    elastic(tmp_path / "curve.csv", points)
    found = told(fitted(tmp_path))
    assert found["parameters"]["young_modulus"] == pytest.approx(E, rel=1e-9)
    assert found["parameters"]["poisson_ratio"] == pytest.approx(NU, rel=1e-9)
    assert found["not_identifiable"] == [] and found["warnings"] == []


def test_all_parameters_on_bounds_are_named_and_have_no_error(tmp_path):
    elastic(tmp_path / "curve.csv")
    free = FREE.replace('"1 GPa"', '"20 GPa"').replace("0.05", "0.3")
    found = told(fitted(tmp_path, free))
    assert found["at_bounds"] == ["young_modulus", "poisson_ratio"]
    assert found["parameters"] == {"young_modulus": 20e9, "poisson_ratio": 0.3}
    assert set(found["standard_errors"].values()) == {None}
    assert any("bound chose the value" in w for w in found["warnings"])
    # A second run takes the first one's place, warnings in its material file or not.
    assert told(fitted(tmp_path))["at_bounds"] == []
    assert told(fitted(tmp_path, free))["at_bounds"] != []
    assert told(fitted(tmp_path, free))["at_bounds"] != []


def test_a_flat_objective_tells_no_parameter(tmp_path):
    """A strength of GPa that curves of MPa never reach: both its parameters are not identifiable."""
    elastic(tmp_path / "curve.csv")
    free = (
        '[free]\nfriction_angle = {lower = "10 deg", upper = "60 deg"}\n'
        'cohesion = {lower = "1 GPa", upper = "2 GPa"}\n'
    )
    fixed = 'young_modulus = "10 GPa"\npoisson_ratio = 0.25\ndilation_angle = "0 deg"'
    found = told(fitted(tmp_path, free, "mohr-coulomb", fixed))
    assert found["not_identifiable"] == ["friction_angle", "cohesion"] and found["unseen_directions"] == 2
    assert found["rmse_pa"] < 1.0 and found["warnings"]


def test_an_objective_that_fails_in_half_of_the_space_finds_the_other_half(tmp_path):
    """Dilation above friction is no material: half of the box. A material of the other half comes back."""
    from graben.mechanics.materials.laws import pack
    from graben.mechanics.materials.point import follow

    truth = {"young_modulus": E, "poisson_ratio": NU, "friction_angle": 0.5, "cohesion": 2e6, "dilation_angle": 0.2}
    path = np.zeros((60, 4))
    path[:, 0], path[:, 1] = -CELL, -np.linspace(0.0, 0.01, 60)
    r = follow("mohr-coulomb", pack("mohr-coulomb", truth), "seee", path, stress=np.array([-CELL, -CELL, -CELL, 0.0]))
    curve(tmp_path / "curve.csv", r.strain[0, :, 1], r.stress[0, :, 1], r.strain[0, :, 0])
    free = (
        '[free]\nfriction_angle = {lower = "1 deg", upper = "60 deg"}\n'
        'dilation_angle = {lower = "1 deg", upper = "60 deg"}\n'
    )
    fixed = 'young_modulus = "10 GPa"\npoisson_ratio = 0.25\ncohesion = "2 MPa"'
    found = told(fitted(tmp_path, free, "mohr-coulomb", fixed, starts=3))
    assert found["parameters"]["friction_angle"] == pytest.approx(0.5, rel=1e-3)
    assert found["parameters"]["dilation_angle"] == pytest.approx(0.2, rel=2e-2)


def test_a_curve_without_strain_is_refused(tmp_path):
    elastic(tmp_path / "curve.csv")
    e = np.zeros(40)
    curve(tmp_path / "curve.csv", e, -CELL - np.arange(40.0), e)
    result = fitted(tmp_path)
    assert result.exit_code == 2 and "axial strain that changes" in result.stderr


@pytest.mark.parametrize("unit", ["Pa", "kPa", "MPa"])
def test_a_table_in_other_units_gives_the_same_law(tmp_path, unit):
    elastic(tmp_path / "curve.csv")
    factor = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6}[unit]
    lines = (tmp_path / "curve.csv").read_text().splitlines()
    rows = [[float(v) for v in line.split(",")] for line in lines[1:]]
    text = lines[0].replace("_pa", f"_{unit.lower()}") + "\n"
    text += "".join(f"{t!r},{xx / factor!r},{yy / factor!r},{ex!r},{ey!r}\n" for t, xx, yy, ex, ey in rows)
    (tmp_path / "curve.csv").write_text(text)
    assert told(fitted(tmp_path))["parameters"]["young_modulus"] == pytest.approx(E, rel=1e-9)
