"""What a stage costs: CPU time by its work, measured on one machine, and held against another by a yardstick."""

from __future__ import annotations

from dataclasses import dataclass

YARDSTICK_S = 0.08
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
    "blocks": Cost(4.5, 8.3e-9, 1.1),
    "particles": Cost(1.2, 4.5e-7),
    "rev-study": Cost(1.5, 2e-2),
    "calibrate": Cost(2.5, 9e-7),
    "fem": Cost(1.2, 4.8e-7, 1.3),
    "scratch": Cost(1.0, 6.9e-7),
    "wear": Cost(0.4, 0.0),
}
"""By kind of scene: from the studies of fidelity in docs/studies/tradeoffs.md, within a third of each run there."""
