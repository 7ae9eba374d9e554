"""Ctrl-C, SIGTERM and SIGHUP end a command with exit code 130 at every moment, and nothing half-made stays."""

import os
import signal
import subprocess
import sys
import threading
import time
import tomllib
from importlib import import_module
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from graben import interrupts
from graben.cli import start
from graben.cli.options import Session, Tool, session_options
from graben.stages.shared.workers import compute
from tests.conftest import PIPELINES, ROOT, command

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


def kill_self(number=signal.SIGTERM):
    os.kill(os.getpid(), number)


def tool(body):
    @click.command("sample", cls=Tool)
    @session_options
    def main(session: Session) -> None:
        body()

    return main


def child(script, *arguments, **environment):
    """A fresh interpreter in which Ctrl-C is what it is at a terminal, wherever the tests were started."""
    lines = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n" + script
    about = {**os.environ, **environment}
    call = [sys.executable, "-c", lines, *map(str, arguments)]
    return subprocess.Popen(call, env=about, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_every_installed_program_has_signals_in_hand_before_it_imports_anything():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    for name, address in scripts.items():
        module, function = address.split(":")
        assert module == "graben.cli.start"
        assert callable(getattr(start, function)), name
    script = "import sys; before = set(sys.modules); import graben.cli.start; print(*(set(sys.modules) - before))"
    new = set(child(script).communicate()[0].split())
    assert not {name.partition(".")[0] for name in new} & {"click", "logging", "numpy", "json"}


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("library", ["click", "numpy"])
def test_a_signal_during_imports_ends_the_program(library, number, tmp_path):
    # The library that is being imported sends the signal, then never ends.
    fake = f"import os, time; os.kill(os.getpid(), {int(number)})\nwhile True: time.sleep(0.01)\n"
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / f"{library}.py").write_text(fake)
    script = "import sys; sys.path.insert(0, sys.argv.pop(1)); from graben.cli.start import dem_run; dem_run()"
    run = child(script, tmp_path / "lib", PIPELINES / "wear/bed.toml", "-o", tmp_path / "out.nc")
    said = run.communicate(timeout=120)[1]
    assert run.returncode == 130, said
    assert "interrupted" in said and "Traceback" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["lib"]


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("place", ["load_scene", "_rate", "write_whole"])
def test_a_signal_at_any_step_of_a_stage_leaves_nothing(place, number, tmp_path, monkeypatch):
    stage = import_module("graben.stages.wear_estimate.stage")
    real = getattr(stage, place)

    def signalled(*arguments, **named):
        kill_self(number)
        return real(*arguments, **named)

    monkeypatch.setattr(stage, place, signalled)
    before = signal.getsignal(number)
    result = command("wear-estimate", PIPELINES / "wear/astm-g65-mixtures.toml", "-o", tmp_path / "out.nc")
    assert result.exit_code == 130, result.output
    assert "interrupted" in result.stderr
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(number) == before


def test_a_signal_between_the_pictures_of_a_report_ends_it(small_blocks, tmp_path, monkeypatch):
    for name in ("a.nc", "b.nc"):
        (tmp_path / name).write_bytes(small_blocks.read_bytes())
    stage = import_module("graben.stages.tools.report")
    real = stage._section

    def signalled(artifact, png):
        if artifact.name == "a.nc":
            kill_self(signal.SIGINT)
        return real(artifact, png)

    monkeypatch.setattr(stage, "_section", signalled)
    result = command("report", tmp_path, "-o", tmp_path / "page.html")
    assert result.exit_code == 130, result.output
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.nc", "b.nc"]


def test_a_signal_while_a_library_writes_waits_for_it(tmp_path, monkeypatch):
    artifact = import_module("graben.schemas.artifact")
    real, written = artifact.write_netcdf, []

    def signalled(path, *contents):
        kill_self()
        real(path, *contents)
        written.append(path)

    monkeypatch.setattr(artifact, "write_netcdf", signalled)
    result = command("wear-estimate", PIPELINES / "wear/astm-g65-mixtures.toml", "-o", tmp_path / "out.nc")
    assert result.exit_code == 130, result.output
    assert len(written) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_signal_while_the_output_is_put_in_place_lets_the_run_end_as_done(tmp_path, monkeypatch):
    from graben.schemas import files

    real = files._put_in_place

    def signalled(parts):
        kill_self()
        real(parts)
        kill_self(signal.SIGINT)

    monkeypatch.setattr(files, "_put_in_place", signalled)
    result = command("wear-estimate", PIPELINES / "wear/astm-g65-mixtures.toml", "-o", tmp_path / "out.nc", "--json")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("{")
    assert [path.name for path in tmp_path.iterdir()] == ["out.nc"]


