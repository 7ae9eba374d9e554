"""dem-run: run a scene of blocks or of particles."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.budget import budget_option, within
from graben.cli.options import Session, Tool, restart_option, scene_argument, set_option, stage_options


@click.command("dem-run", cls=Tool)
@scene_argument
@restart_option
@budget_option
@set_option
@stage_options
def main(
    session: Session,
    scene: Path,
    restart: bool,
    budget: float | None,
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """Run a scene of discrete rock (kind "blocks") or of grains (kind "particles").

    Writes one NetCDF artifact, and VTU files with a PVD beside it for ParaView.
    """
    from graben.stages.dem_run import stage as dem_run

    overrides, told = within(session, budget, scene, ["dem-run", scene], [], overrides, restart)
    with session.progress() as progress:
        headline = dem_run.run(
            scene, output, overrides=overrides, overwrite=overwrite, restart=restart, progress=progress
        )
    session.report(told(headline))
