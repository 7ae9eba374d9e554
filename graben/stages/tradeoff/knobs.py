"""Knobs of a study and the grid of their values, as a caller writes them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product

from graben.declared.knobs import FIDELITIES
from graben.errors import BadInput, Fault

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
_MOST = 2000


@dataclass(frozen=True)
class Knob:
    """A key, and its values from coarse to fine, as texts."""

    key: str
    values: tuple[str, ...]

    @property
    def sizes(self) -> list[float] | None:
        """A size per value that falls towards the fine end, as a mesh's edge does; None where it does not.

        A value that grows towards the fine end, as a number of steps does, counts by its inverse. Values are of one
        unit.
        """
        found = [_NUMBER.match(value) for value in self.values]
        units = {value[match.end() :].strip() for value, match in zip(self.values, found) if match}
        if not all(found) or len(units) != 1:
            return None
        numbers = [float(match[1]) for match in found if match]
        if min(numbers) <= 0.0:
            return None
        sizes = numbers if numbers[0] > numbers[-1] else [1.0 / number for number in numbers]
        return sizes if all(a > b for a, b in pairwise(sizes)) else None


def knobs_of(texts: Sequence[str]) -> list[Knob]:
    """Knobs from texts KEY=v1,v2,...; the three fidelities where there is none.

    Raises
    ------
    BadInput : a text of another form, a key twice, a single value, the same value twice, too many points
    """
    knobs = [_knob(text) for text in texts] or [Knob("fidelity", FIDELITIES)]
    faults = [_fault(k.key, "a key that is given once") for i, k in enumerate(knobs) if k.key in _keys(knobs[:i])]
    faults += [_fault(k.key, "another key: --seeds repeats each point") for k in knobs if k.key == "seed"]
    points = math.prod(len(k.values) for k in knobs)
    if points > _MOST:
        faults.append(_fault(str(points), f"at most {_MOST} points of the grid"))
    if faults:
        raise BadInput(faults)
    return knobs


def grid(knobs: Sequence[Knob]) -> list[dict[str, str]]:
    """Every combination of values; the last is the finest."""
    return [dict(zip(_keys(knobs), values)) for values in product(*(k.values for k in knobs))]


def _keys(knobs: Sequence[Knob]) -> list[str]:
    return [k.key for k in knobs]


def _knob(text: str) -> Knob:
    key, equals, values = text.partition("=")
    parts = [part.strip() for part in _split(values)]
    if not equals or not key.strip() or not all(parts) or len(parts) < 2 or len(set(parts)) < len(parts):
        raise BadInput(_fault(text, "KEY=v1,v2,... with two different values at least, from coarse to fine"))
    return Knob(key.strip(), tuple(parts))


def _split(text: str) -> list[str]:
    """Parts between commas that stand in no brackets and in no quotes."""
    parts, depth, quoted = [""], 0, False
    for c in text:
        quoted ^= c == '"'
        depth += 0 if quoted else (c in "[{") - (c in "]}")
        if c == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += c
    return parts


def _fault(value: str, expected: str) -> Fault:
    return Fault("", "knob", repr(value), expected, True)
