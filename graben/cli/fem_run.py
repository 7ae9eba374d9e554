"""fem-run: finite elements in plane strain, up to failure."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.budget import budget_option, options_of, within
from graben.cli.options import FILE, Session, Tool, restart_option, scene_argument, set_option, stage_options


@click.command("fem-run", cls=Tool)
@scene_argument
@click.option(
    "--material",
    type=FILE,
    help="Use this law and its parameters instead of the scene's: NAME.material.toml or calibrate's artifact.",
)
@restart_option
@budget_option
@set_option
@stage_options
def main(
    session: Session,
    scene: Path,
    material: Path | None,
    restart: bool,
    budget: float | None,
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """Load a plane-strain body (kind "fem") by gravity and then by rising pressures, up to failure.

    Writes one NetCDF artifact, and VTU files with a PVD beside it for ParaView. That no equilibrium is found
    beyond some load is the result (stepping.goal = "failure"), not an error.
    """
    from graben.stages.fem_run import stage as fem_run

    command = ["fem-run", scene, *options_of("--material", [material])]
    overrides, told = within(session, budget, scene, command, [material] if material else [], overrides, restart)
    with session.progress() as progress:
        headline = fem_run.run(
            scene,
            output,
            material=material,
            overrides=overrides,
            overwrite=overwrite,
            restart=restart,
            progress=progress,
        )
    session.report(told(headline))
