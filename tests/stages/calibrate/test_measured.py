"""The same test in other spellings, from other zeros, with other signs: the same parameters; and what was read."""

import json

import numpy as np
import pytest
import xarray

from graben.stages.calibrate import stage as calibrate

SCENE = """
kind = "calibrate"
fidelity = "draft"
test = "triaxial"
law = "elastic"
[fixed]
[free]
young_modulus = { lower = "2 GPa", upper = "60 GPa", scale = "log" }
poisson_ratio = { lower = 0.05, upper = 0.45 }
[weights]
strain = 1.0
[swarm]
particles = 12
generations = 10
[csv]
sign = "compression-positive"
"""
E, NU, CELL = 30e9, 0.31, 6e6
PUSH = np.concatenate([np.linspace(0, 40e6, 15), np.linspace(35e6, 20e6, 4), np.linspace(25e6, 50e6, 6)])


def fit(folder, name, titles, columns, separator=",", mark=".", encoding="utf-8", **settings):
    (folder / "fit.toml").write_text(SCENE)
    rows = [separator.join(f"{v:.14g}".replace(".", mark) for v in row) for row in zip(*columns, strict=True)]
    file = folder / f"{name}.csv"
    file.write_bytes("\r\n".join([separator.join(titles), *rows]).encode(encoding))
    overrides = [f"{k}={v}" for k, v in settings.items()]
    return calibrate.run(folder / "fit.toml", folder / f"{name}.nc", curves=[file], overrides=overrides), file


def test_spelling_zero_and_sign_make_no_difference(tmp_path):
    axial, radial, stress = PUSH / E, -NU * PUSH / E, CELL + PUSH
    hydrostatic = (1 - 2 * NU) * CELL / E
    time, cell = 5.0 * np.arange(PUSH.size), np.full(PUSH.size, CELL)
    ours = ["time_s", "stress_yy_pa", "stress_xx_pa", "strain_yy", "strain_xx"]
    spoken = ["Time [min]", "Axial stress [MPa]", "Cell pressure [MPa]", "Axial strain [%]", "Radial strain [µm/m]"]
    plain, _ = fit(tmp_path, "plain", ours, [time, stress, cell, axial, radial])
    logged, _ = fit(tmp_path, "logged", ours, [time, stress, cell, axial + hydrostatic, radial - 3 * hydrostatic])
    turned, _ = fit(
        tmp_path, "turned", ours, [time, -stress, -cell, -axial, -radial], **{"csv.sign": '"tension-positive"'}
    )
    columns = [time / 60, stress / 1e6, cell / 1e6, 100 * axial, 1e6 * radial]
    other, file = fit(tmp_path, "other", spoken, columns, ";", ",", "cp1252")
    assert plain["parameters"] == pytest.approx({"young_modulus": E, "poisson_ratio": NU}, rel=1e-4)
    for found in (logged, turned, other):
        assert found["parameters"] == pytest.approx(plain["parameters"], rel=1e-5)
    assert turned["parameters"] == plain["parameters"]

    read = other["read"][str(file)]
    assert (read["separator"], read["decimal_mark"], read["encoding"]) == ("semicolon", "comma", "cp1252")
    assert read["tests"][0]["points"] == PUSH.size
    with xarray.open_dataset(tmp_path / "other.nc") as data:
        assert json.loads(data.attrs["read"]) == other["read"]
        assert (data["strain_measured"].values[0, 0, :2] == 0.0).all()
