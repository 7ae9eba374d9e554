"""wear-estimate: H's table 8.4, load balance, beds and faults."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from graben.cli.wear_estimate import main
from graben.errors import BadInput
from graben.schemas.artifact import check_artifact, read_artifact, write_artifact
from graben.schemas.layouts.particles import LAYOUT as PARTICLES
from graben.schemas.layouts.scratch import LAYOUT as SCRATCH
from graben.schemas.provenance import Record
from graben.stages.wear_estimate import stage as wear_estimate

SCENES = Path(__file__).parents[3] / "pipelines" / "wear"
TABLE = SCENES / "astm-g65-mixtures.toml"
PUBLISHED = [8.07e-7, 7.67e-7, 6.83e-7, 5.87e-7, 4.68e-7, 2.93e-7, 0.44e-7]


def test_h_table_8_4(tmp_path):
    result = CliRunner().invoke(main, [str(TABLE), "-o", str(tmp_path / "w.nc"), "--json", "-q"])
    assert result.exit_code == 0, result.output
    headline = json.loads(result.stdout)
    rates = [m["wear_rate_m3_per_s"] for m in headline["mixtures"]]
    np.testing.assert_allclose(rates[:6], PUBLISHED[:6], rtol=5e-3)
    assert rates[6] == pytest.approx(PUBLISHED[6], abs=0.005e-7)  # two digits printed
    assert len(headline["warnings"]) == 7
    assert "2.057e+04 N" in headline["warnings"][0] and "130 N" in headline["warnings"][0]
    assert check_artifact(tmp_path / "w.nc") == []
    wear = read_artifact(tmp_path / "w.nc", "wear")
    np.testing.assert_allclose(wear["class_wear_rate"].sum("class"), wear["wear_rate"])
    assert float(wear["sliding_speed"]) == pytest.approx(2.393, abs=5e-4)


@pytest.mark.parametrize("split", ["equal", "area"])
def test_balanced_contacts_carry_the_applied_load(tmp_path, split):
    overrides = ["load.mode=balanced", f"load.split={split}"]
    headline = wear_estimate.run(TABLE, tmp_path / "w.nc", overrides=overrides)
    wear = read_artifact(tmp_path / "w.nc", "wear")
    np.testing.assert_allclose(wear["carried_load"], 130.0)
    force = wear["contact_force"].values[3]  # half and half
    assert force[1] / force[0] == pytest.approx(4.0 if split == "area" else 1.0)
    assert not any("times the applied load" in w for w in headline["warnings"])
    assert any("below the known grooves" in w for w in headline["warnings"])
    first = headline["mixtures"][0]["wear_rate_m3_per_s"]
    force_each = 130.0 / (9e7 * 114.3e-6)
    assert first == pytest.approx(130 / force_each * 0.37 * 88.4e-12 * (force_each / 2.0) ** 1.5 * 2.39286, rel=1e-4)


def filled(layout, **values) -> dict:
    """Every variable of a layout, one long in each dim and filled with ones, but for the values given."""
    sizes = {"class": len(values.get("class_name", ["x"])), "side": 2, "axis": 3}
    arrays = {}
    for name, v in layout.variables.items():
        shape = tuple(sizes.get(d, 1) for d in v.dims)
        arrays[name] = np.full(shape, "x") if v.dtype == "U" else np.full(shape, 0 if v.index_of else 1)
    return arrays | values


def fake_bed(path: Path, names=("D100",), diameter=(1e-4,), count=(98,), share=(1.0,), force=(1e-6,)) -> Path:
    """A small artifact as dem-run writes it; only what wear-estimate reads matters."""
    arrays = filled(
        PARTICLES,
        class_name=np.array(names),
        class_diameter=diameter,
        class_share=share,
        floor_contacts_per_area=np.array(count) / 1e-6,
        floor_contact_force=force,
    )
    write_artifact(path, PARTICLES, arrays, Record())
    return path


def fake_scratch(path: Path, radius=50e-6, force=2.0, area=88.4e-12, degree=0.37) -> Path:
    arrays = filled(SCRATCH, grain_radius=radius, normal_force=force, groove_area=area, degree_of_wear=degree)
    write_artifact(path, SCRATCH, arrays, Record())
    return path


ONE = """
kind = "wear"
[load]
mode = "given"
[[grains]]
name = "D100"
diameter = "100 um"
grooves = [{ force = "2 N", area = "88.4 um^2", degree_of_wear = 0.37 }]
[[mixtures]]
name = "one"
shares = { D100 = 1.0 }
"""


@pytest.fixture
def one(tmp_path) -> Path:
    path = tmp_path / "one.toml"
    path.write_text(ONE)
    return path


def test_counts_of_a_bed(one, tmp_path):
    bed = fake_bed(tmp_path / "bed.nc")
    headline = wear_estimate.run(one, tmp_path / "w.nc", bed=bed)
    expected = 9.8e7 * 114.3e-6 * 0.37 * 88.4e-12 * 2.39286
    assert headline["mixtures"][0]["wear_rate_m3_per_s"] == pytest.approx(expected, rel=1e-4)
    assert str(bed) in read_artifact(tmp_path / "w.nc", "wear").attrs["inputs"]


def test_forces_split_as_measured_in_a_bed(tmp_path):
    bed = fake_bed(tmp_path / "bed.nc", ("D100", "D200"), (1e-4, 2e-4), (60, 10), (0.5, 0.5), (1e-6, 3e-6))
    scene = tmp_path / "half.toml"
    scene.write_text(
        TABLE.read_text().split("[[mixtures]]")[0]
        + '[[mixtures]]\nname = "half"\nshares = { D100 = 0.5, D200 = 0.5 }\n'
    )
    wear_estimate.run(scene, tmp_path / "w.nc", bed=bed, overrides=["load.mode=balanced", "load.split=bed"])
    force = read_artifact(tmp_path / "w.nc", "wear")["contact_force"].values[0]
    assert force[1] / force[0] == pytest.approx(3.0)
    assert 114.3 * (60 * force[0] + 10 * force[1]) == pytest.approx(130.0)


def test_grooves_of_scratch_artifacts(tmp_path):
    """Own bed, two grooves, load balanced: the scene of the chain; the force lies between the two grooves."""
    bed = fake_bed(tmp_path / "bed.nc", ("grains",))
    each = 130.0 / (98e6 * 114.3e-6)
    light = fake_scratch(tmp_path / "a.nc", force=0.5 * each, area=1e-13, degree=0.2)
    heavy = fake_scratch(tmp_path / "b.nc", force=2.0 * each, area=4e-13, degree=0.4)
    arguments = [str(SCENES / "own-bed-and-groove.toml"), "-o", str(tmp_path / "w.nc"), "--json", "--bed", str(bed)]
    result = CliRunner().invoke(main, [*arguments, "--scratch", f"grains={light}", "--scratch", f"grains={heavy}"])
    assert result.exit_code == 0, result.output
    headline = json.loads(result.stdout)
    assert headline["warnings"] == []
    expected = 98e6 * 114.3e-6 * 0.3 * 2e-13 * 2.39286  # middle of both in the logarithm
    assert headline["mixtures"][0]["wear_rate_m3_per_s"] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("scratch", "words"),
    [
        ({"radius": 100e-6}, "half the diameter"),
        ({"area": 0.0}, "positive values"),
        ({"force": -1.0}, "positive values"),
    ],
)
def test_scratches_that_do_not_fit(one, tmp_path, scratch, words):
    file = fake_scratch(tmp_path / "s.nc", **scratch)
    with pytest.raises(BadInput, match=words):
        wear_estimate.run(one, tmp_path / "w.nc", scratch={"D100": [file]})


@pytest.mark.parametrize(
    ("bed", "words"),
    [
        ({"names": ("sand",)}, "a class 'D100'"),
        ({"diameter": (2e-4,)}, "class_diameter of D100"),
        ({"count": (0,)}, "touches its floor"),
        ({"share": (0.5,)}, "the shares of the bed"),
    ],
)
def test_beds_that_do_not_fit(one, tmp_path, bed, words):
    with pytest.raises(BadInput, match=words):
        wear_estimate.run(one, tmp_path / "w.nc", bed=fake_bed(tmp_path / "bed.nc", **bed))
    assert not (tmp_path / "w.nc").exists()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (['machine.applied_load="-130 N"'], "applied_load"),
        (['machine.rotation="200 m/s"'], "rad/s"),
        (["machine.colour=1"], "colour"),
        (["counts.source=guess"], "counts.source"),
        (["counts.source=bed"], "counts.bed"),
        (['counts.bed="no-such.nc"'], "existing file"),
        (["load.split=bed"], "`bed`"),
        (['mixtures=[{name="x",shares={D50=1.0}}]'], "D50"),
        (['mixtures=[{name="x",shares={D100=0.7}}]'], "sum 1"),
        (['grains=[{name="D100",diameter="100 um"}]'], "exactly one"),
    ],
)
def test_faults_are_named_and_nothing_is_written(one, tmp_path, settings, words):
    with pytest.raises(BadInput, match=words):
        wear_estimate.run(one, tmp_path / "w.nc", overrides=settings)
    assert not (tmp_path / "w.nc").exists()


def test_every_fault_at_once(one, tmp_path):
    (tmp_path / "foreign.nc").write_bytes(b"not a NetCDF file")
    with pytest.raises(BadInput) as caught:
        wear_estimate.run(
            one,
            tmp_path / "w.nc",
            bed=tmp_path / "foreign.nc",
            scratch={"D5": [tmp_path / "x.nc"], "D100": [tmp_path / "y.nc"]},
        )
    text = str(caught.value)
    assert "D5" in text and "foreign.nc" in text and "y.nc" in text


def test_option_scratch_wants_a_class(one, tmp_path):
    result = CliRunner().invoke(main, [str(one), "-o", str(tmp_path / "w.nc"), "--scratch", "groove.nc"])
    assert result.exit_code == 2
    assert "CLASS=FILE" in result.output


def test_picture(tmp_path):
    from graben.stages.tools import picture

    wear_estimate.run(TABLE, tmp_path / "w.nc")
    picture.run(tmp_path / "w.nc", tmp_path / "w.png")
    assert (tmp_path / "w.png").stat().st_size > 20_000