def test_an_interrupt_that_became_another_error_is_an_interrupt():
    def body():
        try:
            kill_self()
            time.sleep(60)
        finally:
            raise OSError("a file that was being written cannot be closed")

    for options in ([], ["--debug"]):
        result = CliRunner().invoke(tool(body), options)
        assert result.exit_code == 130
        assert "a fault of the program" not in result.stderr


def test_an_interrupt_that_a_finalizer_swallows_comes_again():
    class Swallows:
        def __del__(self):
            kill_self()
            time.sleep(60)

    def body():
        Swallows()
        time.sleep(60)

    begun = time.monotonic()
    assert CliRunner().invoke(tool(body), []).exit_code == 130
    assert time.monotonic() - begun < 60


def test_an_interrupt_that_a_callback_swallows_and_that_becomes_another_error(monkeypatch):
    class Swallows:
        def __del__(self):
            kill_self()
            time.sleep(60)

    def body():
        Swallows()
        raise RuntimeError("no compiled object")

    failed = []
    monkeypatch.setattr(threading, "excepthook", failed.append)
    assert CliRunner().invoke(tool(body), []).exit_code == 130
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join()
    assert failed == []


def test_a_second_signal_at_once_does_not_break_what_the_first_one_began():
    cleaned = []

    def body():
        try:
            kill_self(signal.SIGINT)
            time.sleep(60)
        finally:
            kill_self(signal.SIGINT)
            kill_self(signal.SIGTERM)
            cleaned.append(True)

    assert CliRunner().invoke(tool(body), []).exit_code == 130
    assert cleaned == [True]


def test_a_second_signal_later_ends_a_clean_up_that_hangs():
    script = (
        "import sys, time, click\nfrom graben.cli.options import Tool\n"
        "@click.command(cls=Tool)\ndef main():\n"
        "    try:\n        print('at work', flush=True); time.sleep(600)\n"
        "    finally:\n        print('cleaning', flush=True); time.sleep(600)\n"
        "main()"
    )
    run = child(script)
    assert run.stdout.readline() == "at work\n"
    run.send_signal(signal.SIGINT)
    assert run.stdout.readline() == "cleaning\n"
    time.sleep(1.5)  # longer than what counts as the same signal, repeated
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=120)
    assert run.returncode == 130


def test_a_signal_after_the_outputs_are_in_place_is_passed_over():
    def body():
        interrupts.complete()
        kill_self()
        click.echo("done")

    result = CliRunner().invoke(tool(body), [])
    assert (result.exit_code, result.stdout) == (0, "done\n")


def test_a_signal_while_the_interpreter_ends_changes_nothing(tmp_path):
    script = (
        "import os, sys\n"
        "class Last:\n    def __del__(self, kill=os.kill, process=os.getpid()):\n        kill(process, 15)\n"
        "last = Last()\nfrom graben.cli.start import wear_estimate\nwear_estimate()"
    )
    run = child(script, PIPELINES / "wear/astm-g65-mixtures.toml", "-q", "-o", tmp_path / "out.nc")
    _, said = run.communicate(timeout=120)
    assert run.returncode == 0, said


def test_what_was_ignored_when_the_process_began_stays_ignored():
    former = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert CliRunner().invoke(tool(lambda: kill_self(signal.SIGHUP)), []).exit_code == 0
    finally:
        signal.signal(signal.SIGHUP, former)


def announce_and_sleep(place):
    Path(place, str(os.getpid())).touch()
    time.sleep(600)


def announced(place, count):
    """Process ids that `announce_and_sleep` left, once there are `count`."""
    while len(found := [int(path.name) for path in Path(place).iterdir()]) < count:
        time.sleep(0.01)
    return found


def await_end(process):
    """Return when the process is gone; the test's own time limit ends a wait in vain."""
    for _ in range(6000):
        try:
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
            if state == "Z":
                return
            os.kill(process, 0)
        except (FileNotFoundError, ProcessLookupError):
            return
        time.sleep(0.01)
    raise AssertionError(f"process {process} still runs")


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="reads states of processes from /proc")
def test_a_signal_ends_the_wait_for_worker_processes_and_the_workers(tmp_path):
    def body():
        threading.Thread(target=lambda: announced(tmp_path, 2) and kill_self()).start()
        compute(announce_and_sleep, [tmp_path] * 4, processes=2)

    assert CliRunner().invoke(tool(body), []).exit_code == 130
    for process in announced(tmp_path, 2):
        await_end(process)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="reads states of processes from /proc")
def test_workers_end_when_the_process_that_began_them_is_killed(tmp_path):
    script = (
        "import sys; from tests.cli.test_interrupt import announce_and_sleep\n"
        "from graben.stages.shared.workers import compute\n"
        "compute(announce_and_sleep, [sys.argv[1]] * 2, processes=2)"
    )
    run = child(script, tmp_path, PYTHONPATH=str(ROOT))
    workers = announced(tmp_path, 2)
    run.kill()
    run.communicate()
    for process in workers:
        await_end(process)
