"""Scenes of blocks laid out without a model: maps against domains, far coordinates, places in results."""

import json
import logging

import numpy as np
import pytest

from graben.errors import BadInput
from graben.schemas.artifact import read_artifact
from graben.schemas.scene import load_scene
from graben.stages.blocks.geometry import lay_out
from graben.stages.dem_run import stage as dem_run

CELLS = [(x, y) for y in (0, 1) for x in (0, 1, 2)]


def ring(x, y, dx=1.0, dy=1.0):
    return [[x, y], [x + dx, y], [x + dx, y + dy], [x, y + dy], [x, y]]


def write_map(path, rings):
    features = [
        {"type": "Feature", "properties": {"id": k}, "geometry": {"type": "Polygon", "coordinates": [r]}}
        for k, r in enumerate(rings)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))


BOX = ((0, 0), (3, 0), (3, 2), (0, 2))
HOLE = ((2.1, 1.1), (2.9, 1.1), (2.9, 1.9), (2.1, 1.9))
DIG = ((1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0))
FILE = 'method = "file"\nfile = "map.geojson"'
SETS = 'method = "joint-sets"\nsets = [{dip = "20 deg", spacing = "0.5 m"}, {dip = "110 deg", spacing = "0.5 m"}]'


def bench(folder, at=(0.0, 0.0), tessellation=FILE, domain=True, more=""):
    """A wall of blocks on a base, pressed from above; all places counted from `at`."""

    def put(corners):
        return "[" + ", ".join(f'["{x + at[0]!r} m", "{y + at[1]!r} m"]' for x, y in corners) + "]"

    write_map(folder / "map.geojson", [ring(x + at[0], y + at[1]) for x, y in CELLS])
    path = folder / "bench.toml"
    path.write_text(f"""
kind = "blocks"
fidelity = "draft"
[domain]
{"outline = " + put(BOX) if domain else ""}
holes = [{put(HOLE)}]
[tessellation]
{tessellation}
edge = "1 m"
rounding = "0.02 m"
[in_situ]
level = "{at[1] + 2.0} m"
k0 = 0.5
[programme]
end = "10 s"
save_every = "4 s"
supports = [{{start = {put(BOX[:1])[1:-1]}, end = {put(BOX[1:2])[1:-1]}}}]
loads = [{{start = {put(BOX[2:3])[1:-1]}, end = {put(BOX[3:])[1:-1]}, rate = "0.1 MPa/s"}}]
{more or f"excavations = [{{polygon = {put(DIG)}}}]"}
[numerics]
steps = 2000
[output]
vtk = false
""")
    return path


BIAXIAL = """
kind = "blocks"
fidelity = "draft"
[domain]
width = "3 m"
height = "2 m"
[tessellation]
method = "file"
file = "map.geojson"
edge = "1 m"
rounding = "0.02 m"
[loading]
speed = "0.1 mm/s"
states = 3
[numerics]
steps = 2000
[output]
vtk = false
"""


def refused(path):
    with pytest.raises(BadInput) as error:
        lay_out(load_scene(path, "blocks"))
    return str(error.value)


@pytest.mark.parametrize("at", [(466_000.0, 6_691_600.0), (-300_000.0, 1e7)])
@pytest.mark.parametrize(
    ("tessellation", "domain"), [(FILE, True), (FILE, False), ("", True), (SETS, True)], ids=str
)  # fmt: skip
def test_a_scene_far_from_zero_is_laid_out_as_near_it(tmp_path, at, tessellation, domain):
    near = lay_out(load_scene(bench(tmp_path, (0.0, 0.0), tessellation, domain), "blocks"))
    far = lay_out(load_scene(bench(tmp_path, at, tessellation, domain), "blocks"))
    assert np.array_equal(near.origin, (0.0, 0.0))
    assert np.array_equal(far.origin, at)
    assert np.array_equal(far.blocks.points, near.blocks.points)
    assert np.array_equal(far.blocks.corner, near.blocks.corner)
    assert far.scene.programme.supports == near.scene.programme.supports
    assert far.scene.programme.loads == near.scene.programme.loads
    assert far.scene.in_situ.level == near.scene.in_situ.level
    digs = [g.scene.programme.excavations[0].polygon for g in (far, near)]
    assert digs[0] == digs[1]
    holes = [g.scene.domain.holes[0] for g in (far, near)]
    assert np.allclose(*holes, atol=1e-8)
    # Of the six cells of the map the last lies in the hole.
    assert tessellation != FILE or far.blocks.size == 5


