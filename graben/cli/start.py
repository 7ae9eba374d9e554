"""Where every command begins: signals are in hand before anything else is imported."""

from __future__ import annotations

from collections.abc import Callable

from graben import interrupts


def _command(module: str) -> Callable[[], None]:
    def run() -> None:
        interrupts.take()
        from importlib import import_module

        import_module(f"graben.cli.{module}").main()

    return run


graben = _command("main")
dem_run = _command("dem_run")
homogenize = _command("homogenize")
rev_study = _command("rev_study")
calibrate = _command("calibrate")
fem_run = _command("fem_run")
scratch = _command("scratch")
wear_estimate = _command("wear_estimate")
