"""explain: what a run of a scene will model, leave out, take and be worth."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, scene_argument, session_options, set_option


@click.command("explain", cls=Tool)
@scene_argument
@click.argument("inputs", type=FILE, nargs=-1, metavar="[INPUTS]...")
@set_option
@session_options
def main(session: Session, scene: Path, inputs: tuple[Path, ...], overrides: tuple[str, ...]) -> None:
    """Tell before a run of SCENE what it models and leaves out, its steps, memory, time and error.

    INPUTS are files that its command takes beside it. Nothing is run.
    """
    from graben.stages.explain import stage as explain

    session.report(explain.run(scene, inputs, overrides=overrides))
