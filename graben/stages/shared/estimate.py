"""How large a run will be, told before its work starts. What no machine can hold is refused, and the key named."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from graben.errors import BadInput, Fault

MOST_THINGS = 2**31 - 1  # blocks, grains and elements are counted by 32-bit integers
MOST_WORK = 1e14  # element-steps: a machine of 16 cores does some 1e8 a second, so this is ten days and more


@dataclass(frozen=True)
class Estimate:
    """A size of a run.

    count : how many, to a factor of about two; bytes : what they keep in memory
    key, value : the key of the scene that decides it, and what it says
    limit : a count above it is refused
    steps : where the count is work, things times steps: those steps
    """

    name: str
    count: float
    bytes: float
    key: str
    value: str
    limit: float = MOST_THINGS
    steps: float = 0.0


def work(name: str, things: float, steps: float, key: str, value: str) -> Estimate:
    """Things times steps, which cost time and no memory."""
    return Estimate(name, things * steps, 0.0, key, value, MOST_WORK, steps)


def tiles(area: float, edge: float) -> float:
    """Squares of that edge in an area; infinite where a float cannot hold it."""
    side = math.sqrt(area) / edge
    return side * side


def machine_memory() -> float:
    """Physical memory of this machine in bytes; infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return math.inf


def refuse_too_large(file: str | Path, sizes: Sequence[Estimate]) -> None:
    """Raise BadInput for every count above its limit, and where all need more memory than the machine has."""
    faults = [
        Fault(str(file), s.key, s.value, f"a value that gives at most {s.limit:.3g} {s.name} (about {s.count:.2g})")
        for s in sizes
        if not s.count <= s.limit
    ]
    total, memory = sum(s.bytes for s in sizes), machine_memory()
    if not faults and not total <= memory:
        largest = max(sizes, key=lambda s: s.bytes)
        text = (
            f"a run that fits the {memory / 1e9:.3g} GB of this machine "
            f"(about {total / 1e9:.2g} GB, most of it for {largest.count:.2g} {largest.name})"
        )
        faults.append(Fault(str(file), largest.key, largest.value, text))
    if faults:
        raise BadInput(faults)
