"""The table that ends `make demo`: units of people, published numbers, warnings."""

import json

import pytest

from pipelines import summary


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (6.5e10, "Pa", "65 GPa"), (-2.5e6, "Pa", "-2.5 MPa"), (5e3, "Pa", "5 kPa"), (0.0, "Pa", "0 kPa"),
        (0.5585, "rad", "32 deg"), (0.21, "m", "210 mm"), (3.0, "m", "3 m"), (2e-6, "m", "2 um"),
        (3.53e-11, "m2", "35.3 um2"), (8.07e-7, "m3/s", "807 mm3/s"), (0.5, "1", "0.5"), (1.5, "N", "1.5 N"),
        (None, "Pa", "none"), ("ductile", "word", "ductile"),
    ],
)  # fmt: skip
def test_numbers_have_the_units_that_people_use(value, unit, text):
    assert summary.shown(value, unit) == text


def test_a_chain_is_told_with_its_published_numbers_and_warnings(tmp_path, capsys):
    up = {
        "calibration": {"law": "elastic", "parameters": {"young_modulus": 2e9, "poisson_ratio": 0.2}, "rmse_pa": 5e5,
                        "warnings": ["poisson_ratio: widen it in [free]"]},
        "calibration-udec": {"rmse_pa": 5.9e5},
        "slope": {"failure_load_pa": None, "settlement_m": 0.2},
        "slope-blocks": {"failure_load_pa": 9.3e6, "failure_load_low_pa": 9.1e6, "failure_load_high_pa": 9.5e6},
        "slope-band": {"failure_load_low_pa": 1e7, "failure_load_high_pa": 1.3e7},
        "curves-4MPa": {"paths": [{"confining_stress_pa": -4e6, "peak_stress_pa": 3.5e7}]},
    }  # fmt: skip
    mixtures = [{"name": f"mixture {k}", "wear_rate_m3_per_s": 1e-7 * k} for k in range(7)]
    wear = {"astm-g65-mixtures": {"mixtures": mixtures}, "own-bed-and-groove": {"mixtures": mixtures[:1]}}
    for chain, stages in (("upscaling", up), ("wear", wear)):
        (tmp_path / chain).mkdir()
        for name, headline in stages.items():
            (tmp_path / chain / f"{name}.json").write_text(json.dumps(headline))
        summary.write(chain, tmp_path / chain)
    told = json.loads((tmp_path / "upscaling/summary.json").read_text())
    assert (
        told["failure_load_pa"] is None
        and told["udec_rmse_pa"] == 5.9e5
        and told["blocks_failure_load_low_pa"] == 9.1e6
        and told["parameters"]["poisson_ratio"] == 0.2
    )
    summary.table(tmp_path)
    shown = capsys.readouterr().out
    # The peak of the curves in the repository at 4 MPa.
    for words in (
        "35 MPa",
        "9.3 MPa",
        "UDEC: 38.1 MPa",
        "2 GPa",
        "Y: 1.03 MPa",
        "none",
        "H: 807 mm3/s",
        "600 mm3/s",
        "in [free]",
    ):
        assert words in shown, words
