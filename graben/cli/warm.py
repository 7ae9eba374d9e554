"""graben warm: compile every kernel once, so that no run has to."""

from __future__ import annotations

import click

from graben.cli.options import Session, Tool, session_options


@click.command("warm", cls=Tool)
@click.option("--processes", type=click.IntRange(0, 1024), default=0, help="Worker processes (0: one a core).")
@click.option("--list", "listing", is_flag=True, help="Tell what the cache holds; compile nothing.")
@click.option("--forget", is_flag=True, help="Remove all compiled kernels of this user; compile nothing.")
@session_options
def main(session: Session, processes: int, listing: bool, forget: bool) -> None:
    """Compile every kernel once, in parallel, into the user's cache.

    Without it the first run of a stage compiles what it needs. Installations share kernels where their sources,
    Python, numba, llvmlite, numpy and CPU agree.
    """
    from graben.stages.tools import warm

    if listing and forget:
        raise click.UsageError("either --list or --forget")
    if listing or forget:
        session.report(warm.listed() if listing else warm.forget())
        return
    with session.progress() as progress:
        headline = warm.run(processes, progress=progress)
    session.report(headline)
