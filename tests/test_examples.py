"""Every script of examples/ runs, and draws its picture in the working folder."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))


def test_there_is_one_for_each_theme():
    assert {p.stem for p in SCRIPTS} == {"average_and_fit", "bed", "blocks", "own_law", "wear"}


@pytest.mark.usefixtures("laws_as_before")
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_an_example_draws_its_picture(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    from matplotlib import pyplot

    pyplot.close("all")
    assert [p.name for p in tmp_path.iterdir()] == [f"{script.stem}.png"]
    pixels = pyplot.imread(tmp_path / f"{script.stem}.png")
    assert min(pixels.shape[:2]) > 300 and pixels.std() > 0.05
