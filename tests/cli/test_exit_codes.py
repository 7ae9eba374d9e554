"""0 done, 2 bad input, 3 numerics, 130 interrupted; a traceback only with --debug."""

import errno
import json
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool

import click
import pytest
from click.testing import CliRunner

from graben.cli.options import Session, Tool, session_options, stage_options
from graben.errors import BadInput, Fault, MachineFailed, NotFinite, NumericsFailed


def tool(body):
    @click.command("sample", cls=Tool)
    @session_options
    def main(session: Session) -> None:
        session.report(body() or {})

    return main


def raiser(error):
    def body():
        raise error

    return body


TWO_FAULTS = BadInput([Fault("a.toml", "seed", "-1", "0 or more"), Fault("a.toml", "E", "'x'", "a pressure")])


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (
            TWO_FAULTS,
            2,
            ["sample: a.toml: seed = -1: expected 0 or more", "E = 'x': expected a pressure"],
        ),
        (
            NumericsFailed("energy error 9 %", where="block 12", step=40, advice="halve the time step"),
            3,
            ["energy error 9 % at block 12 in step 40; halve the time step"],
        ),
        (NotFinite("stress holds nan"), 3, ["stress holds nan"]),
        (MachineFailed("out/a.nc", "No space left on device"), 3, ["out/a.nc", "No space left"]),
        (OSError(errno.ENOSPC, "No space left on device", "/tmp/x"), 3, ["/tmp/x", "No space left"]),
        (MemoryError("12 GB"), 3, ["not enough memory: 12 GB"]),
        (ImportError("libx.so: failed to map segment from shared object"), 3, ["not enough memory", "libx.so"]),
        (RuntimeError("can't start new thread"), 3, ["not enough memory"]),
        (ImportError("no module x"), 1, ["a fault of the program"]),
        (BrokenProcessPool("a process was terminated abruptly"), 3, ["a worker was ended", "memory"]),
        (KeyboardInterrupt(), 130, ["interrupted"]),
        (ZeroDivisionError("1/0"), 1, ["a fault of the program", "--debug"]),
    ],
)
def test_each_failure_has_its_exit_code_and_its_words(error, code, words):
    result = CliRunner().invoke(tool(raiser(error)), [])
    assert result.exit_code == code
    assert "Traceback" not in result.output
    for word in words:
        assert word in result.stderr


def test_debug_shows_the_error_itself():
    result = CliRunner().invoke(tool(raiser(ZeroDivisionError("1/0"))), ["--debug"])
    assert isinstance(result.exception, ZeroDivisionError)


def test_json_is_one_object_on_stdout():
    import numpy as np

    body = lambda: {"peak_pa": np.float64(2.5), "rows": np.arange(2), "mixtures": [{"name": "a"}]}  # noqa: E731
    result = CliRunner().invoke(tool(body), ["--json"])
    assert json.loads(result.stdout) == {"peak_pa": 2.5, "rows": [0, 1], "mixtures": [{"name": "a"}]}


def test_where_there_is_no_number_stands_null_or_none():
    import numpy as np

    body = lambda: {  # noqa: E731
        "peak_pa": float("nan"), "rows": np.array([[1.0, np.inf]]), "a": {"b": [np.float64("nan"), -np.inf, 2]},
        "table": [{"name": "x", "share": float("nan")}],
    }  # fmt: skip
    result = CliRunner().invoke(tool(body), ["--json"])
    assert result.exit_code == 0
    assert json.loads(result.stdout, parse_constant=lambda name: pytest.fail(name)) == {
        "peak_pa": None, "rows": [[1.0, None]], "a": {"b": [None, None, 2]}, "table": [{"name": "x", "share": None}],
    }  # fmt: skip
    shown = CliRunner().invoke(tool(body), []).stdout
    assert "nan" not in shown and "inf" not in shown
    assert "peak_pa  none" in shown and "[none, none, 2]" in shown and "share none" in shown


def test_people_get_aligned_lines_and_quiet_gets_none():
    body = lambda: {"peak_pa": 2.5e6, "table": {"E": 1.0}, "mixtures": [{"name": "a", "rate": 1.0}]}  # noqa: E731
    assert "peak_pa   2.5e+06" in CliRunner().invoke(tool(body), []).stdout
    assert CliRunner().invoke(tool(body), ["-q"]).stdout == ""


def test_a_stage_needs_an_output():
    @click.command("sample", cls=Tool)
    @stage_options
    def main(session, output, overwrite): ...

    result = CliRunner().invoke(main, [])
    assert result.exit_code == 2
    assert "--output" in result.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="other systems ignore the limit")
def test_an_address_space_too_small_for_the_libraries_is_refused_before_they_hang(tmp_path):
    script = "from graben.cli.start import graben; graben()"
    command = ["bash", "-c", 'ulimit -v 500000; exec "$0" -c "$@"', sys.executable, script, "check", "x.toml"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60, cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "not enough memory" in done.stderr and "ulimit -v" in done.stderr
