"""scratch: a rigid grain indents a metal specimen, slides and lifts."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.budget import budget_option, options_of, within
from graben.cli.options import FILE, Session, Tool, restart_option, scene_argument, set_option, stage_options


@click.command("scratch", cls=Tool)
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
    """Scratch a specimen with one rigid grain (kind "scratch") and measure the groove.

    Writes one NetCDF artifact with forces, sections and energies, and VTU files with a PVD beside it for ParaView.
    Without damage the degree of wear is a transient: it comes with the path over contact half-width (s_over_a) at
    which it was measured.
    """
    from graben.stages.scratch import stage as scratch

    command = ["scratch", scene, *options_of("--material", [material])]
    overrides, told = within(session, budget, scene, command, [material] if material else [], overrides, restart)
    with session.progress() as progress:
        headline = scratch.run(
            scene,
            output,
            material=material,
            overrides=overrides,
            overwrite=overwrite,
            restart=restart,
            progress=progress,
        )
    session.report(told(headline))
