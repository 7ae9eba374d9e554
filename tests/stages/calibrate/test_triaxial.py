"""calibrate on exact triaxial curves of a Mohr-Coulomb sand in closed form: every seed finds the sand, and says what
the data do not hold and whether its starts agree."""

import math

import numpy as np
import pytest
import xarray

from graben.stages.calibrate import stage as calibrate
from graben.stages.tools.check import check

E, NU, PHI, PSI = 45e6, 0.24, math.radians(33), math.radians(4)
SCENE = """
kind = "calibrate"
fidelity = "draft"
test = "triaxial"
law = "mohr-coulomb"
curves = ["sand.csv"]
[fixed]
tensile_strength = "0 Pa"
[free]
young_modulus = { lower = "8 MPa", upper = "0.8 GPa", scale = "log" }
poisson_ratio = { lower = 0.05, upper = 0.45 }
friction_angle = { lower = "20 deg", upper = "50 deg" }
dilation_angle = { lower = "0 deg", upper = "20 deg" }
cohesion = { lower = "0 Pa", upper = "50 kPa" }
[swarm]
starts = 2
[csv]
sign = "compression-positive"
"""


@pytest.fixture
def scene(tmp_path):
    up, flow = ((1 + math.sin(a)) / (1 - math.sin(a)) for a in (PHI, PSI))
    rows = ["name,time_s,stress_yy_pa,stress_xx_pa,strain_yy,strain_xx"]
    for cell in (60e3, 150e3, 500e3):
        e = np.linspace(0, 0.06, 31)
        q = np.minimum(E * e, (up - 1) * cell)
        side = -NU * q / E - 0.5 * flow * (e - q / E)
        rows += [f"{cell:g},{i},{cell + q[i]!r},{cell!r},{e[i]!r},{side[i]!r}" for i in range(len(e))]
    (tmp_path / "sand.csv").write_text("\n".join(rows).replace("np.float64(", "").replace(")", "") + "\n")
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.mark.parametrize("seed", [1, 2])
def test_every_seed_finds_the_sand(scene, tmp_path, seed):
    headline = calibrate.run(scene, tmp_path / "o.nc", overrides=[f"seed={seed}"])
    found, error = headline["parameters"], headline["standard_errors"]
    truth = {"young_modulus": E, "poisson_ratio": NU, "friction_angle": PHI, "dilation_angle": PSI}
    for name, value in truth.items():
        assert found[name] == pytest.approx(value, rel=1e-4)
        assert abs(found[name] - value) <= 4.0 * error[name] + 1e-9 * value
    assert found["cohesion"] == pytest.approx(0.0, abs=1.0)
    assert headline["not_identifiable"] == [] and headline["starts"] == "agree"
    assert not any("starts" in text for text in headline["warnings"])


def test_without_lateral_strain_poissons_ratio_and_dilation_are_not_told(scene, tmp_path):
    out = tmp_path / "o.nc"
    headline = calibrate.run(scene, out, overrides=["weights.strain=0"])
    assert headline["not_identifiable"] == ["poisson_ratio", "dilation_angle"]
    assert any("poisson_ratio, dilation_angle" in text for text in headline["warnings"])
    assert headline["parameters"]["friction_angle"] == pytest.approx(PHI, rel=1e-4)
    assert check(out) == []
    with xarray.open_dataset(out) as data:
        assert data["identifiable"].values.tolist()[1] == 0 and data.attrs["starts"] == headline["starts"]


def test_starts_that_disagree_are_told(scene, tmp_path):
    """Two starts of a few particles each, hardly refined, end anywhere."""
    poor = ["swarm.particles=2", "swarm.generations=0", "refine.best=1", "refine.iterations=1"]
    headline = calibrate.run(scene, tmp_path / "a.nc", overrides=poor)
    assert headline["starts"] == "disagree" and any("two best starts disagree" in t for t in headline["warnings"])
    headline = calibrate.run(scene, tmp_path / "b.nc", overrides=[*poor, "swarm.starts=1"])
    assert headline["starts"] == "single" and any("one start only" in t for t in headline["warnings"])
