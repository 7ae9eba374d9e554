"""graben check: every fault of scenes and artifacts at once."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, session_options


@click.command("check", cls=Tool)
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="FILE...")
@session_options
def main(session: Session, files: tuple[Path, ...]) -> None:
    """Check scene files (.toml) and artifacts (.nc); report every fault. Exit code 2 if there is one."""
    from graben.errors import BadInput
    from graben.schemas.check import check

    faults = [fault for file in files for fault in check(file)]
    if faults:
        raise BadInput(faults)
    session.report({str(file): "no fault" for file in files})
