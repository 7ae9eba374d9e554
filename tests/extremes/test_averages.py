"""Averages at the edges: one block, an area beyond the body, a pinched outline, one sample; invariance."""

import json
from dataclasses import replace

import numpy as np
import pytest

from graben.errors import Refused
from graben.mechanics.averaging.history import average
from graben.mechanics.averaging.network import build_network
from graben.mechanics.averaging.outline import find_outline, outline_area
from graben.mechanics.averaging.representative import Criteria, convergence, once_each
from graben.mechanics.averaging.rev import Circle
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons
from graben.schemas.artifact import read_artifact
from graben.stages.blocks.history import read_run
from tests.conftest import command
from tests.extremes.columns import PLANE, column, compress


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """A single block of 1 m, compressed."""
    folder = tmp_path_factory.mktemp("one")
    compress(folder, column(1))
    return folder / "run.nc"


def averaged(path, *arguments):
    return command("homogenize", path, *arguments, "-o", path.with_name("c.nc"), "--overwrite", "--json", "-q")


@pytest.mark.parametrize("radius", ["1 um", "0.3 m", "0.49 m"])
def test_an_area_of_one_block_is_that_block(block, radius):
    """Any circle within it: stress over strain is E / (1 - nu2), stress from zones that from the outline."""
    result = averaged(block, "--radius", radius)
    assert result.exit_code == 0, result.output
    path = json.loads(result.stdout)["paths"][0]
    assert path["blocks"] == 1 and path["area_m2"] == pytest.approx(1.0, rel=1e-4)
    curves = read_artifact(block.with_name("c.nc"), "curves")
    modulus = np.ptp(curves["stress"].values[0, :, 1]) / np.ptp(curves["strain"].values[0, :, 1])
    assert modulus == pytest.approx(PLANE, rel=3e-3)
    assert path["strain_closure"] < 1e-15 and path["boundary_stress_difference"] < 2e-3


@pytest.mark.parametrize("arguments", [
    ("--radius", "100 m"), ("--radius", "0.3 m", "--centre", "1e7 m, 0 m"),
    ("--polygon", "0.1 m,0.1 m; 0.9 m,0.1 m; 0.5 m,0.1 m"), ("--radius", "0 m"),
])  # fmt: skip
def test_areas_that_are_none_are_refused(block, arguments):
    result = averaged(block, *arguments)
    assert result.exit_code == 2 and "expected" in result.stderr


def squares(*corners):
    shapes = [np.array([(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)], float) for x, y in corners]
    outline = np.array([(0, 0), (3, 0), (3, 3), (0, 3)], float)
    b = build_bodies(from_polygons(shapes, outline))
    counts = np.diff(b.block_start)
    return build_network(b.position, len(counts), b.zone_vertex, b.zone_block, counts, b.block_corner)


def test_an_outline_pinched_at_a_corner_keeps_what_hangs_together():
    """Two squares side by side, and a third that only touches a corner of theirs: it is loose, and left out."""
    network = squares((0, 0), (1, 0), (2, 1))
    outline = find_outline(network, Circle((1.5, 1.0), 1.2))
    area = float(outline_area(outline.follow(network.position)))
    assert area == pytest.approx(float(outline.blocks.sum()), rel=1e-9)
    assert area == pytest.approx(2.0, rel=1e-9)


def test_an_area_that_meets_no_block_is_refused():
    with pytest.raises(Refused):
        find_outline(squares((0, 0), (1, 0)), Circle((2.5, 2.5), 0.2))


