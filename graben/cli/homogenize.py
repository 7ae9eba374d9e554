"""homogenize: average a run of blocks over a representative area, or a bed of spheres over a ball."""

from __future__ import annotations

from pathlib import Path

import click

from graben.cli.options import FILE, Session, Tool, stage_options


def _length(text: str, argument: str) -> float:
    from graben.errors import BadInput, Fault, Refused
    from graben.schemas.quantities import to_si

    try:
        return to_si(text, "m")
    except Refused as error:
        raise BadInput(Fault("", argument, repr(text), str(error), True)) from error


def _point(text: str, argument: str) -> tuple[float, float]:
    from graben.errors import BadInput, Fault

    parts = text.split(",")
    if len(parts) != 2:
        raise BadInput(Fault("", argument, repr(text), 'two lengths, such as "5 m, 5 m"', True))
    return _length(parts[0], argument), _length(parts[1], argument)


def _corners(text: str) -> list[tuple[float, float]]:
    from graben.errors import BadInput, Fault

    corners = [_point(p, "polygon") for p in text.split(";") if p.strip()]
    if len(corners) < 3:
        raise BadInput(Fault("", "polygon", repr(text), "at least three corners", True))
    return corners


def _centre(text: str) -> tuple[float, ...]:
    if text.count(",") == 2:
        return tuple(_length(part, "centre") for part in text.split(","))
    return _point(text, "centre")


@click.command("homogenize", cls=Tool)
@click.argument("inputs", nargs=-1, required=True, type=FILE, metavar="DEM.nc...")
@click.option("--radius", "radii", multiple=True, metavar="LENGTH", help='Radius of the REV, "4 m" (repeatable).')
@click.option(
    "--centre", metavar="X,Y[,Z]", help='Its centre, "5 m, 5 m" (spheres: x, y, z); the middle unless given.'
)
@click.option("--polygon", metavar="X,Y;...", help='A polygon instead: "1 m,1 m; 9 m,1 m; 9 m,9 m".')
@click.option("--deformed", is_flag=True, help="Measure area and strain in the outline's current shape.")
@click.option(
    "--chosen-at",
    type=click.IntRange(0, 10**9),
    default=0,
    help="Saved state at which blocks meet the REV (0: the first).",
)
@click.option("--steps", "steps_picture", type=FILE, help="Also draw how the outline was found (.png, .pdf, .svg).")
@click.option("--vtk", is_flag=True, help="Also write the outlines as they move (NAME.pvd, for ParaView).")
@stage_options
def main(
    session: Session,
    inputs: tuple[Path, ...],
    radii: tuple[str, ...],
    centre: str | None,
    polygon: str | None,
    deformed: bool,
    chosen_at: int,
    steps_picture: Path | None,
    vtk: bool,
    output: Path,
    overwrite: bool,
) -> None:
    """Average stress and strain of runs of blocks over representative areas, or of beds of spheres over balls.

    Several inputs, or radii, become several paths of one artifact of curves, in the order given.
    """
    from graben.stages.homogenize import stage as homogenize

    corners = _corners(polygon) if polygon is not None else []
    with session.progress() as progress:
        headline = homogenize.run(
            inputs,
            output,
            radii=[_length(r, "radius") for r in radii],
            centre=_centre(centre) if centre is not None else None,
            polygon=corners,
            deformed=deformed,
            chosen_at=chosen_at,
            steps_picture=steps_picture,
            vtk=vtk,
            overwrite=overwrite,
            progress=progress,
        )
    session.report(headline)
