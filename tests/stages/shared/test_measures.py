"""A result past an error measure says so in plain words: headline, terminal, JSON, artifact, report."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from graben.mechanics.wear.groove import measure
from graben.schemas.scene import load_scene
from graben.stages.fem_run import stage as fem_run
from graben.stages.scratch.output import _headline
from graben.stages.shared.measures import Measure, number, warnings_of
from graben.stages.tools.report import _section
from tests.conftest import command

FAST = """
kind = "blocks"
domain = { width = "4 m", height = "4 m" }
loading = { duration = "6 s", states = 4, confining_pressure = "0.1 MPa" }
numerics.steps = 500
output.vtk = false
"""


def test_a_measure_is_doubtful_past_its_bounds_only():
    for value, told in ((1.0, []), (1.2, ["1.2 times"]), (0.5, ["0.5 times"]), (np.inf, ["inf times"]), (None, [])):
        assert warnings_of([Measure("ratio", value, 1.1, "{value} times", least=0.9)]) == told
    assert warnings_of([Measure("share", np.nan, 0.1, "{percent}")]) == []
    assert warnings_of([Measure("share", 0.25, 0.1, "{percent}")]) == ["25 %"]
    assert number(np.nan) is None and number(np.float64(2.0)) == 2.0


@pytest.fixture(scope="module")
def fast(tmp_path_factory):
    """A test of blocks that is far too fast for its steps."""
    scene = tmp_path_factory.mktemp("fast") / "fast.toml"
    scene.write_text(FAST)
    return scene, command("dem-run", scene, "-o", scene.with_name("fast.nc"))


def test_a_test_that_is_too_fast_is_told_to_a_person(fast):
    _, result = fast
    assert result.exit_code == 0, result.output
    assert "warning: the lateral stress inside is" in result.stderr
    assert "warning: kinetic energy is" in result.stderr
    assert "warnings" not in result.stdout


def test_the_same_words_are_in_json_artifact_and_report(fast):
    scene, _ = fast
    result = command("dem-run", scene, "-o", scene.with_name("json.nc"), "--json")
    warnings = json.loads(result.stdout)["warnings"]
    assert any("lateral" in text for text in warnings)
    assert "warning:" not in result.stderr
    with xarray.open_dataset(scene.with_name("json.nc"), decode_times=False) as data:
        assert data.attrs["warnings"].splitlines() == warnings
    page = _section(scene.with_name("json.nc"), b"")
    assert all(text.split(";")[0] in page for text in warnings)


# A column 2 m wide and 4 m high bears twice its cohesion.
COLUMN = """
kind = "fem"
gravity.density = "0 kg/m^3"
supports = [{ start = ["0 m", "0 m"], end = ["2 m", "0 m"], fix = "both" }]
loads = [{ start = ["0 m", "4 m"], end = ["2 m", "4 m"], rate = "RATE" }]
[mesh]
size = "1 m"
corners = [["0 m", "0 m"], ["2 m", "0 m"], ["2 m", "4 m"], ["0 m", "4 m"]]
patches = [[0, 1, 2, 3]]
refine = []
[material]
law = "mohr-coulomb"
parameters = { young_modulus = "100 MPa", poisson_ratio = 0.3, cohesion = "50 kPa", friction_angle = "0 deg", \
dilation_angle = "0 deg", tensile_strength = "0 Pa" }
"""


@pytest.mark.parametrize("rate", ["40 kPa/s", "10 MPa/s", "1e12 Pa/s"])
def test_the_failure_load_does_not_depend_on_how_far_the_first_step_goes_beyond_it(rate, tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN.replace("RATE", rate))
    head = fem_run.run(path, tmp_path / "o.nc")
    assert head["failed"] and head["failure_load_pa"] == pytest.approx(100e3, rel=0.025)
    assert head["warnings"] == []


def test_a_failure_that_stabilisation_hides_is_no_failure_load(tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN.replace("RATE", "1e12 Pa/s"))
    head = fem_run.run(path, tmp_path / "o.nc", overrides=['stepping.relaxation="10 ms"', 'stepping.end="3 s"'])
    assert head["failed"] and head["failure_load_pa"] is None
    assert any("the failure load is not known" in text for text in head["warnings"])


def test_a_path_without_groove_and_with_few_records_gives_null_where_there_is_no_number(tmp_path):
    """Two records of sliding, none of them in the steady part, over sections of which the last met no groove."""
    path = tmp_path / "s.toml"
    path.write_text('kind = "scratch"\n')
    scene = load_scene(path, "scratch")
    a, start, length = scene.contact_half_width, scene.tip.start, scene.tip.path
    y = np.linspace(0.0, 3.0 * a, 31)
    flat, dent = measure(y, np.zeros(31), True), measure(y, np.minimum(0.0, (y - a) / a * scene.tip.depth), True)
    positions = start + np.array([0.0, 0.5 * length, 1.5 * length])
    run = SimpleNamespace(
        phases=("indent", "slide", "lift"), phase=np.array([0, 1, 1, 2]),
        tip=np.array([start, start + 0.1 * length, start + length, start + length])[:, None] * np.ones(3),
        force=np.array([[0.0, 0.0, -1.0], [0.2, 0.0, -1.0], [0.3, 0.0, -2.0], [0.0, 0.0, 0.0]]),
    )  # fmt: skip
    volumes = SimpleNamespace(bow=0.0, groove=0.0, closure=0.0)
    head = _headline(scene, run, positions, [[dent, dent, flat]] * 2, volumes, a)
    assert head["normal_force_n"] == 2.0
    assert head["degree_of_wear_by_s_over_a"] == {"1": 1.0, "2": 1.0, "3": None, "4": None}
    none = _headline(scene, run, positions, [[flat] * 3] * 2, volumes, a)
    assert none["degree_of_wear"] is None and none["degree_of_penetration"] is None
    json.dumps([head, none], allow_nan=False)
