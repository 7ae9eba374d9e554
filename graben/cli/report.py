"""graben report: one HTML page for a folder of results."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, session_options


@click.command("report", cls=Tool)
@click.argument("folder", type=FILE, metavar="DIR")
@click.option("-o", "--output", type=FILE, required=True, help="HTML page to write.")
@click.option("--overwrite", is_flag=True, help="Replace the page if it exists.")
@session_options
def main(session: Session, folder: Path, output: Path, overwrite: bool) -> None:
    """Write one self-contained HTML page for a whole chain: numbers, costs, inputs and pictures."""
    from graben.stages.tools import report

    with session.progress() as progress:
        headline = report.run(folder, output, overwrite=overwrite, progress=progress)
    session.report(headline)
