"""graben show: draw an artifact."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, session_options


@click.command("show", cls=Tool)
@click.argument("artifact", type=FILE, metavar="FILE.nc")
@click.option("-o", "--output", type=FILE, required=True, help="Picture to write (.png, .pdf, .svg).")
@click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
@session_options
def main(session: Session, artifact: Path, output: Path, overwrite: bool) -> None:
    """Draw what people want to see of an artifact of any kind."""
    from graben.stages.tools import picture

    picture.run(artifact, output, overwrite=overwrite)
    session.report({"picture": str(output)})
