"""The call of a command in this process, and what no answer may be."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CHECK_S, STAGE_S, HUNG_S = 10.0, 1.0, 90.0


class Fault(AssertionError):
    """What a try shows that must not be."""


@dataclass(frozen=True)
class Answer:
    code: int
    said: str
    out: str


def call(*arguments: Any, seconds: float) -> Answer:
    """`graben ARGUMENTS...`; interrupted after `seconds`, which must end it with exit code 130."""
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
    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


COMMANDS = {
    "blocks": "dem-run", "particles": "dem-run", "fem": "fem-run", "scratch": "scratch", "calibrate": "calibrate",
    "wear": "wear-estimate",
}  # fmt: skip


def run_scene(scene: Path, kind: str) -> Answer:
    """Check the scene, then start its stage for a second: whole files or none, no refusal unseen by check."""
    checked = call("check", scene, seconds=CHECK_S)
    if checked.code == 130:
        raise Fault(f"graben check took more than {CHECK_S:g} s")
    if kind not in COMMANDS:
        return checked
    output = scene.with_name("out.nc")
    ran = call(COMMANDS[kind], scene, "-o", output, "--json", "-q", seconds=STAGE_S)
    if ran.code == 2 and checked.code == 0:
        raise Fault(f"check found no fault, the stage refuses: {ran.said[-500:]}")
    if ran.code == 0:
        json.loads(ran.out.splitlines()[-1], parse_constant=_no_json)
        if call("check", output, seconds=CHECK_S).code:
            raise Fault("the artifact of a finished run has faults")
    elif output.exists():
        raise Fault(f"exit code {ran.code}, but there is an output")
    left = [p.name for p in scene.parent.iterdir() if ".part" in p.name]
    if left:
        raise Fault(f"half made: {left}")
    return ran


def _no_json(name: str) -> float:
    raise Fault(f"{name} in JSON")
