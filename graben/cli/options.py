"""Options, exit codes and progress that all commands share.

A command is ``@click.command("name", cls=Tool)`` with the option decorators below; its body calls one stage
inside ``with session.progress() as progress`` and hands the headline numbers to ``session.report``.
"""

from __future__ import annotations

import logging
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from graben import interrupts

FILE = click.Path(path_type=Path)


class Program:
    """What is started from a shell answers signals from its first moment; see `graben.interrupts`."""

    def main(self, args: Any = None, *rest: Any, **extra: Any) -> Any:
        if args is not None:
            return super().main(args, *rest, **extra)  # type: ignore[misc]
        interrupts.take()
        _open_closed_streams()
        try:
            return super().main(args, *rest, **extra)  # type: ignore[misc]
        except OSError as error:  # of help: what a command does is within Tool.invoke
            _give_up_stdout()
            _tell(f"standard output: cannot be written ({error.strerror})")
            sys.exit(3)


class Tool(Program, click.Command):
    """A click command whose failures become exit codes 2, 3 and 130, never a traceback without --debug."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with interrupts.at_work():
                _refuse_small_address_space()
                return super().invoke(ctx)
        except (Exception, KeyboardInterrupt) as error:
            interrupted = interrupts.came() or isinstance(error, KeyboardInterrupt)
            if not interrupted and isinstance(error, click.ClickException | click.exceptions.Exit | click.Abort):
                raise
            if ctx.params.get("debug"):
                if not interrupted:
                    raise
                traceback.print_exc()
            from graben.stages.shared.outcome import explain

            outcome = explain(KeyboardInterrupt() if interrupted else error)
            name = ctx.info_name or "graben"
            if outcome is None:
                _tell(f"{name}: a fault of the program: {type(error).__name__}: {error}")
                _tell(f"{name}: please report it with the output of --debug")
                ctx.exit(1)
            code, lines = outcome
            for line in lines:
                _tell(f"{name}: {line}")
            ctx.exit(code)


# Of address space that numpy, scipy, LLVM and VTK take when they are loaded [bytes].
_LIBRARIES = 10**9


def _refuse_small_address_space() -> None:
    """MemoryError under a limit in which libraries fail to load, or in which OpenBLAS tries again for ever."""
    with suppress(ImportError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit not in (resource.RLIM_INFINITY, -1) and limit < _LIBRARIES:
            raise MemoryError(
                f"libraries take {_LIBRARIES / 1e6:g} MB of address space (ulimit -v), not {limit / 1e6:g}"
            )


@dataclass(frozen=True)
class Session:
    """What the shared options say about this call."""

    as_json: bool
    quiet: bool
    verbose: int
    strict: bool = False

    def report(self, headline: Mapping[str, Any]) -> None:
        """Print the headline numbers on stdout: one JSON object, or aligned lines for a person.

        A person finds `warnings` on stderr, below them. Where there is no number stands null, or "none".
        """
        from graben.schemas.plain import plain, to_json

        if self.as_json:
            say([to_json(headline)])
        elif not self.quiet:
            found = plain(headline)
            warnings = found.pop("warnings", [])
            say(_lines(found))
            for text in warnings:
                _tell(f"warning: {text}")
        if self.strict and headline.get("warnings"):
            _tell("--strict: the result is written, and it has warnings")
            raise click.exceptions.Exit(3)

    def tell(self, text: str) -> None:
        """A line for a person, beside the numbers."""
        if not self.quiet:
            _tell(text)

    @contextmanager
    def progress(self) -> Iterator[Callable[[float, str], None]]:
        """Yield the callable a stage reports to: a bar on a terminal, otherwise a plain line every 10 s."""
        if self.quiet:
            yield lambda fraction, message: None
        elif sys.stderr.isatty():
            yield from _bar()
        else:
            yield _plain_lines()


def _bar() -> Iterator[Callable[[float, str], None]]:
    from rich.console import Console
    from rich.progress import Progress, TimeRemainingColumn

    with Progress(*Progress.get_default_columns()[:-1], TimeRemainingColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda fraction, message: bar.update(task, completed=fraction, description=message)


def _plain_lines(every_s: float = 10.0) -> Callable[[float, str], None]:
    begun = last = time.monotonic()

    def tell(fraction: float, message: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < every_s:
            return
        last = now
        left = f", {(now - begun) * (1 - fraction) / fraction:.0f} s left" if fraction >= 0.02 else ""
        _tell(f"{100 * fraction:5.1f} % after {now - begun:.0f} s{left}: {message}")

    return tell


def _open_closed_streams() -> None:
    """Closed standard streams go nowhere; the next file that is opened would take their place."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def _give_up_stdout() -> None:
    """Forget what could not be written: Python would try again at its end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say(lines: Iterable[str]) -> None:
    """Lines on stdout. A reader that has gone away has what it wanted; any other refusal is the machine's."""
    try:
        for line in lines:
            click.echo(_printable(line))
    except OSError as error:
        _give_up_stdout()
        if not isinstance(error, BrokenPipeError):
            from graben.errors import MachineFailed

            raise MachineFailed("standard output", error.strerror or str(error)) from error


