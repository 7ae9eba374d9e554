"""A mesh is one body of convex quads, or is mended where that has one meaning, or every fault is named."""

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.meshes.one_body import NotOneBody, one_body


def grid(nx=3, ny=2, at=(0.0, 0.0), size=1.0):
    """Points and quads of a block of nx x ny squares."""
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    points = np.stack([i.ravel(), j.ravel()], axis=1) * size + at
    first = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    return points.astype(float), np.stack([first, first + ny + 1, first + ny + 2, first + 1], axis=1)


def together(*parts):
    """Blocks as one mesh that shares no node."""
    counts = np.cumsum([0] + [len(points) for points, _ in parts])
    return np.concatenate([p for p, _ in parts]), np.concatenate([q + n for (_, q), n in zip(parts, counts)])


def refusal(points, quads, numbers=None) -> list:
    with pytest.raises(NotOneBody) as caught:
        one_body(points, quads, numbers)
    assert isinstance(caught.value, Refused)
    return caught.value.faults


def test_a_whole_mesh_is_left_as_it_is():
    points, quads = grid()
    mesh, notes = one_body(points, quads)
    assert notes == []
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.quads, quads)


def test_clockwise_and_doubled_elements_and_unused_nodes_are_mended_with_a_count():
    points, quads = grid()
    quads[1] = quads[1][::-1]
    doubled = np.concatenate([quads, np.roll(quads[:2], 1, axis=1)])
    mesh, notes = one_body(np.concatenate([points, [[9.0, 9.0]]]), doubled, 10 + np.arange(8))
    assert len(mesh.points) == 12 and len(mesh.quads) == 6
    np.testing.assert_allclose(mesh.areas(), 1.0)
    assert notes == [
        "2 clockwise elements were turned",
        "2 elements are written twice and kept once (the first is number 16)",
        "1 nodes of no element were dropped",
    ]


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        ([0, 3, 3, 1], "name a node twice"),
        ([0, 3, 1, 4], "cross themselves"),
        ([0, 3, 6, 9], "no area"),
        ([0, 6, 8, 12], "not convex"),
        ([0, 3, 6, 7], "almost straight"),
    ],
)
def test_elements_that_are_no_convex_quads_are_named_with_their_place(corners, words):
    points = np.concatenate([grid()[0], [[0.9, 0.2]]])
    quads = grid()[1]
    quads[4] = corners
    for sense in (1, -1):
        quads[4] = quads[4][::sense]
        [fault] = refusal(points, quads, 100 + np.arange(len(quads)))
        assert words in fault.what and fault.elements.tolist() == [104]
        np.testing.assert_allclose(fault.places, [points[corners].mean(axis=0)])


@pytest.mark.parametrize("shift", [0.0, 1e-7, 5e-4])
def test_a_seam_of_coincident_nodes_is_found(shift):
    points, quads = together(grid(2, 2), grid(2, 2, at=(2.0 + shift, 0.0)))
    seam, parts = refusal(points, quads)
    assert "6 nodes lie on another node" in seam.what and "2 parts of 4, 4 elements" in parts.what
    assert np.all(np.abs(seam.places[:, 0] - 2.0) < 1.0) and sorted(seam.elements.tolist()) == [2, 3, 4, 5]


def test_a_seam_inside_one_part_is_found():
    """A slit: the elements hang together around its end, so that parts alone would not tell."""
    points, quads = grid(4, 2)
    slit = np.flatnonzero((points == (2.0, 0.0)).all(axis=1))[0]
    quads[quads == slit] = np.where(np.isin(np.nonzero(quads == slit)[0], [2, 3]), slit, len(points))
    [seam] = refusal(np.concatenate([points, [[2.0, 0.0]]]), quads)
    assert "2 nodes lie on another node" in seam.what


def test_a_hanging_node_is_found_at_its_place():
    """Two small elements against the side of a large one; they share its corners."""
    points = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (3, 0), (3, 1), (3, 2), (2, 1)], float)
    quads = np.array([[0, 1, 2, 3], [1, 4, 5, 7], [7, 5, 6, 2]])
    faults = refusal(points, quads)
    hanging = next(f for f in faults if "hang" in f.what)
    assert hanging.elements.tolist() == [0]
    np.testing.assert_allclose(hanging.places, [(2.0, 1.0)])


def test_elements_that_overlap_are_named():
    points, quads = grid(3, 1)
    more = np.array([(0.5, 0.2), (0.9, 0.2), (0.9, 0.6), (0.5, 0.6)])
    faults = refusal(np.concatenate([points, more]), np.concatenate([quads, [[8, 9, 10, 11]]]))
    overlap = next(f for f in faults if "overlap" in f.what)
    assert overlap.elements.tolist() == [0, 3]
    np.testing.assert_allclose(overlap.places, [(0.7, 0.4)] * 2)


def test_a_mesh_that_folds_back_onto_itself_overlaps():
    points = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0.2, 0), (0.2, 1)], float)
    faults = refusal(points, np.array([[0, 1, 2, 3], [1, 2, 5, 4]]))
    fault = next(f for f in faults if "overlap" in f.what)
    assert fault.elements.tolist() == [0, 1]


def test_loose_parts_and_hinges_are_named():
    [fault] = refusal(*together(grid(3, 2), grid(1, 1, at=(7.0, 0.0))))
    assert "2 parts of 6, 1 elements" in fault.what and fault.elements.tolist() == [6]
    np.testing.assert_allclose(fault.places, [(7.5, 0.5)])
    points, quads = grid(2, 2)
    [hinge] = refusal(points, quads[[0, 3]])
    assert "joined at single nodes" in hinge.what


def test_a_body_with_a_hole_and_strong_grading_is_whole():
    points, quads = grid(9, 9)
    centre = points[quads].mean(axis=1)
    hole = (np.abs(centre - 4.5) < 1.1).all(axis=1)
    mesh, notes = one_body((points / 9.0) ** 5, quads[~hole])
    assert len(mesh.quads) == 72 and notes == ["4 nodes of no element were dropped"]


def test_faults_come_together_and_size_does_not_matter():
    for scale in (1e-6, 1e6):
        points, quads = together(grid(2, 2, size=scale), grid(2, 2, at=(2 * scale, 0.0), size=scale))
        assert len(refusal(points, quads)) == 2
        quads[0] = quads[0][[0, 2, 1, 3]]
        quads[5] = quads[5][[0, 1, 1, 3]]
        assert len(refusal(points, quads)) == 2
