"""An interrupted stage leaves no output: exit code 130, no file, no half-made folder."""

import signal
import subprocess
import sys
import time

import pytest

from tests.conftest import PIPELINES


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_nothing(by, tmp_path):
    call = [sys.executable, "-c", "from graben.cli.dem_run import main; main()"]
    scene = [PIPELINES / "wear/bed.toml", "--set", "fidelity=reference", "-o", tmp_path / "out.nc"]
    run = subprocess.Popen([*call, *map(str, scene)], stderr=subprocess.PIPE, text=True)
    # The first line of progress says that the stage is at work, compiled and past its checks.
    assert run.stderr.readline().strip()
    time.sleep(0.5)
    run.send_signal(by)
    _, said = run.communicate(timeout=120)
    assert run.returncode == 130, said
    assert "interrupted" in said
    assert list(tmp_path.iterdir()) == []
