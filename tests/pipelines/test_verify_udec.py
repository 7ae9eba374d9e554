"""What `make verify-udec` compares: figures and bands of curves, and the UDEC reference itself."""

import importlib.util

import numpy as np
import pytest
import xarray

from tests.conftest import PIPELINES

spec = importlib.util.spec_from_file_location("verify_udec", PIPELINES / "upscaling/verify_udec.py")
verify_udec = importlib.util.module_from_spec(spec)
spec.loader.exec_module(verify_udec)


def test_figures_of_the_udec_curves_are_the_known_ones():
    found = {c: verify_udec.figures_of(*curve) for c, curve in verify_udec.udec_curves().items()}
    assert [f["peak_pa"] / 1e6 for f in found.values()] == pytest.approx([6.61, 11.74, 21.29, 38.06], rel=2e-3)
    assert [100 * f["strain_at_peak"] for f in found.values()] == pytest.approx([1.21, 1.53, 2.62, 4.33], abs=0.01)
    assert all(1.8e9 < f["modulus_pa"] < 2.1e9 for f in found.values())


def test_bands_interpolate_each_curve_and_end_with_it():
    strain = np.column_stack([-np.linspace(0, 0.02, 5), np.linspace(0, 0.04, 5)])
    stress = np.column_stack([np.ones(5), np.linspace(0, 4e6, 5)])
    band = verify_udec.bands([(stress, strain), (2 * stress, strain)], np.array([0.01, 0.015, 0.05]))
    assert band["stress"][:, :2] == pytest.approx(np.array([[1e6, 1.5e6], [2e6, 3e6]]))
    assert np.isnan(band["stress"][:, 2]).all()
    assert band["lateral"][0, :2] == pytest.approx([0.005, 0.0075])


def test_the_name_of_a_set_of_curves_follows_what_decides_them():
    scene = PIPELINES / "upscaling/voronoi-granite.toml"
    other = PIPELINES / "upscaling/slope-blocks.toml"
    names = {verify_udec.fingerprint(s, f) for s in (scene, other) for f in ("draft", "standard")}
    assert len(names) == 4


def test_strain_of_an_artifact_counts_from_its_first_state(monkeypatch, tmp_path):
    strain = np.zeros((1, 3, 4))
    strain[0, :, 0], strain[0, :, 1] = [0.01, 0.012, 0.014], [-0.02, -0.03, -0.04]
    data = xarray.Dataset(
        {
            "step_count": ("path", [3]),
            "stress": (("path", "step", "component"), np.zeros((1, 3, 4))),
            "strain": (("path", "step", "component"), strain),
        }
    )
    monkeypatch.setattr("graben.schemas.artifact.read_artifact", lambda path, kind: data)
    _stress, found = verify_udec.our_curves(tmp_path / "curves.nc")
    np.testing.assert_allclose(found, [[0.0, 0.0], [-0.002, 0.01], [-0.004, 0.02]], atol=1e-15)
