"""One try, and a process that makes tries until it dies of one."""

from __future__ import annotations

import faulthandler
import importlib
import pkgutil
import random
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import graben
from tests.conftest import ROOT
from tests.fuzz.families import FAMILIES
from tests.fuzz.stock import warm


def one(family: str, seed: int, number: int, stock: Path, keep: bool = False) -> None:
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        FAMILIES[family][0](random.Random(f"{family}:{seed}:{number}"), stock, folder)
    except BaseException:
        if keep:
            kept = ROOT / "results/fuzz" / f"{family}-{seed}-{number}"
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(folder, kept, symlinks=True, ignore=_pipes)
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _pipes(folder: str, names: list[str]) -> set[str]:
    return {name for name in names if (Path(folder) / name).is_fifo()}


def worker(pipe: Any, stock: Path) -> None:
    """Take tries from the pipe, and say how each ended."""
    faulthandler.enable()
    # An interrupt within an import leaves half a module, which later tries in this process would stumble over.
    for module in pkgutil.walk_packages(graben.__path__, "graben."):
        importlib.import_module(module.name)
    warm(stock, Path(tempfile.mkdtemp(dir=stock.parent)))
    with suppress(EOFError, ConnectionError):  # the one who asked is no more
        while True:
            task = pipe.recv()
            try:
                one(*task, stock, keep=True)
                answer = None
            except BaseException as error:
                answer = f"{type(error).__name__}: {error}"
            pipe.send(answer)
