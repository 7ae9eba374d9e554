"""What of a study is done already: finished chunks of samples, and fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from graben.errors import Refused
from graben.mechanics.stored import Arrays, like, listed, named, part_of
from graben.stages.shared.checkpoint import Keep

Sample = tuple[np.ndarray, np.ndarray, float, int, bytes]
"""Stress, strain, area and blocks of one sample: how many, and which ones, a bit a block."""
Fitted = tuple[np.ndarray, float]
"""Parameters of one sample, and the error of their stress."""


@dataclass
class Done:
    """Results by number, as `compute` gives and takes them; each new one is told to `keep`.

    first : (j, k) sets of parameters that the first fit refined, best first; None before it
    """

    keep: Keep = lambda take: None
    chunks: dict[int, list[Sample]] = field(default_factory=dict)
    first: np.ndarray | None = None
    fits: dict[int, Fitted] = field(default_factory=dict)

    def averaged(self, number: int, samples: list[Sample]) -> None:
        self.chunks[number] = samples
        self.keep(self.stored)

    def fitted_first(self, members: np.ndarray) -> None:
        self.first = members
        self.keep(self.stored)

    def fitted(self, number: int, fit: Fitted) -> None:
        self.fits[number] = fit
        self.keep(self.stored)

    def stored(self) -> Arrays:
        """All as arrays."""
        found = {"chunks": np.array(list(self.chunks), dtype=np.int64)}
        for number, samples in self.chunks.items():
            chunk = {
                "states": np.array([len(stress) for stress, *_ in samples], dtype=np.int64),
                "stress": np.concatenate([stress for stress, *_ in samples]),
                "strain": np.concatenate([strain for _, strain, *_ in samples]),
                "area": np.array([area for *_, area, _, _ in samples], dtype=float),
                "blocks": np.array([blocks for *_, blocks, _ in samples], dtype=np.int64),
                "which": np.array([np.frombuffer(which, np.uint8) for *_, which in samples]),
            }
            found |= named(f"chunk.{number}", chunk)
        if self.first is not None:
            values = [values for values, _ in self.fits.values()]
            found |= {
                "first": self.first,
                "fits": np.array(list(self.fits), dtype=np.int64),
                "fit_value": np.array(values, dtype=float).reshape(len(values), self.first.shape[1]),
                "fit_rmse": np.array([rmse for _, rmse in self.fits.values()], dtype=float),
            }
        return found

    def bring_back(self, stored: Arrays, chunks: Sequence[int], fits: int, parameters: int) -> None:
        """Take up what is done; Refused where it is none of this study.

        chunks : samples of each; fits : their number; parameters : of each, 0 where nothing is fitted
        """
        for number in _numbers(stored, "chunks", len(chunks)):
            self.chunks[number] = _chunk(part_of(stored, f"chunk.{number}"), chunks[number])
        if "first" not in stored:
            return
        self.first = like(np.zeros((0, parameters)), stored["first"], "first", rows=True)
        if not len(self.first) or self.first.min() < 0.0 or self.first.max() > 1.0:
            raise Refused(f"first: sets of {parameters} parameters, as fractions of their ranges")
        numbers = _numbers(stored, "fits", fits)
        values = like(np.zeros((len(numbers), parameters)), stored.get("fit_value"), "fit_value")
        errors = listed(stored.get("fit_rmse"), "fit_rmse", len(numbers))
        self.fits = {n: (row, error) for n, row, error in zip(numbers, values, errors)}


def _numbers(stored: Arrays, name: str, count: int) -> list[int]:
    numbers = [int(n) for n in listed(stored.get(name), name)]
    if len(set(numbers)) != len(numbers) or not all(0 <= n < count for n in numbers):
        raise Refused(f"{name}: numbers of {count} tasks, each once")
    return numbers


def _chunk(stored: Arrays, samples: int) -> list[Sample]:
    states = [int(n) for n in listed(stored.get("states"), "states", samples)]
    if min(states) < 1:
        raise Refused("states: one at least of each sample")
    rows = np.zeros((sum(states), 4))
    ends = np.cumsum(states)[:-1]
    stress, strain = (np.split(like(rows, stored.get(k), k), ends) for k in ("stress", "strain"))
    area = listed(stored.get("area"), "area", samples)
    blocks = [int(n) for n in listed(stored.get("blocks"), "blocks", samples)]
    which = np.asarray(stored.get("which"))
    if which.dtype != np.uint8 or which.ndim != 2 or len(which) != samples:
        raise Refused(f"which: the blocks of {samples} samples, a bit a block")
    return list(zip(stress, strain, area, blocks, [row.tobytes() for row in which]))