def _printable(text: str) -> str:
    """The text with escapes for what the standard output cannot encode, such as bytes of names that are no UTF-8."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def _tell(text: str) -> None:
    """A line on stderr; nothing ends because nobody reads it."""
    with suppress(OSError):
        click.echo(text, err=True)


def _lines(headline: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    width = max((len(str(k)) for k in headline), default=0)
    for name, value in headline.items():
        if isinstance(value, Mapping):
            yield f"{indent}{name}"
            yield from _lines(value, indent + "  ")
        elif isinstance(value, list | tuple) and value and isinstance(value[0], str) and " " in value[0]:
            yield f"{indent}{name}"
            yield from (f"{indent}  {text}" for text in value)
        elif isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
            yield f"{indent}{name}"
            for row in value:
                yield indent + "  " + "  ".join(f"{k} {_short(v)}" for k, v in row.items())
        else:
            yield f"{indent}{name:<{width}}  {_short(value)}"


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {_short(v)}" for k, v in value.items())
    if isinstance(value, list):
        return "[" + ", ".join(map(_short, value)) + "]"
    return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


def _session(ctx: click.Context, as_json: bool, quiet: bool, verbose: int) -> Session:
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    logging.basicConfig(level=level, format="%(levelname)s: %(message)s", stream=sys.stderr)
    logging.getLogger().setLevel(level)
    for noisy in ("numba", "matplotlib", "h5py", "PIL"):
        logging.getLogger(noisy).setLevel(logging.WARNING)
    return Session(as_json, quiet, verbose)


def stage_options(function: Callable[..., None]) -> Callable[..., None]:
    """-o, --overwrite, --strict, --json, -v, -q, --debug. The command receives `session`, `output`, `overwrite`."""

    @click.option("-o", "--output", type=FILE, required=True, help="Artifact to write (NetCDF).")
    @click.option("--overwrite", is_flag=True, help="Replace the output if it exists.")
    @click.option("--strict", is_flag=True, help="Exit code 3 where the result has warnings.")
    @session_options
    def wrapped(session: Session, strict: bool, **kwargs: Any) -> None:
        function(session=replace(session, strict=strict), **kwargs)

    return _renamed(wrapped, function)


def session_options(function: Callable[..., None]) -> Callable[..., None]:
    """--json, -v, -q, --debug. The command receives `session`."""

    @click.option("--json", "as_json", is_flag=True, help="Print the headline numbers as one JSON object.")
    @click.option("-v", "--verbose", count=True, help="Log more (twice for debugging).")
    @click.option("-q", "--quiet", is_flag=True, help="No progress, no summary.")
    @click.option("--debug", is_flag=True, help="Show the traceback of an error.")
    @click.pass_context
    def wrapped(ctx: click.Context, /, as_json: bool, verbose: int, quiet: bool, debug: bool, **kwargs: Any) -> None:
        function(session=_session(ctx, as_json, quiet, verbose), **kwargs)

    return _renamed(wrapped, function)


def cluster_option(function: Callable[..., None]) -> Callable[..., None]:
    """--cluster ADDRESS; the command receives `cluster`."""
    return click.option(
        "--cluster",
        metavar="ADDRESS",
        help="Share the work over a Dask cluster, e.g. tcp://10.0.0.1:8786 (pip install 'graben[cluster]').",
    )(function)


def restart_option(function: Callable[..., None]) -> Callable[..., None]:
    """--restart; the command receives `restart`."""
    return click.option(
        "--restart", is_flag=True, help="Go on where a run with the same output was stopped (NAME.checkpoint.npz)."
    )(function)


def set_option(function: Callable[..., None]) -> Callable[..., None]:
    """--set KEY=VALUE, repeatable; the command receives `overrides`, a tuple of strings."""
    return click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        help="Replace a key of the scene, e.g. --set seed=3 --set fidelity=draft (repeatable).",
    )(function)


def scene_argument(function: Callable[..., None]) -> Callable[..., None]:
    """SCENE.toml; the command receives `scene`, a Path."""
    return click.argument("scene", type=FILE, metavar="SCENE.toml")(function)


def _renamed(wrapped: Any, function: Callable[..., None]) -> Callable[..., None]:
    wrapped.__name__ = function.__name__
    wrapped.__doc__ = function.__doc__
    # click collects options in this attribute, innermost first.
    wrapped.__click_params__ = getattr(function, "__click_params__", []) + getattr(wrapped, "__click_params__", [])
    return wrapped
