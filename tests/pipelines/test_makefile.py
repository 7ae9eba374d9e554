"""The chains as make sees them: a change reruns what depends on it, and nothing else."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = ("dem-run", "homogenize", "rev-study", "calibrate", "fem-run", "scratch", "wear-estimate")


def make(results, *arguments):
    ours = ("MAKEFLAGS", "MAKELEVEL", "MAKEOVERRIDES", "MFLAGS", "FIDELITY", "RESULTS", "JOBS", "PYTHON", "SEED")
    environment = {k: v for k, v in os.environ.items() if k not in ours}
    call = ["make", "--no-print-directory", f"RESULTS={results}", *arguments, "upscaling", "wear"]
    done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def finished(tmp_path):
    """A results folder in which make believes that both chains are up to date."""
    (ROOT / ".venv").mkdir(exist_ok=True)
    for chain in ("upscaling", "wear"):
        (tmp_path / chain).mkdir()  # --touch makes no folders, and jobs run in any order
    make(tmp_path, "--touch", "-o", ".venv/.ready")
    return tmp_path


def reruns(results, *arguments):
    """The artifacts that make would make again, without their folder."""
    planned = make(results, "--dry-run", "-o", ".venv/.ready", *arguments)
    lines = [line.split() for line in planned.splitlines()]
    return {
        Path(words[words.index("-o") + 1]).name
        for words in lines
        if words and Path(words[0]).name in COMMANDS and "-o" in words
    }


def test_finished_chains_rerun_nothing(finished):
    assert reruns(finished) == set()


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ("pipelines/upscaling/slope.toml", {"slope.nc"}),
        ("pipelines/upscaling/rev-study.toml", {"rev-study.nc"}),
        ("pipelines/upscaling/calibrate.toml", {"calibration.nc", "slope.nc"}),
        ("pipelines/upscaling/calibrate-udec.toml", {"calibration-udec.nc"}),
        ("pipelines/wear/scratch.toml", {"scratch.nc", "own-bed-and-groove.nc"}),
        ("pipelines/wear/bed.toml", {"bed.nc", "own-bed-and-groove.nc"}),
        ("pipelines/wear/astm-g65-mixtures.toml", {"astm-g65-mixtures.nc"}),
    ],
)
def test_a_changed_scene_reruns_what_depends_on_it(finished, changed, expected):
    assert reruns(finished, "-W", changed) == expected


def test_a_changed_rock_mass_reruns_the_whole_of_its_chain(finished):
    again = reruns(finished, "-W", "pipelines/upscaling/voronoi-granite.toml")
    assert {f"blocks-{p}MPa.nc" for p in ("0.5", "1", "2", "4")} <= again
    assert {"calibration.nc", "slope.nc", "rev-study.nc"} <= again
    assert not {"calibration-udec.nc", "bed.nc", "scratch.nc"} & again


def test_another_fidelity_reruns_the_runs(finished):
    again = reruns(finished, "FIDELITY=draft")
    assert {"blocks-1MPa.nc", "bed.nc", "scratch.nc"} <= again


def test_help_describes_the_targets():
    text = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for target in ("demo", "test", "verify", "upscaling", "wear", "bench", "lint", "clean"):
        assert f"make {target} " in text
