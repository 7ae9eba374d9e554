"""tradeoff: error of a number against the cost of the run, over settings of any stage."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, cluster_option, set_option, stage_options


def _share(ctx: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    if text is None:
        return None
    number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
    try:
        value = float(number) / (100.0 if percent else 1.0)
    except ValueError:
        value = -1.0
    if not 0.0 < value < 10.0:
        raise click.BadParameter(f"{text!r}: expected a share such as 5% or 0.05", ctx, parameter)
    return value


@click.command("tradeoff", cls=Tool)
@click.argument("scene", type=FILE, metavar="SCENE.toml|RUN.nc")
@click.argument("inputs", nargs=-1, metavar="[INPUTS]...")
@click.option("--quantity", required=True, metavar="NAME", help="Number of the stage's JSON, e.g. failure_load_pa.")
@click.option(
    "--knob",
    "knobs",
    multiple=True,
    metavar="KEY=v1,v2,...",
    help="Values of a key of the scene, coarse to fine (repeatable: a grid); the three fidelities unless given.",
)
@click.option("--seeds", type=click.IntRange(1, 1000), default=1, help="Runs of each point, with a seed each.")
@click.option("--reference", type=float, help="The true value, in SI; otherwise the finest point decides.")
@click.option("--error", "wanted", callback=_share, metavar="5%", help="Recommend the cheapest point within it.")
@click.option("--processes", type=click.IntRange(0, 1024), default=1, help="Runs at a time (0: one per core).")
@cluster_option
@set_option
@stage_options
def main(
    session: Session,
    scene: Path,
    inputs: tuple[str, ...],
    quantity: str,
    knobs: tuple[str, ...],
    seeds: int,
    reference: float | None,
    wanted: float | None,
    processes: int,
    cluster: str | None,
    overrides: tuple[str, ...],
    output: Path,
    overwrite: bool,
) -> None:
    """What accuracy costs: run the stage of SCENE at every point of a grid of its keys.

    INPUTS are what the stage's command takes beside the scene; options of it stand after "--". A run of blocks
    instead of a scene is averaged by homogenize, and knobs are its options. What is done is not done again.
    """
    import os

    from graben.stages.tradeoff import stage as tradeoff

    with session.progress() as progress:
        headline = tradeoff.run(
            scene, inputs, output, quantity=quantity, knobs=knobs, seeds=seeds, reference=reference, wanted=wanted,
            overrides=overrides, processes=processes or os.cpu_count() or 1, cluster=cluster, overwrite=overwrite,
            progress=progress,
        )  # fmt: skip
    session.report(headline)
