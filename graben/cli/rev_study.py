"""rev-study: how large must the representative area be?"""

from __future__ import annotations

import json
from pathlib import Path

import click

from graben.cli.budget import budget_option, options_of, within
from graben.cli.options import FILE, Session, Tool, cluster_option, restart_option, set_option, stage_options


@click.command("rev-study", cls=Tool)
@click.argument("inputs", nargs=-1, required=True, type=FILE, metavar="DEM.nc...")
@click.option(
    "--scene", type=FILE, help='Scene of kind "rev-study"; its defaults unless given (graben scene rev-study).'
)
@click.option(
    "--radius", "radii", multiple=True, metavar="LENGTH", help="Radius to try (repeatable; in rising order)."
)
@click.option("--grid", type=int, help="Centres per side of a square grid.")
@click.option(
    "--calibrate",
    type=FILE,
    metavar="SCENE",
    help='Scene of kind "calibrate": fit its law to every sample; the parameters must settle.',
)
@click.option("--processes", type=int, help="Processes that share the work (0: one per core).")
@restart_option
@budget_option
@cluster_option
@set_option
@stage_options
def main(
    session: Session,
    inputs: tuple[Path, ...],
    scene: Path | None,
    radii: tuple[str, ...],
    grid: int | None,
    calibrate: Path | None,
    processes: int | None,
    restart: bool,
    budget: float | None,
    cluster: str | None,
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """Average runs of blocks over many radii and places, and recommend a radius.

    Several inputs are realizations: the same model from other seeds, at the same lateral stress. With
    --calibrate each seed may come at several lateral stresses, which are fitted together.
    """
    from graben.schemas.scene import load_scene
    from graben.stages.rev_study import stage as rev_study
    from graben.stages.shared.default_scene import default_scene

    short = list(overrides)
    if radii:
        short.append(f"samples.radii={json.dumps(radii, ensure_ascii=False)}")
    if grid is not None:
        short.append(f"samples.grid={grid}")
    if calibrate is not None:
        short.append(f"calibration.scene={json.dumps(str(calibrate.absolute()))}")
    if processes is not None:
        short.append(f"processes={processes}")
    study = load_scene(scene, "rev-study", short) if scene else default_scene("rev-study", short)
    command = ["rev-study", *inputs, *options_of("--scene", [scene])]
    more, told = within(session, budget, scene or study, command, inputs, short, restart)
    study = load_scene(study, "rev-study", more[len(short) :])
    with session.progress() as progress:
        headline = rev_study.run(
            inputs, study, output, cluster=cluster, overwrite=overwrite, restart=restart, progress=progress
        )
    session.report(told(headline))
