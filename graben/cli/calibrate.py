"""calibrate: parameters of a constitutive law from stress-strain curves."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.budget import budget_option, options_of, within
from graben.cli.options import FILE, Session, Tool, cluster_option, scene_argument, set_option, stage_options


@click.command("calibrate", cls=Tool)
@scene_argument
@click.argument("curves", type=FILE, nargs=-1, metavar="[CURVES]...")
@click.option(
    "--validate",
    type=FILE,
    multiple=True,
    help="Predict the curves of this file too, without fitting them (repeatable): validation_rmse_pa.",
)
@click.option(
    "--compare",
    type=FILE,
    multiple=True,
    metavar="SCENE.toml",
    help="Hold the law of another scene against this one's by cross-validation on the same curves (repeatable).",
)
@click.option("--restart", is_flag=True, help="Go on where an interrupted run with the same output stopped.")
@budget_option
@cluster_option
@set_option
@stage_options
def main(
    session: Session,
    scene: Path,
    curves: tuple[Path, ...],
    validate: tuple[Path, ...],
    compare: tuple[Path, ...],
    restart: bool,
    budget: float | None,
    cluster: str | None,
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """Fit a constitutive law to stress-strain CURVES (artifacts of homogenize, or CSV).

    CURVES replace those of the scene. Writes one NetCDF artifact, and NAME.material.toml beside it, which
    fem-run and scratch take as it is.
    """
    from graben.stages.calibrate import stage as calibrate

    others = [*options_of("--validate", validate), *options_of("--compare", compare)]
    overrides, told = within(
        session, budget, scene, ["calibrate", scene, *curves, *others], curves, overrides, restart
    )
    with session.progress() as progress:
        headline = calibrate.run(
            scene,
            output,
            curves=curves,
            validate=validate,
            compare=compare,
            cluster=cluster,
            restart=restart,
            overrides=overrides,
            overwrite=overwrite,
            progress=progress,
        )
    session.report(told(headline))
