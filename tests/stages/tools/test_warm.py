"""graben warm: what it compiles, and that runs need nothing else."""

import subprocess
import sys

import pytest
from click.testing import CliRunner

from graben.cli.main import main
from graben.mechanics import kernel_cache
from graben.stages.tools import warm


def test_no_task_waits_for_one_that_is_not_there_or_for_itself():
    for name in warm.TASKS:
        seen = set()
        while name:
            assert name in warm.TASKS and name not in seen
            seen.add(name)
            name = warm.TASKS[name].after


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """An empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kernel_cache.folder.cache_clear()
    yield tmp_path / "graben" / "kernels"
    kernel_cache.folder.cache_clear()


def test_the_cache_is_told_and_forgotten(kept):
    kept.mkdir(parents=True, mode=0o700)
    kept.parent.chmod(0o700)
    for name in ("a.nbc", "b.nbc"):
        (kept / name).write_bytes(b"kernel")
    (kept / "notes.txt").touch()
    told = CliRunner().invoke(main, ["warm", "--list"])
    assert told.exit_code == 0 and str(kept) in told.output and "kernels    2" in told.output
    gone = CliRunner().invoke(main, ["warm", "--forget", "--json"])
    assert '"removed": 2' in gone.output
    assert [file.name for file in kept.iterdir()] == ["notes.txt"]
    assert CliRunner().invoke(main, ["warm", "--forget", "--list"]).exit_code == 2


def test_where_nothing_can_be_kept_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "folder", lambda: None)
    result = CliRunner().invoke(main, ["warm"])
    assert result.exit_code == 2 and "XDG_CACHE_HOME" in result.output


RUNS = """
import sys, tempfile
from pathlib import Path
from graben.mechanics import kernel_cache
from graben.stages.dem_run.stage import run as dem_run
from graben.stages.fem_run.stage import run as fem_run
from graben.stages.scratch.stage import run as scratch

small = {"domain.width": "4 m", "domain.height": "4 m", "fidelity": "draft", "numerics.steps": 2000}
joints = {"joints.residual_friction": "20 deg", "joints.tension": "0.1 MPa", "numerics.threads": 2}
tip = {"fidelity": "draft", "tip.path": "2 um", "specimen.length": "100 um"}
with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    dem_run({"kind": "blocks"}, folder / "a.nc", overrides=small)
    dem_run({"kind": "blocks"}, folder / "b.nc", overrides=small | joints)
    fem_run({"kind": "fem"}, folder / "c.nc", overrides={"fidelity": "draft", "stepping.end": "1 s"})
    scratch({"kind": "scratch"}, folder / "d.nc", overrides=tip)
print(*[name for name, compiled in kernel_cache.used.items() if compiled])
"""


def test_after_it_no_run_compiles():
    found = warm.run(2)
    assert found["compiled"] == sum(row["compiled"] for row in found["tasks"])
    assert all(row["compiled"] + row["found"] > 0 for row in found["tasks"])
    assert warm.run(2)["compiled"] == 0
    ended = subprocess.run([sys.executable, "-c", RUNS], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.split() == []
