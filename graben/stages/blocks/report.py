"""What a stage reports of a test of blocks, and the error measures that all tests share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import numpy as np

from graben.mechanics.blocks.record.history import History
from graben.stages.shared.measures import Measure


class Report(Protocol):
    """What the artifact and the headline say of one kind of test."""

    errors: ClassVar[tuple[str, ...]]
    """Headline numbers that are error measures; they go to the cost record."""

    def arrays(self, history: History) -> dict[str, np.ndarray]:
        """Arrays of the artifact that only this test has."""

    def headline(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Headline numbers from the arrays of the artifact."""

    def measures(self, headline: dict[str, Any]) -> list[Measure]:
        """Error measures with their thresholds."""


def energy_measure(headline: dict[str, Any]) -> Measure:
    """The run stops at numerics.energy_limit; half of its default is told."""
    return Measure(
        "energy_error", headline["energy_error"], 0.025,
        "the energy ledger is off by {percent} of the work done; take more steps (numerics.steps)",
    )  # fmt: skip


def kinetic_measure(headline: dict[str, Any]) -> Measure:
    """Quasi-static tests keep a few percent of the energy in motion."""
    return Measure(
        "kinetic_over_stored_energy", headline["kinetic_over_stored_energy"], 0.05,
        "kinetic energy is {percent} of the stored one (5 % is the most of a quasi-static test): the load comes too "
        "fast; take more steps (numerics.steps) or a finer fidelity",
    )  # fmt: skip


def ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """part / whole, 0 where both are."""
    return np.divide(part, np.where((part == 0.0) & (whole == 0.0), 1.0, whole))


def energy_error(arrays: dict[str, np.ndarray]) -> float:
    """Largest error of the ledger over its turnover."""
    energies = {name.removeprefix("energy_"): values for name, values in arrays.items() if name.startswith("energy_")}
    return float(ratio(np.abs(arrays["energy_error"]), turnover(energies)).max())


def turnover(energies: Mapping[str, Any]) -> Any:
    """Work done, or taken up where it turned back, and the energy stored; by names of the ledger [J/m]."""
    taken = sum(energies.get(name, 0.0) for name in ("kinetic", "friction", "plastic", "damping", "excavated"))
    given = abs(energies["boundary"]) + abs(energies["external"])
    return np.maximum(given, taken) + energies["strain"] + energies["joint"]


def kinetic_share(arrays: dict[str, np.ndarray]) -> np.ndarray:
    """Kinetic over stored energy per state; what flies loose counts in neither."""
    moving = arrays["energy_kinetic"] - arrays["energy_kinetic_loose"]
    return ratio(moving, arrays["energy_strain"] + arrays["energy_joint"])
