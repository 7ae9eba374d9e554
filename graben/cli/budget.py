"""--budget: the finest fidelity that fits a time, chosen before a run; what it took is told after it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from graben.cli.options import Session

Told = Callable[[dict[str, Any]], Mapping[str, Any]]


def budget_option(function: Callable[..., None]) -> Callable[..., None]:
    """--budget TIME; the command receives `budget`, in s, or None."""
    return click.option(
        "--budget",
        callback=_seconds,
        metavar="TIME",
        help='Take the finest fidelity that fits, such as "10 min", and say what error to expect.',
    )(function)


def _seconds(ctx: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    if text is None:
        return None
    from graben.errors import Refused
    from graben.schemas.quantities import to_si

    try:
        value = to_si(text, "s")
        if value <= 0.0:
            raise Refused('a time above 0, such as "10 min"')
    except Refused as error:
        raise click.BadParameter(f"{text!r}: expected {error}", ctx, parameter) from None
    return value


def within(
    session: Session,
    budget: float | None,
    scene: Any,
    command: Sequence[Any],
    inputs: Sequence[Path],
    overrides: Sequence[str],
    restart: bool = False,
) -> tuple[tuple[str, ...], Told]:
    """Overrides with the fidelity that fits, and what adds cost and choice to the headline numbers.

    command : arguments of `graben` that run the scene, without overrides and output; inputs : files among them
    """
    if budget is None:
        return tuple(overrides), lambda headline: headline
    if restart:
        raise click.UsageError("--restart keeps the fidelity of the stopped run: --set fidelity=..., no --budget")
    from graben.stages.explain.budget import choose

    settings = [part for text in overrides for part in ("--set", text)]
    choice = choose(scene, [*map(str, command), *settings], inputs, overrides, budget)
    session.tell(choice.words)
    return (*overrides, f"fidelity={choice.fidelity}"), choice.told


def options_of(name: str, values: Sequence[Any]) -> list[str]:
    """A repeatable option of a command, spelled out: --validate a --validate b."""
    return [part for value in values if value is not None for part in (name, str(value))]
