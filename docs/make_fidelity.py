"""Write docs/manual/fidelity.md from the declared knobs of accuracy: python docs/make_fidelity.py"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from graben.declared.knobs import STAGES, Knob, Stage

PAGE = Path(__file__).parent / "manual" / "fidelity.md"
HEAD = """# Fidelity

`fidelity` in a scene is `draft`, `standard` (unless given) or `reference`. Use draft to try a scene
out, standard for numbers, reference to check them. It chooses the knobs below, as far as the scene
leaves them out. This page is made by [make_fidelity.py](../make_fidelity.py).

- "times 2.7": the value in the scene is multiplied by this. Another factor may be given, for
  instance as `mesh.draft_factor`.
- "12500 or more": a compression of blocks at low confinement takes more steps, so that inertia
  stays small ([theory](../theory/blocks.md#loading)).
- "no key": the fidelity alone decides.

A stage with a promise says by how much its headline number may differ from that at reference, and
what that costs. `make verify-promises` holds them against runs ([study](../studies/tradeoffs.md)).

homogenize and wear-estimate have no knob of accuracy.
"""
NOTES = {
    "blocks": "More: [steps, damping, rounding](../studies/blocks-fidelity.md).",
    "particles": "More: [beds](../studies/beds.md).",
    "fem": "The slope of the pipeline softens: its load falls with the mesh ([study](../studies/slope-mesh.md)).",
    "scratch": "More: [scratch](../studies/scratch.md).",
}


def page() -> str:
    """The text of docs/manual/fidelity.md."""
    parts = [HEAD]
    for stage in STAGES:
        title = stage.command if stage.kind in ("fem", stage.command) else f"{stage.command}, {stage.kind}"
        parts.append(f"## {title}\n")
        if stage.kind in NOTES:
            parts.append(NOTES[stage.kind] + "\n")
        parts.append("\n".join([*promised(stage), *table(stage)]) + "\n")
    return "\n".join(parts)


def table(stage: Stage) -> list[str]:
    """Lines of a stage's table: first what fidelity turns, then what stays."""
    lines = ["| key | what it is | draft | standard | reference |", "|---|---|---|---|---|"]
    for steady, knobs in groupby(sorted(stage.knobs, key=lambda k: k.steady), lambda k: k.steady):
        lines += [row(k, steady) for k in knobs]
    return lines


def promised(stage: Stage) -> list[str]:
    """What each fidelity promises, in a sentence; nothing where nothing was measured."""
    if not stage.promises:
        return []
    errors = ", ".join("none" if p.error is None else f"{100 * p.error:g} %" for p in stage.promises)
    costs = ", ".join(f"{p.cost:g}" for p in stage.promises if p.cost is not None)
    return [f"Promised error of `{stage.headline}`: {errors}. CPU time over that of a draft: {costs}.", ""]


def row(k: Knob, steady: bool) -> str:
    """One knob."""
    name = f"`{k.key}`" if k.settable else "no key"
    unit = "" if k.unit == "1" or not steady or k.standard is None else f" {k.unit}"
    values = [shown(v) + unit for v in (k.draft, k.standard, k.reference)]
    return "| " + " | ".join([name, k.trades, *values]) + " |"


def shown(value: object) -> str:
    """A value, or a rule in words."""
    if value is None:
        return "none"
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
