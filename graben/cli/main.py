"""graben: the umbrella command. Lists every tool and starts the one that is named."""

from __future__ import annotations

from importlib import import_module

import click

import graben
from graben.cli.options import Program

TOOLS = {
    "dem-run": ("graben.cli.dem_run:main", "Run a scene of blocks or grains."),
    "homogenize": ("graben.cli.homogenize:main", "Average a run over a representative area."),
    "rev-study": ("graben.cli.rev_study:main", "How large must the representative area be?"),
    "calibrate": ("graben.cli.calibrate:main", "Fit a continuum law to stress-strain curves."),
    "fem-run": ("graben.cli.fem_run:main", "Use the law in a finite-element model."),
    "scratch": ("graben.cli.scratch:main", "Scratch a specimen with one grain."),
    "wear-estimate": ("graben.cli.wear_estimate:main", "Combine bed and grooves into a wear rate."),
    "tradeoff": ("graben.cli.tradeoff:main", "Error against cost, over settings of any stage."),
    "explain": ("graben.cli.explain:main", "What a run will model, leave out, take and be worth."),
    "check": ("graben.cli.check:main", "Report every fault of scenes and artifacts."),
    "scene": ("graben.cli.scene:main", "Print a commented scene template, or its JSON Schema."),
    "show": ("graben.cli.show:main", "Draw an artifact as a picture."),
    "warm": ("graben.cli.warm:main", "Compile every kernel once, so that no run has to."),
    "report": ("graben.cli.report:main", "One HTML page for a folder of results."),
}


class _Umbrella(Program, click.Group):
    """Imports a tool only when it is called, so that help answers at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(TOOLS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in TOOLS:
            return None
        module, name = TOOLS[cmd_name][0].split(":")
        return getattr(import_module(module), name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Tools"):
            formatter.write_dl([(name, short) for name, (_, short) in TOOLS.items()])


@click.group(cls=_Umbrella, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(graben.__version__, prog_name="graben")
def main() -> None:
    """From a scene of discrete rock or sand to numbers an engineer can use.

    Up-scaling: dem-run, homogenize, rev-study, calibrate, fem-run. Wear: dem-run, scratch, wear-estimate.
    """
