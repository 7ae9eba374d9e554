"""Groove geometry against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.wear.groove import cut, measure, signed_areas, volume_ledger

R, D = 50e-6, 2e-6


def dent(y: np.ndarray, x: float = 0.0) -> np.ndarray:
    """Surface with the print of a sphere of radius R and depth D."""
    inside = R**2 - x**2 - y**2
    return np.minimum(0.0, R - D - np.sqrt(np.maximum(inside, 0.0)))


@pytest.mark.parametrize("symmetric", [True, False])
def test_print_of_a_sphere_is_the_circular_segment(symmetric: bool) -> None:
    half = np.sqrt(2 * R * D - D**2)
    segment = R**2 * np.arccos(1 - D / R) - (R - D) * half
    y = np.linspace(0.0 if symmetric else -20e-6, 20e-6, 4001)
    s = measure(y, dent(y), symmetric)
    assert s.groove_area == pytest.approx(segment, rel=1e-5)
    assert segment == pytest.approx(37.5e-12, rel=2e-2)
    assert s.shoulder_area == 0.0 and s.degree_of_wear == 1.0
    assert s.width == pytest.approx(2 * half, rel=1e-3)
    assert s.depth == pytest.approx(D, rel=1e-6)
    assert s.degree_of_penetration == pytest.approx(D / half, rel=1e-3)


def test_areas_of_a_polyline_are_exact() -> None:
    below, above = signed_areas(np.array([0.0, 1.0, 2.0, 4.0]), np.array([-1.0, -1.0, 1.0, 0.0]))
    assert below == pytest.approx(1.25) and above == pytest.approx(1.25)
    s = measure(np.array([0.0, 1.0, 2.0, 4.0]), np.array([-1.0, -1.0, 1.0, 0.0]), True)
    assert s.degree_of_wear == pytest.approx(0.0)
    assert s.width == pytest.approx(3.0) and s.degree_of_penetration == pytest.approx(2.0 / 3.0)


def test_no_groove_has_no_degree_of_wear() -> None:
    s = measure(np.array([0.0, 1.0]), np.array([0.1, 0.0]), True)
    assert s.groove_area == 0.0 and np.isnan(s.degree_of_wear) and s.width == 0.0


def test_bad_sections_are_refused() -> None:
    for y, z in (([0.0, 1.0], [0.0]), ([1.0, 0.0], [0.0, 0.0]), ([0.0, np.nan], [0.0, 0.0]), ([0.0], [0.0])):
        with pytest.raises(ValueError, match="section"):
            measure(np.array(y), np.array(z), True)


def surface(z_of, n: int = 40, size: float = 30e-6):  # type: ignore[no-untyped-def]
    x, y = np.linspace(-size, size, 2 * n + 1), np.linspace(0.0, size, n + 1)
    gx, gy = np.meshgrid(x, y, indexing="ij")
    points = np.stack([gx, gy, z_of(gx, gy)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(2 * n), np.arange(n), indexing="ij")
    corner = (i * (n + 1) + j).ravel()
    faces = np.stack([corner, corner + n + 1, corner + n + 2, corner + 1], axis=1)
    return points, faces


def test_cut_finds_the_height_and_takes_the_upper_sheet() -> None:
    points, faces = surface(lambda x, y: 0.1 * x - 0.2 * y)
    y = np.linspace(0, 29e-6, 57)
    np.testing.assert_allclose(cut(points, faces, 3.3e-6, y), 0.33e-6 - 0.2 * y, atol=1e-18)
    upper, more = surface(lambda x, y: 0 * x + 1e-6)
    both = np.concatenate([points, upper])
    z = cut(both, np.concatenate([faces, more + len(points)]), 3.3e-6, y)
    np.testing.assert_allclose(z, 1e-6)
    assert np.isnan(cut(points, faces, 1.0, y)).all()


def test_volume_ledger_closes_on_the_prism_volumes() -> None:
    """Any warped surface: its parts add up to the exact integral of the height."""
    wave = lambda x, y: 1e-6 * np.sin(2.5e5 * x) * np.cos(2e5 * y) - 2e-7  # noqa: E731
    points, faces = surface(wave)
    n = points[faces]
    exact = float(n[:, :, 2].mean(axis=1).sum()) * (30e-6 / 40) ** 2
    v = volume_ledger(points, faces, 5e-6, 1.0e-12, 1.0e-12 + exact, 0.0)
    assert v.groove > 0 and v.shoulders > 0 and v.bow > 0
    assert v.shoulders + v.bow - v.groove == pytest.approx(2 * exact, rel=1e-9)
    assert abs(v.closure) < 1e-6


def test_ledger_of_a_sphere_print_is_the_cap() -> None:
    points, faces = surface(lambda x, y: np.where(x**2 + y**2 < R**2, dent(y, x), 0.0), n=200)
    v = volume_ledger(points, faces, 0.0, 0.0, 0.0, 0.0)
    cap = np.pi * D**2 * (3 * R - D) / 3
    assert v.groove == pytest.approx(cap, rel=2e-3)
    assert v.shoulders == 0.0 and v.bow == 0.0
