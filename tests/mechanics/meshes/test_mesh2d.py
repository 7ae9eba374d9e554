"""Meshes fill their domain exactly, conform, follow the wanted size, and say what is wrong with bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graben.mechanics.fem.surface import free_surface
from graben.mechanics.meshes.mapped import mapped_mesh
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.meshes.paved import paved_mesh
from graben.mechanics.meshes.sizing import SizeField

SLOPE = np.array([(0, 0), (80, 0), (80, 50), (40, 50), (30, 20), (0, 20)], float)
# A size is felt along the sides of patches, so the patches are cut at the ends of the load.
CORNERS = np.array(
    [(x, y) for y in (0, 20) for x in (0, 30, 50, 60, 80)] + [(40, 50), (55, 50), (60, 50), (80, 50)], float
)
PATCHES = np.array(
    [(0, 1, 6, 5), (1, 2, 7, 6), (2, 3, 8, 7), (3, 4, 9, 8), (6, 7, 11, 10), (7, 8, 12, 11), (8, 9, 13, 12)]
)
UNDER_LOAD = np.array([[[55.0, 50.0], [60.0, 50.0]]])


def graded(size, near, growth=0.1):
    return SizeField(size, UNDER_LOAD, np.array([near]), np.array([growth]))


@pytest.mark.parametrize("build", [lambda s: mapped_mesh(CORNERS, PATCHES, s), lambda s: paved_mesh(SLOPE, s)])
def test_the_slope_is_filled_and_its_outline_kept(build):
    mesh = build(graded(3.0, 0.6))
    assert mesh.areas().min() > 0
    np.testing.assert_allclose(mesh.areas().sum(), 2950.0, rtol=1e-12)
    edges = mesh.boundary_edges()
    length = np.hypot(*(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]).T).sum()
    np.testing.assert_allclose(length, 80 + 50 + 40 + np.hypot(10, 30) + 30 + 20, rtol=1e-12)
    # one closed ring: Euler's formula for a disc
    inner_edges = (4 * len(mesh.quads) - len(edges)) / 2
    assert len(mesh.points) - (inner_edges + len(edges)) + len(mesh.quads) == 1
    assert mesh.corner_quality().min() > 0.3


@pytest.mark.parametrize("build", [lambda s: mapped_mesh(CORNERS, PATCHES, s), lambda s: paved_mesh(SLOPE, s)])
def test_elements_are_small_where_wanted_and_no_larger_than_wanted_elsewhere(build):
    mesh = build(graded(3.0, 0.5))
    size = np.sqrt(mesh.areas())
    centre = mesh.points[mesh.quads].mean(axis=1)
    near = (np.abs(centre[:, 0] - 57.5) < 2.5) & (centre[:, 1] > 49)
    far = centre[:, 0] < 20
    assert 0.25 < np.median(size[near]) < 0.7
    assert 1.5 < np.median(size[far]) < 3.3


def test_halving_the_size_gives_about_four_times_the_elements():
    for build in (lambda s: mapped_mesh(CORNERS, PATCHES, s), lambda s: paved_mesh(SLOPE, s)):
        coarse, fine = (len(build(SizeField(h)).quads) for h in (3.0, 1.5))
        assert 3.3 < fine / coarse < 4.7


@settings(max_examples=25)
@given(st.lists(st.floats(-0.25, 0.25), min_size=8, max_size=8), st.floats(0.1, 0.4))
def test_any_convex_patch_is_filled(moves, size):
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float) + np.reshape(moves, (4, 2))
    mesh = mapped_mesh(
        corners,
        np.array([(0, 1, 2, 3)]),
        SizeField(size, np.array([[corners[0]] * 2]), np.array([size / 3]), np.array([0.2])),
    )
    x, y = corners.T
    np.testing.assert_allclose(mesh.areas().sum(), 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y), rtol=1e-10)


def test_the_sense_of_patches_and_outline_does_not_matter():
    one = mapped_mesh(CORNERS, PATCHES, SizeField(5.0))
    other = mapped_mesh(CORNERS, PATCHES[:, ::-1], SizeField(5.0))
    assert len(one.quads) == len(other.quads)
    np.testing.assert_allclose(other.areas().sum(), 2950.0)
    np.testing.assert_allclose(paved_mesh(SLOPE[::-1], SizeField(5.0)).areas().sum(), 2950.0)


def test_bad_domains_are_named():
    with pytest.raises(ValueError, match="patch 0 is not a convex"):
        mapped_mesh(np.array([(0, 0), (1, 0), (0.1, 0.1), (0, 1)], float), np.array([(0, 1, 2, 3)]), SizeField(0.5))
    hanging = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 1), (0.5, 2), (0, 2)], float)
    with pytest.raises(ValueError, match="corner 4 lies on the side from corner 2 to corner 3"):
        mapped_mesh(hanging, np.array([(0, 1, 2, 3), (3, 4, 5, 6)]), SizeField(0.5))
    with pytest.raises(ValueError, match="cross"):
        paved_mesh(np.array([(0, 0), (1, 1), (1, 0), (0, 1)], float), SizeField(0.2))
    with pytest.raises(ValueError, match="positive"):
        SizeField(-1.0)
    with pytest.raises(ValueError, match="name node 9 of 4"):
        QuadMesh(np.zeros((4, 2)), np.array([[0, 1, 2, 9]]))


def test_the_free_surface_runs_along_the_top_from_left_to_right():
    mesh = mapped_mesh(CORNERS, PATCHES, SizeField(5.0))
    held = [mesh.nodes_on_segment(*ends) for ends in (SLOPE[[0, 1]], SLOPE[[1, 2]], SLOPE[[5, 0]])]
    nodes, distance = free_surface(mesh, held)
    np.testing.assert_allclose(mesh.points[nodes[[0, -1]]], [(0, 20), (80, 50)])
    np.testing.assert_allclose(distance[-1], 30 + np.hypot(10, 30) + 40)
    assert np.all(np.diff(distance) > 0)
