"""graben.fit, graben.plane_analysis, graben.mesh, graben.average, blocks and beds: arrays in, arrays out."""

import numpy as np
import pytest

import graben

SQUARE = [{"start": (0, 0), "end": (1, 0), "fix": "y"}, {"start": (0, 0), "end": (0, 1), "fix": "x"}]
TOP = {"name": "top", "start": (0.0, 1.0), "end": (1.0, 1.0)}
QUICK = {"swarm": {"starts": 1, "particles": 10, "generations": 20}, "refine": {"best": 2}}


def elastic():
    return graben.material("elastic", young_modulus=10e9, poisson_ratio=0.25)


def test_a_column_under_pressure_shortens_as_the_closed_form_says():
    mesh = graben.mesh.rectangle(1.0, "100 cm", 0.25)
    found = graben.plane_analysis(
        mesh, elastic(), SQUARE, [{**TOP, "pressure": "2 MPa", "rate": 1e6}],
        stepping={"goal": "end", "end": 4.0, "save_every": 2},
    )  # fmt: skip
    assert found.time.tolist() == [0.0, 2.0, 4.0] and not found.headline["failed"]
    np.testing.assert_allclose(found.stress[-1, :, 1], -6e6, rtol=1e-9)
    top = mesh.points[:, 1] == 1.0
    expected = -4e6 * (1 - 0.25**2) / 10e9  # since the state under gravity
    np.testing.assert_allclose(found.displacement[-1, top, 1], expected, rtol=1e-9)
    np.testing.assert_allclose(found.step_settlement[-1], -expected, rtol=1e-9)
    np.testing.assert_allclose(found.reaction[-1], [0.0, 6e6], atol=1e-3)


def test_arrays_are_those_of_the_stage(tmp_path):
    """The same analysis from a scene, to the bit."""
    corners = [["0 m", "0 m"], ["1 m", "0 m"], ["1 m", "1 m"], ["0 m", "1 m"]]

    def quantity(points):
        return [f"{float(c)} m" for c in points]

    scene = {
        "kind": "fem", "material": dict(elastic()),
        "loads": [{"start": ["0 m", "1 m"], "end": ["1 m", "1 m"], "rate": "1 MPa/s"}],
        "mesh": {"size": "0.25 m", "corners": corners, "patches": [[0, 1, 2, 3]], "refine": []},
        "supports": [{**s, "start": quantity(s["start"]), "end": quantity(s["end"])} for s in SQUARE],
        "gravity": {"density": "2000 kg/m^3"}, "stepping": {"goal": "end", "end": "3 s"},
    }  # fmt: skip
    here = graben.plane_analysis(
        graben.mesh.rectangle(1, 1, "0.25 m"), elastic(), SQUARE, [{**TOP, "rate": 1e6}], density=2000,
        stepping={"goal": "end", "end": "3 s"},
    )  # fmt: skip
    there = graben.run(scene)
    assert here.headline == dict(there)
    data = there.open()
    for name in ("displacement", "stress", "strain", "reaction", "step_settlement"):
        np.testing.assert_array_equal(getattr(here, name), data[name].values)


def test_curves_that_cannot_be_fitted_are_refused():
    free, fixed = {"young_modulus": (1e9, 1e11)}, {"poisson_ratio": 0.2}
    ramp = np.linspace(0.0, -0.01, 5)
    good = graben.curve(ramp, 10e9 * ramp, -0.2 * ramp)
    assert good[0].shape == (5, 4) and good[1][-1, 1] == -0.01
    fitted = graben.fit([good], "elastic", free, fixed, test="triaxial", fidelity="draft", **QUICK)
    assert fitted.parameters["young_modulus"] == pytest.approx(10e9, rel=1e-6)
    for curves, said in (
        ([], "at least one curve"),
        ([(good[0], good[1][:3])], "one shape"),
        ([3.0], "a pair of stress and strain"),
        ([graben.curve(-ramp, -10e9 * ramp, 0.2 * ramp)], "compression below zero"),
    ):
        with pytest.raises(graben.BadInput, match=said):
            graben.fit(curves, "elastic", free, fixed, fidelity="draft")
    with pytest.raises(graben.BadInput, match=r"\(lower, upper\)"):
        graben.fit([good], "elastic", {"young_modulus": "1 GPa"}, fixed)
    with pytest.raises(graben.BadInput, match=r"free.young_modulus.lower = '1 m'"):
        graben.fit([good], "elastic", {"young_modulus": ("1 m", "2 GPa")}, fixed)
    with pytest.raises(graben.BadInput, match="columns of one length"):
        graben.curve(ramp, ramp[:2], ramp)


