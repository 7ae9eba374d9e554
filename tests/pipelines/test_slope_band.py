"""What the chain says about the slope's load: parameter sets drawn, and the width of zones that shear."""

import importlib.util

import numpy as np
import pytest

from tests.conftest import PIPELINES


def load(name):
    spec = importlib.util.spec_from_file_location(name, PIPELINES / f"upscaling/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


slope_band, softening_width = load("slope_band"), load("softening_width")


def test_drawn_sets_have_the_covariance_they_are_drawn_from_and_stay_in_their_ranges():
    lower, upper, log = np.array([0.0, 1e3]), np.array([1.0, 1e5]), np.array([False, True])
    value = np.array([0.5, 1e4])
    root = np.array([[0.05, 0.0], [0.03, 0.04]])
    sets = slope_band.drawn(value, lower, upper, log, root, 4000)
    unit = np.column_stack([sets[:, 0], (np.log10(sets[:, 1]) - 3.0) / 2.0])
    assert unit.mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.005)
    assert np.cov(unit.T) == pytest.approx(root @ root.T, rel=0.1)
    wild = slope_band.drawn(value, lower, upper, log, 50.0 * root, 200)
    assert (wild >= lower * (1 - 1e-12)).all() and (wild <= upper * (1 + 1e-12)).all()


def test_shear_strain_of_a_linear_field_is_its_own_and_everything_takes_part():
    points = softening_width.circle_grid(np.array([5.0, 5.0]), 2.0)
    position = np.random.Generator(np.random.PCG64(1)).uniform(2.0, 8.0, (600, 2))
    gradient = np.array([[0.02, 0.03], [0.01, -0.04]])
    shear = softening_width.shear_strain(position, position @ gradient.T, points, 0.8)
    assert shear == pytest.approx(np.full(len(points), np.hypot(0.06, 0.04)), rel=1e-9)
    assert softening_width.participation(shear) == pytest.approx(1.0)


def test_a_band_over_a_quarter_of_the_circle_is_a_quarter():
    shear = np.zeros(400)
    shear[:100] = 0.3
    assert softening_width.participation(shear) == pytest.approx(0.25)