def test_one_sample_has_no_interval_and_recommends_nothing(small_blocks, tmp_path):
    result = command(
        "rev-study", small_blocks, "--radius", "0.5 m", "--radius", "1 m", "--grid", "1", "--processes", "1",
        "-o", tmp_path / "r.nc", "--json", "-q",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["recommended_radius_m"] is None
    modulus = found["properties"][0]
    assert modulus["low_pa"] is None and modulus["high_pa"] is None and modulus["variation"] is None
    assert modulus["mean_pa"] > 0.0
    assert command("check", tmp_path / "r.nc").exit_code == 0
    assert command("show", tmp_path / "r.nc", "-o", tmp_path / "r.png").exit_code == 0


def test_samples_of_one_block_are_one_sample(block, tmp_path):
    """A study of a single block has one value, however many circles lie in it: nothing is recommended."""
    result = command(
        "rev-study", block, "--radius", "0.2 m", "--radius", "0.3 m", "--grid", "2", "--processes", "1",
        "-o", tmp_path / "r.nc", "--json", "-q",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["recommended_radius_m"] is None
    study = read_artifact(tmp_path / "r.nc", "rev-study")
    assert study["secant_modulus_count"].values.tolist() == [1, 1]
    assert study["independent_samples"].values.tolist() == [1.0, 1.0]


def test_samples_alike_are_told_by_their_blocks():
    assert once_each([b"a", b"b", b"a", b"a", b"c"]).tolist() == [True, True, False, False, True]
    one = convergence(np.full((2, 1, 1), 3.0), Criteria(), 0)
    assert one.mean.tolist() == [3.0, 3.0] and np.isnan([*one.low, *one.high, *one.deviation]).all()


def moved(history, turn, shift, scale):
    """The same run in turned, shifted and scaled coordinates; stress and forces per length go along."""
    q = np.asarray(turn, float)
    x = scale * history.position @ q.T + shift
    c = history.contacts
    xx, yy, zz, xy = np.moveaxis(history.zone_stress, -1, 0)
    s = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
    s = np.einsum("ij,...jk,lk->...il", q, s, q)
    stress = np.stack([s[..., 0, 0], s[..., 1, 1], zz, s[..., 0, 1]], axis=-1)
    contacts = replace(
        c, position=scale * c.position @ q.T + shift, force=scale * c.force @ q.T, length=scale * c.length,
        slip=scale * c.slip, tangent=None if c.tangent is None else c.tangent @ q.T,
        moment=None if c.moment is None else scale**2 * c.moment @ q.T,
    )  # fmt: skip
    return type(history)(
        history.time, x, scale * history.displacement @ q.T, history.vertex_block, history.zone_vertex,
        history.zone_block, history.corner_count, history.corner, stress, contacts,
        scale * history.vertex_force @ q.T,
    )  # fmt: skip


@pytest.mark.parametrize(("turn", "shift", "scale"), [
    ([[0, -1], [1, 0]], 0.0, 1.0), ([[1, 0], [0, 1]], 1e6, 1.0), ([[1, 0], [0, 1]], 0.0, 1e-6),
    ([[1, 0], [0, 1]], 0.0, 1e3),
], ids=["turned", "shifted", "um", "km"])  # fmt: skip
def test_averages_turn_shift_and_scale_with_the_run(small_blocks, turn, shift, scale):
    history = read_run(small_blocks).history
    q = np.array(turn, float)
    centre = scale * q @ np.array([1.5, 1.5]) + shift
    one = average(history, Circle((1.5, 1.5), 1.0))
    other = average(moved(history, turn, shift, scale), Circle((float(centre[0]), float(centre[1])), scale))
    assert other.outline.blocks.tolist() == one.outline.blocks.tolist()
    assert other.area == pytest.approx(scale**2 * one.area, rel=1e-8)
    for name, size in (("stress", 1e6), ("strain", 1e-3), ("stress_boundary", 1e6)):
        a, b = getattr(one, name), getattr(other, name)
        order = [1, 0, 2, 3] if turn[0][0] == 0 else [0, 1, 2, 3]
        sign = np.array([1, 1, 1, -1 if turn[0][0] == 0 else 1])
        np.testing.assert_allclose(b, (a * sign)[:, order], rtol=1e-5, atol=1e-5 * size)
