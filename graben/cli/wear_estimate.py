"""wear-estimate: combine contact counts, grooves and machine data into a wear rate."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, scene_argument, set_option, stage_options


def _pairs(ctx: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> dict[str, list[Path]]:
    files: dict[str, list[Path]] = {}
    for value in values:
        name, equals, path = value.partition("=")
        if not (name and equals and path):
            raise click.BadParameter(f"{value!r}: expected CLASS=FILE", ctx, parameter)
        files.setdefault(name, []).append(Path(path))
    return files


@click.command("wear-estimate", cls=Tool)
@scene_argument
@click.option("--bed", type=FILE, help="Particles artifact (from dem-run) whose floor contacts count.")
@click.option(
    "--scratch",
    multiple=True,
    metavar="CLASS=FILE",
    callback=_pairs,
    help="Scratch artifact with a groove by grains of that class (repeatable).",
)
@set_option
@stage_options
def main(
    session: Session,
    scene: Path,
    bed: Path | None,
    scratch: dict[str, list[Path]],
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """Estimate the wear rate of each mixture of grains in a scene of kind "wear".

    Counts come from a law or from a bed, grooves from the scene or from scratch artifacts, the force per contact from
    the grooves as given or from the machine's load.
    """
    from graben.stages.wear_estimate import stage as wear_estimate

    with session.progress() as progress:
        headline = wear_estimate.run(
            scene, output, bed=bed, scratch=scratch, overrides=overrides, overwrite=overwrite, progress=progress
        )
    session.report(headline)
