"""rev-study of calibrated parameters: every sample fitted, the same tests, realizations counted once."""

import numpy as np
import pytest
from click.testing import CliRunner

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact, write_artifact
from graben.schemas.layouts.blocks import LAYOUT
from graben.schemas.provenance import Record
from graben.schemas.scene import load_scene
from graben.stages.calibrate import stage as calibrate
from graben.stages.homogenize import stage as homogenize
from graben.stages.rev_study import stage as rev_study
from graben.stages.rev_study.calibration import fit_samples
from graben.stages.shared.default_scene import default_scene
from graben.stages.tools import picture
from tests.stages.homogenize.test_stage import blocks_arrays

PULLS = ["csv.allow_tension=true"]  # the walls of the synthetic runs hold them sideways
ELASTIC = """
kind = "calibrate"
law = "elastic"
fixed = {}
[free]
young_modulus = { lower = "1 MPa", upper = "500 GPa", scale = "log" }
poisson_ratio = { lower = 0.0, upper = 0.48 }
[weights]
strain = 1.0
normalise = "curve"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three seeds at two lateral stresses, and the law to fit."""
    path = tmp_path_factory.mktemp("dem")
    (path / "elastic.toml").write_text(ELASTIC)
    for seed in (11, 12, 13):
        for name, confining in (("weak", -0.5e6), ("strong", -2e6)):
            record = Record(seed=seed)
            write_artifact(path / f"{name}{seed}.nc", LAYOUT, blocks_arrays(seed, confining)[1], record)
    return path


def study(folder, *overrides):
    return default_scene(
        "rev-study",
        [
            'samples.radii=["0.8 m", "1.4 m", "2 m"]',
            "samples.grid=2",
            "processes=1",
            "fidelity=draft",
            f'calibration.scene="{folder / "elastic.toml"}"',
            *overrides,
        ],
    )


def runs_of(folder, *seeds):
    return [folder / f"{name}{seed}.nc" for name in ("strong", "weak") for seed in seeds]


def test_known_parameters_come_back_for_every_sample(folder):
    """Curves of an elastic solid in plane strain, other moduli in every sample; two confinements each."""
    law = load_scene(folder / "elastic.toml", "calibrate")
    rng = np.random.Generator(np.random.PCG64(3))
    shape = (2, 3, 2)
    young, poisson = rng.uniform(1e9, 9e9, shape), rng.uniform(0.1, 0.4, shape)
    groups = np.array([[0, 3], [2, 1]])
    stress, strain = np.full((2, 3, 4, 6, 4), np.nan), np.full((2, 3, 4, 6, 4), np.nan)
    axial = -np.linspace(0.0, 2e-3, 5)
    for place in np.ndindex(*shape):
        e, nu = young[place], poisson[place]
        for level, run in zip((-1e6, -3e6), groups[place[2]]):
            at = (*place[:2], run)
            # plane strain, lateral stress held: d syy = E/(1 - nu^2) d eyy, d exx = -nu/(1 - nu) d eyy
            yy = level + e / (1 - nu**2) * axial
            xx = np.full(5, level)
            first = nu * (xx + yy)
            stress[at][:5] = np.stack([xx, yy, first, np.zeros(5)], axis=1)
            strain[at][:5] = np.stack([-nu / (1 - nu) * axial, axial, np.zeros(5), np.zeros(5)], axis=1)
    fits = fit_samples(study(folder), law, stress, strain, groups, 1, 1, None, lambda f, words: None)
    assert fits.names == ("young_modulus", "poisson_ratio") and fits.units == ("Pa", "1")
    assert np.allclose(fits.value[0], young, rtol=1e-4)
    assert np.allclose(fits.value[1], poisson, rtol=1e-3)
    assert fits.identifiable.all() and not fits.at_bound().any()
    assert fits.stress_rmse.max() < 1e3


def test_a_study_of_parameters(folder, tmp_path):
    runs = runs_of(folder, 13, 11, 12)
    headline = rev_study.run(runs, study(folder), tmp_path / "one.nc")
    data = read_artifact(tmp_path / "one.nc", "rev-study")
    assert headline["realizations"] == 3 and data.attrs["bootstrap_over"] == "runs"
    assert data["parameter_value"].shape == (2, 3, 4, 3) and "secant_modulus_mean" not in data
    assert data["parameter_name"].values.tolist() == ["young_modulus", "poisson_ratio"]
    assert float(data["confining_stress"]) == -0.5e6
    # Runs of one seed belong together, whatever their order.
    names, mates = data["run_name"].values, data["run_realization"].values
    assert {(str(n)[-2:], int(m)) for n, m in zip(names, mates)} == {("11", 0), ("12", 1), ("13", 2)}
    # The fit of one sample is that of calibrate, by way of homogenize.
    run = list(names).index("weak12")
    x, y = data["centre_position"].values[run, 3]
    sources = [folder / "weak12.nc", folder / "strong12.nc"]
    homogenize.run(sources, tmp_path / "c.nc", radii=[1.4], centre=(float(x), float(y)))
    found = calibrate.run(folder / "elastic.toml", tmp_path / "fit.nc", curves=[tmp_path / "c.nc"], overrides=PULLS)
    value = data["parameter_value"].values[:, 1, 3, 1]
    assert value == pytest.approx([found["parameters"][n] for n in ("young_modulus", "poisson_ratio")], rel=1e-3)
    assert float(data["fit_rmse"][1, 3, 1]) == pytest.approx(found["rmse_pa"], rel=1e-3, abs=1.0)
    assert np.allclose(data["parameter_mean"], data["parameter_value"].values.mean(axis=(2, 3)), rtol=1e-12)
    # Any number of workers gives the same.
    rev_study.run(runs, study(folder, "processes=2"), tmp_path / "two.nc")
    assert data.identical(read_artifact(tmp_path / "two.nc", "rev-study").assign_attrs(data.attrs))
    picture.run(tmp_path / "one.nc", tmp_path / "one.png")
    assert (tmp_path / "one.png").stat().st_size > 10_000


def test_faults_of_a_study_of_parameters(folder, tmp_path):
    out = tmp_path / "x.nc"
    with pytest.raises(BadInput, match=r"seeds \[11, 12\]"):
        rev_study.run(runs_of(folder, 11, 12)[1:], study(folder), out)
    with pytest.raises(BadInput, match="one realization"):
        rev_study.run([folder / "weak11.nc"] * 2, study(folder), out)
    with pytest.raises(BadInput, match="free parameter"):
        rev_study.run(runs_of(folder, 11), study(folder, 'calibration.properties=["cohesion"]'), out)
    with pytest.raises(BadInput, match="existing"):
        study(folder, 'calibration.scene="none.toml"')
    with pytest.raises(BadInput, match="unless it calibrates"):
        plain = default_scene("rev-study", ['samples.radii=["0.8 m", "2 m"]'])
        rev_study.run(runs_of(folder, 11), plain, out)
    assert not out.exists()


def test_calibrate_on_the_command_line(folder, tmp_path):
    from graben.cli.rev_study import main

    call = [*map(str, runs_of(folder, 11)), "--calibrate", str(folder / "elastic.toml"), "--grid", "2"]
    radii = ["--radius", "1 m", "--radius", "1.8 m", "--processes", "1"]
    result = CliRunner().invoke(main, [*call, *radii, "-o", str(tmp_path / "r.nc"), "-q"])
    assert result.exit_code == 0, result.output
    data = read_artifact(tmp_path / "r.nc", "rev-study")
    assert data.attrs["law"] == "elastic" and data["parameter_value"].shape == (2, 2, 4, 1)
