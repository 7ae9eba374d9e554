"""What a stage costs: CPU time by its work, measured on one machine, and held against another by a yardstick."""

from __future__ import annotations

from dataclasses import dataclass

YARDSTICK_S = 0.25
"""CPU time that the yardstick of graben.stages.explain.machine took where the costs below were measured."""


@dataclass(frozen=True)
class Cost:
    """CPU time = start + per_work * work ** growth [s]; work as a stage estimates it: things times steps."""

    start: float
    per_work: float
    growth: float = 1.0

    def at(self, work: float) -> float:
        """CPU time of that much work [s]."""
        return self.start + self.per_work * float(work) ** self.growth


COSTS: dict[str, Cost] = {
    "blocks": Cost(3.0, 1.6e-7),
    "particles": Cost(3.0, 1.5e-7),
    "rev-study": Cost(3.0, 2e-2),
    "calibrate": Cost(3.0, 1e-6),
    "fem": Cost(4.0, 1e-4),
    "scratch": Cost(3.0, 2e-7),
    "wear": Cost(1.5, 0.0),
}
"""By kind of scene."""
