"""A run that fails keeps its last good state and names the file, or says why there is none."""

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.blocks.loading.biaxial import Biaxial
from graben.schemas.artifact import check_artifact, read_artifact
from graben.stages.blocks import stage as blocks
from graben.stages.particles import stage as particles
from graben.stages.shared import last_good
from graben.stages.wear_estimate import stage as wear_estimate
from tests.conftest import PIPELINES, command, settings

SQUARE = (
    'kind = "blocks"\n[domain]\nwidth = "2 m"\nheight = "2 m"\n[numerics]\nsteps = 600\n'
    '[loading]\nstates = 5\nspeed = "0.1 mm/s"\n[output]\nvtk = false\n'
)


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.toml"
    path.write_text(SQUARE)
    return path


def readable(path):
    """The artifact, once check and show take it."""
    assert check_artifact(path) == []
    assert command("check", path).exit_code == 0
    shown = command("show", path, "-o", path.with_suffix(".png"))
    assert shown.exit_code == 0, shown.output
    kind = "blocks" if "zone_stress" in (data := read_artifact(path, ("blocks", "wear"), partial=True)) else "wear"
    return kind, data


def test_numbers_that_are_not_finite_at_the_end_keep_those_that_are(tmp_path, monkeypatch):
    real = wear_estimate.wear_rates

    def broken(*arguments):
        rate = real(*arguments)
        rate[0] = np.nan
        return rate

    monkeypatch.setattr(wear_estimate, "wear_rates", broken)
    output = tmp_path / "out.nc"
    result = command("wear-estimate", PIPELINES / "wear/astm-g65-mixtures.toml", "-o", output)
    assert result.exit_code == 3
    assert f"the last good state is in {tmp_path / 'out.partial.nc'}" in result.stderr
    assert not output.exists()
    _, data = readable(tmp_path / "out.partial.nc")
    assert "not finite" in data.attrs["partial"]
    assert np.isnan(data["class_wear_rate"].values[:, 0]).all()
    assert np.isfinite(data["contact_force"].values).all()


def test_blocks_that_fail_on_the_way_keep_the_states_that_passed(square, monkeypatch):
    def strict(history, limit, step):
        if len(history.time) == 4:
            raise NumericsFailed("energy error 9 %", step=step)

    monkeypatch.setattr(blocks, "_check_ledger", strict)
    result = command("dem-run", square, "-o", square.with_name("out.nc"))
    assert result.exit_code == 3
    kept = square.with_name("out.partial.nc")
    assert f"the last good state is in {kept}" in result.stderr
    _, data = readable(kept)
    assert data.sizes["time"] == 3
    assert "energy error 9 %" in data.attrs["partial"]


def test_blocks_whose_numbers_are_not_finite_at_the_end(square, monkeypatch):
    real = blocks._arrays

    def broken(*arguments):
        arrays = real(*arguments)
        arrays["velocity"][-1, 0] = np.inf
        return arrays

    monkeypatch.setattr(blocks, "_arrays", broken)
    result = command("dem-run", square, "-o", square.with_name("out.nc"))
    assert result.exit_code == 3
    assert "velocity holds 2 values that are not finite" in result.stderr
    _, data = readable(square.with_name("out.partial.nc"))
    assert np.isnan(data.velocity.values).sum() == 2


@pytest.mark.parametrize(
    ("stage", "place", "scene", "words"),
    [
        (Biaxial, "begin", "square", "no state had been saved yet"),
        (particles, "make_bed", "bed", "no grain had moved yet"),
    ],
)
def test_a_failure_before_any_state_says_why_nothing_is_kept(stage, place, scene, words, square, monkeypatch):
    def fails(*arguments):
        raise NumericsFailed("no room")

    monkeypatch.setattr(stage, place, fails)
    path = square if scene == "square" else PIPELINES / "wear/bed.toml"
    result = command("dem-run", path, *settings(["fidelity=draft"]), "-o", square.with_name("out.nc"))
    assert result.exit_code == 3
    assert f"nothing is kept: {words}" in result.stderr
    assert [p.name for p in square.parent.iterdir()] == ["square.toml"]


def test_every_stage_keeps_its_last_good_state():
    from graben.stages.calibrate import stage as calibrate
    from graben.stages.fem_run import stage as fem_run
    from graben.stages.homogenize import stage as homogenize
    from graben.stages.rev_study import stage as rev_study
    from graben.stages.scratch import stage as scratch

    for stage in (blocks, particles, wear_estimate, calibrate, fem_run, homogenize, rev_study, scratch):
        assert hasattr(stage.run, "__wrapped__"), stage.__name__


def test_a_state_that_cannot_be_kept_is_said():
    def keep(why):
        raise NumericsFailed("worse")

    @last_good.keeps_last_good("nothing yet")
    def run(when):
        if when:
            last_good.keep_by(keep)
        raise NumericsFailed("bad")

    for when, words in ((True, "could not be kept (worse)"), (False, "nothing is kept: nothing yet")):
        with pytest.raises(NumericsFailed) as error:
            run(when)
        assert words in error.value.__notes__[0]
