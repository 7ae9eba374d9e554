"""Standard streams that are full, closed, or read by nobody."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import PIPELINES

HELP = ["--help"]
GOOD = ["check", str(PIPELINES / "wear/astm-g65-mixtures.toml")]
BAD = ["check", "none.toml"]


def graben(arguments, redirection, folder, **variables):
    command = f'"$0" -c "from graben.cli.start import graben; graben()" "$@" {redirection}'
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}", sys.executable, *arguments],
        cwd=folder, env={**os.environ, **variables}, capture_output=True, text=True, check=False,
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


def test_what_the_output_cannot_encode_is_escaped(tmp_path):
    (tmp_path / "sçène ✓.toml").write_bytes(Path(GOOD[1]).read_bytes())
    for encoding in ("ascii", "cp1252"):
        done = graben(["check", "sçène ✓.toml", "--json"], "", tmp_path, PYTHONIOENCODING=encoding)
        assert done.returncode == 0, done.stderr
        assert list(json.loads(done.stdout)) == ["sçène ✓.toml"]
        assert graben(["check", "sçène ✓.toml"], "> said", tmp_path, PYTHONIOENCODING=encoding).returncode == 0
        assert b"\\u2713.toml" in (tmp_path / "said").read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="names are text there")
def test_names_that_are_no_utf_8_are_printed(tmp_path):
    name = os.fsdecode(b"a\xff.toml")
    try:
        (tmp_path / name).write_bytes(Path(GOOD[1]).read_bytes())
    except OSError:
        pytest.skip("the file system takes UTF-8 only")
    for options in ([], ["--json"]):
        done = graben(["check", name, *options], "", tmp_path)
        assert done.returncode == 0, done.stderr
        assert "udcff.toml" in done.stdout