def test_results_far_from_zero_are_those_near_it_in_the_users_coordinates(tmp_path):
    at, runs = (466_000.0, 6_691_600.0), []
    for k, place in enumerate(((0.0, 0.0), at)):
        output = tmp_path / f"{k}.nc"
        headline = dem_run.run(bench(tmp_path, place, more="excavations = []"), output)
        runs.append((headline, read_artifact(output, "blocks")))
    (near, a), (far, b) = runs
    assert far.pop("holes_area_m2") == pytest.approx(near.pop("holes_area_m2"))
    assert far == near
    for name in ("vertex_position", "outline"):
        assert np.array_equal(b[name].values, a[name].values + at)
    assert np.allclose(b.contact_position.values, a.contact_position.values + at, atol=1e-8)
    assert np.array_equal(b.zone_stress.values, a.zone_stress.values)
    assert json.loads(b.attrs["cost"])["local_origin_m"] == list(at)
    assert "local_origin_m" not in json.loads(a.attrs["cost"])


def test_what_is_cut_or_dug_along_a_bow_tie_is_refused_by_its_key(tmp_path):
    bow = '[["0 m","0 m"],["1 m","1 m"],["1 m","0 m"],["0 m","1 m"]]'
    path = bench(tmp_path, more=f"excavations = [{{polygon = {bow}}}]")
    text = refused(path)
    assert "programme.excavations[0].polygon" in text
    assert "(0.5, 0.5)" in text
    path.write_text(
        path.read_text().replace("holes = [[", f"holes = [{bow}, [").replace("outline = [[", "outline = [[")
    )
    assert "domain.holes[0]" in refused(path)


def test_outlines_may_have_corners_that_do_not_turn_or_repeat(tmp_path):
    path = bench(tmp_path, tessellation="")
    plain = lay_out(load_scene(path, "blocks"))
    corner = '["3.0 m", "0.0 m"]'
    path.write_text(path.read_text().replace(f"{corner},", f'["1.0 m", "0.0 m"], {corner}, {corner},', 1))
    more = lay_out(load_scene(path, "blocks"))
    assert np.array_equal(more.blocks.points, plain.blocks.points)
    assert np.array_equal(more.blocks.outline, plain.blocks.outline)


def biaxial(folder, rings, **replaced):
    write_map(folder / "map.geojson", rings)
    path, text = folder / "biaxial.toml", BIAXIAL
    for name, value in replaced.items():
        text = text.replace(f"{name} = ", f"{name} = {value} #")
    path.write_text(text)
    return path


def test_a_map_lies_where_it_lies_but_has_the_size_of_the_domain(tmp_path):
    moved = [ring(x + 7, y - 30) for x, y in CELLS]
    assert lay_out(load_scene(biaxial(tmp_path, moved), "blocks")).blocks.size == 6
    text = refused(biaxial(tmp_path, moved, width='"30 m"', height='"20 m"'))
    assert "domain.width = 30 m: expected 3 m" in text
    assert "domain.height = 20 m: expected 2 m" in text
    # A domain by its corners is also a place.
    path = bench(tmp_path)
    write_map(tmp_path / "map.geojson", [ring(x + 3, y) for x, y in CELLS])
    text = refused(path)
    assert "a gap of" in text
    assert "reaches beyond the domain" in text


