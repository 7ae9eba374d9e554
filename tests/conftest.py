"""Small real artifacts that several tests read; each is made once per session by the command that makes it."""

import logging
import signal
from contextlib import contextmanager
from pathlib import Path

import hypothesis
import pytest
from click.testing import CliRunner

from graben.cli.main import main

# The same examples on every machine, however slow it is; `make fuzz` is for new ones.
hypothesis.settings.register_profile("same everywhere", deadline=None, derandomize=True)
hypothesis.settings.load_profile("same everywhere")

# Under nohup and in background jobs of a shell signals are ignored, and so would they be by what the tests start.
for _number, _usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, _usual)

ROOT = Path(__file__).parents[1]
PIPELINES = ROOT / "pipelines"

SMALL_BLOCKS = [
    "fidelity=draft", 'domain.width="3 m"', 'domain.height="3 m"', 'loading.duration="4 s"', "loading.states=5",
]  # fmt: skip
SMALL_BED = ["fidelity=draft", 'box.width="0.6 mm"', 'box.depth="0.3 mm"']


@contextmanager
def laws_forgotten():
    """Laws from outside that are made known within are forgotten after it."""
    from graben.declared.laws import PARAMETERS
    from graben.mechanics.materials.laws import LAWS

    former = [(known, dict(known)) for known in (LAWS, PARAMETERS)]
    yield
    for known, before in former:
        known.clear()
        known.update(before)


@pytest.fixture
def laws_as_before():
    """Laws from outside that a test makes known are forgotten after it."""
    with laws_forgotten():
        yield


def command(*arguments):
    """Run `graben ARGUMENTS...` in this process; returns click's result."""
    return CliRunner().invoke(main, [str(a) for a in arguments])


def settings(overrides):
    """--set options for a list of KEY=VALUE."""
    return [part for override in overrides for part in ("--set", override)]


def made(*arguments):
    result = command(*arguments)
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture(autouse=True)
def level_of_the_log():
    """Commands set it with -q and -v, those of wider fixtures too: each test begins as a program does."""
    logging.getLogger().setLevel(logging.WARNING)


@pytest.fixture(scope="session")
def small_blocks(tmp_path_factory):
    """Artifact of 38 blocks compressed by 0.2 %."""
    path = tmp_path_factory.mktemp("blocks") / "small.nc"
    made("dem-run", PIPELINES / "upscaling/voronoi-granite.toml", *settings(SMALL_BLOCKS), "-o", path)
    return path


@pytest.fixture(scope="session")
def small_curves(small_blocks):
    """Averages of `small_blocks` over a circle of 1 m."""
    path = small_blocks.with_name("curves.nc")
    made("homogenize", small_blocks, "--radius", "1 m", "-o", path)
    return path


@pytest.fixture(scope="session")
def small_bed(tmp_path_factory):
    """Artifact of a bed of some hundred grains."""
    path = tmp_path_factory.mktemp("bed") / "bed.nc"
    made("dem-run", PIPELINES / "wear/bed.toml", *settings(SMALL_BED), "-o", path)
    return path
