"""graben scene: a commented template of a scene, or its JSON Schema."""

from __future__ import annotations

import click

from graben.cli.options import Tool, say

KINDS = ("blocks", "particles", "rev-study", "calibrate", "fem", "scratch", "wear")


@click.command("scene", cls=Tool)
@click.argument("kind", type=click.Choice(KINDS))
@click.option("--schema", is_flag=True, help="Print the JSON Schema for editors instead.")
def main(kind: str, schema: bool) -> None:
    """Print a commented scene template that `graben check` accepts."""
    from graben.schemas import template

    say([(template.json_schema(kind) if schema else template.template(kind)).rstrip("\n")])
