"""The call of a command in this process, and what no answer may be.

Limits are CPU seconds, so that a try ends the same way on a busy machine.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CHECK_S, STAGE_S, HUNG_S = 60.0, 1.0, 400.0


class Fault(AssertionError):
    """What a try shows that must not be."""


@dataclass(frozen=True)
class Answer:
    code: int
    said: str
    out: str


def call(*arguments: Any, seconds: float) -> Answer:
    """`graben ARGUMENTS...`; interrupted after `seconds` of CPU time, which must end it with exit code 130."""
    from click.testing import CliRunner

    from graben.cli.main import main

    with interrupted_after(seconds):
        result = CliRunner().invoke(main, [str(a) for a in arguments])
    if result.exit_code not in (0, 2, 3, 130):
        raise Fault(f"exit code {result.exit_code} of {arguments[0]}: {result.output[-2000:]}")
    if "Traceback" in result.output:
        raise Fault(f"a traceback: {result.output[-2000:]}")
    return Answer(result.exit_code, result.stderr, result.stdout)


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    """Send SIGINT, as Ctrl-C does, to a command that is at work then."""

    def interrupt(number: int, frame: object) -> None:
        if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGPROF, interrupt)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


COMMANDS = {
    "blocks": "dem-run", "particles": "dem-run", "fem": "fem-run", "scratch": "scratch", "calibrate": "calibrate",
    "wear": "wear-estimate",
}  # fmt: skip


def run_scene(scene: Path, kind: str, inputs: Sequence[Path] = (), sound: float = 1.0) -> Answer:
    """Check the scene, then start its stage: both refuse the same, and there are whole files or none.

    inputs : artifacts that its stage takes beside it
    sound : 0 to leave out the stage of a scene without faults, which takes long
    """
    checked = call("check", scene, seconds=CHECK_S)
    if checked.code == 130:
        raise Fault(f"graben check took more than {CHECK_S:g} s")
    output = scene.with_name("out.nc")
    given = (
        ["rev-study", *inputs, "--scene", scene, "--processes", "1"]
        if kind == "rev-study"
        else [COMMANDS[kind], scene]
    )
    if checked.code == 0 and not sound:
        return checked
    ran = call(*given, "-o", output, "--json", "-q", seconds=STAGE_S)
    # The check sees neither the command line nor the artifacts that a study of sizes looks at.
    more = "to run it needs" in checked.out or kind == "rev-study"
    if ran.code == 2 and checked.code == 0 and not more:
        raise Fault(f"check found no fault, the stage refuses: {ran.said[-500:]}")
    if checked.code == 2 and ran.code != 2:
        raise Fault(f"check refuses, the stage ends with {ran.code}: {checked.said[-500:]}")
    judge_output(ran, output)
    return ran


def judge_output(ran: Answer, output: Path) -> None:
    """A whole artifact and numbers that JSON knows, or none; nothing half made."""
    if ran.code == 0:
        json.loads(ran.out.splitlines()[-1], parse_constant=_no_json)
        if call("check", output, seconds=CHECK_S).code:
            raise Fault("the artifact of a finished run has faults")
    elif output.exists():
        raise Fault(f"exit code {ran.code}, but there is an output")
    left = [p.name for p in output.parent.iterdir() if ".part" in p.name and not p.name.endswith(".partial.nc")]
    if left:
        raise Fault(f"half made: {left}")


def same_numbers(one: Path, other: Path) -> bool:
    """Whether two artifacts hold bitwise the same arrays."""
    import xarray

    with xarray.open_dataset(one, decode_times=False) as a, xarray.open_dataset(other, decode_times=False) as b:
        return a.equals(b)


def _no_json(name: str) -> float:
    raise Fault(f"{name} in JSON")
