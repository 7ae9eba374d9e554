"""Standard streams that are full, closed, or read by nobody."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import PIPELINES

HELP = ["--help"]
GOOD = ["check", str(PIPELINES / "wear/astm-g65-mixtures.toml")]
BAD = ["check", "none.toml"]


def graben(arguments, redirection, folder):
    command = f'"$0" -c "from graben.cli.start import graben; graben()" "$@" {redirection}'
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}", sys.executable, *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("arguments", [HELP, GOOD], ids=["help", "check"])
def test_a_full_standard_output_is_the_machines_fault(arguments, tmp_path):
    done = graben(arguments, "> /dev/full", tmp_path)
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1 and "standard output: cannot be written (No space left" in done.stderr


@pytest.mark.parametrize("redirection", [">&-", "2>&-", "<&- >&- 2>&-", "2> /dev/full", "| true"])
def test_closed_streams_change_no_exit_code(redirection, tmp_path):
    for arguments, code in ((GOOD, 0), (BAD, 2)):
        done = graben(arguments, redirection, tmp_path)
        assert done.returncode == code
        assert "Traceback" not in done.stderr and "fault of the program" not in done.stderr
    assert list(tmp_path.iterdir()) == []