def test_gaps_overlaps_and_doubled_blocks_are_named_by_file_feature_and_place(tmp_path):
    rings = [ring(x, y) for x, y in CELLS]
    for changed, words in (
        ([ring(0, 0, dx=0.9), *rings[1:]], ["a gap of 0.1 m2 at (0.95, 0.5)", "feature 0 (id 0) and feature 1"]),
        ([ring(0, 0, dx=1.1), *rings[1:]], ["feature 0 (id 0) and feature 1 (id 1) overlap", "(1.05, 0.5)"]),
        ([*rings, rings[3]], ["feature 3 (id 3) and feature 6 (id 6) are the same polygon"]),
        ([*rings[:4], *rings[5:]], ["a gap of 1 m2 at (1.5, 1.5)"]),
    ):
        text = refused(biaxial(tmp_path, changed))
        assert all(word in text for word in (*words, "map.geojson")), text


def test_what_was_snapped_moved_and_turned_is_told(tmp_path, caplog):
    rings = [ring(x, y) for x, y in CELLS]
    rings[0] = ring(0, 0, dx=0.9997)
    with caplog.at_level(logging.WARNING):
        ground = lay_out(load_scene(biaxial(tmp_path, rings), "blocks"))
    assert ground.mended["snapped_corners"] == 2
    assert ground.mended["largest_snap_m"] == pytest.approx(3e-4)
    assert "2 corners snapped, by up to 0.0003 m" in caplog.text
    # A joint from 0.08 m beside one corner to 0.08 m beside the opposite one.
    halves = [[[0, 0], [0.08, 0], [2.92, 2], [0, 2], [0, 0]], [[0.08, 0], [3, 0], [3, 2], [2.92, 2], [0.08, 0]]]
    output = tmp_path / "o.nc"
    with caplog.at_level(logging.WARNING):
        headline = dem_run.run(biaxial(tmp_path, halves), output)
    turn = np.degrees(np.arctan2(2, 2.84) - np.arctan2(2, 3))
    told = {k: headline[k] for k in ("mended_corners", "turned_joints", "merged_blocks")}
    assert told == {"mended_corners": 2, "turned_joints": 1, "merged_blocks": 0}
    assert headline["largest_move_m"] == pytest.approx(0.08)
    assert headline["largest_turn_deg"] == pytest.approx(turn)
    assert "1 joints turned by up to" in caplog.text
    assert json.loads(read_artifact(output, "blocks").attrs["cost"])["largest_turn_deg"] == pytest.approx(turn)


def test_lateral_stress_is_taken_from_the_middle_of_the_map_wherever_it_lies(tmp_path):
    shares = []
    for x0, y0 in ((0.0, 0.0), (40.0, -70.0), (5000.0, 900.0)):
        rings = [ring(x0 + 0.5 * x, y0 + 0.5 * y, 0.5, 0.5) for x in range(6) for y in range(4)]
        scene = biaxial(tmp_path, rings, edge='"0.5 m"')
        shares.append(dem_run.run(scene, tmp_path / f"{x0}.nc")["lateral_over_applied_stress"])
    assert shares[1:] == pytest.approx(shares[:1] * 2, rel=1e-3)


def test_the_state_at_the_end_is_saved_and_what_few_states_cannot_tell_is_nan(tmp_path):
    path = bench(tmp_path, more="excavations = []")
    for every, times in (("100 s", [0.0, 10.0]), ("4 s", [0.0, 4.0, 8.0, 10.0])):
        output = tmp_path / f"{len(times)}.nc"
        headline = dem_run.run(path, output, overrides=[f'programme.save_every="{every}"'])
        assert read_artifact(output, "blocks").load_time.values == pytest.approx(times, rel=0.2)
        assert bool(np.isfinite(headline["kinetic_over_stored_energy"])) == (len(times) > 2)
        assert headline["failure_load_pa"] is None and headline["inertia_over_load"] is None
        assert headline["load_reached"] == pytest.approx(1.0, rel=1e-6)
