"""graben check: every fault of scenes and artifacts at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from graben.cli.options import FILE, Session, Tool, session_options

if TYPE_CHECKING:
    from graben.errors import Fault


@click.command("check", cls=Tool)
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="FILE...")
@session_options
def main(session: Session, files: tuple[Path, ...]) -> None:
    """Check scene and material files (.toml) and artifacts (.nc) as their stages would before work.

    Reports every fault; exit code 2 if there is one.
    """
    from graben.errors import BadInput
    from graben.stages.tools.check import examine

    found = {str(file): examine(file) for file in files}
    if any(faults for faults, _ in found.values()):
        raise BadInput([fault for faults, _ in found.values() for fault in faults])
    session.report({file: _words(absent) for file, (_, absent) in found.items()})


def _words(absent: list[Fault]) -> str:
    """Needs of the command line do not make a scene faulty."""
    from graben.stages.shared.outcome import as_options

    needs = "; ".join(f"{fault.key}: {fault.expected}" for fault in map(as_options, absent))
    return f"no fault; to run it needs {needs}" if needs else "no fault"