def test_meshes_and_what_they_refuse(tmp_path):
    refine = [{"start": (0.0, 1.0), "end": (2.0, 1.0), "size": "0.1 m"}]
    coarse, fine = graben.mesh.rectangle(2, 1, 0.5), graben.mesh.rectangle(2, 1, 0.5, refine)
    assert len(coarse.quads) == 8 and len(fine.quads) > 40
    paved = graben.mesh.paved([(0, 0), (2, 0), (1, 1.5)], 0.4)
    assert paved.areas().sum() == pytest.approx(1.5)
    for call, said in (
        (lambda: graben.mesh.rectangle(2, 1, "1 kg"), "size"),
        (lambda: graben.mesh.rectangle(2, 1, -1.0), "sizes above zero"),
        (lambda: graben.mesh.paved([(0, 0), (1, 1), (1, 0), (0, 1)], 0.1), "outline"),
        (lambda: graben.mesh.mapped([(0, 0), (1, 1), (1, 0), (0, 1)], [(0, 1, 2, 3)], 0.1), "patches"),
        (lambda: graben.mesh.read(tmp_path / "nothing.msh"), "nothing.msh"),
    ):
        with pytest.raises(graben.BadInput, match=said):
            call()
    away = [{**TOP, "start": (0.0, 3.0), "end": (1.0, 3.0), "rate": 1e6}]
    with pytest.raises(graben.BadInput, match=r"loads.0 = top: expected a segment of the outline"):
        graben.plane_analysis(coarse, elastic(), SQUARE, away)


def test_an_average_in_arrays_is_that_of_the_stage(small_blocks, small_curves, small_bed):
    found, there = graben.average(small_blocks, radius="1 m"), graben.open(small_curves)
    np.testing.assert_array_equal(found.stress, there["stress"].values[0])
    np.testing.assert_array_equal(found.strain, there["strain"].values[0])
    assert found.measures["porosity"].shape == found.time.shape and found.confining_stress < 0.0
    bed = graben.average(small_bed, radius="0.14 mm")
    assert bed.stress.shape[1] == 4 and bed.stress[-1, 1] < 0.0
    with pytest.raises(graben.BadInput, match="either a `radius` or a `polygon`"):
        graben.average(small_blocks)


def test_blocks_and_a_model_that_advances():
    square = [(0, 0), (3, 0), (3, 3), (0, 3)]
    blocks = graben.voronoi_blocks(square, "60 cm", seed=3)
    again = graben.voronoi_blocks(square, 0.6, seed=3)
    assert blocks.size == again.size > 15
    np.testing.assert_array_equal(blocks.points, again.points)
    with pytest.raises(graben.BadInput, match="too small"):
        graben.voronoi_blocks(square, 30.0)
    made = graben.block_model(
        "blocks", {"domain.width": "3 m", "domain.height": "3 m", "tessellation.edge": "0.8 m"}, fidelity="draft"
    )
    made.model.advance(5)
    assert made.model.steps_done == 5 and np.isfinite(made.model.zone_stress()).all()
    with pytest.raises(graben.BadInput, match="'fem': expected 'blocks'"):
        graben.block_model("fem")


def test_a_bed_in_arrays_is_that_of_the_stage(small_bed):
    scene = graben.provenance(small_bed).scene
    bed = graben.bed(scene)
    data = graben.open(small_bed)
    np.testing.assert_array_equal(bed.position, data["position"].values[-1][: len(bed.radius)])
    assert bed.solid_fraction == data["bed_solid_fraction"].values[0]
