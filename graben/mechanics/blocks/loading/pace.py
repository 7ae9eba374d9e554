"""Pace of a quasi-static test: loading slows down where forces show inertia, and speeds up where they do not.

A step always is a step of the model; the pace says for how many steps of the loading it counts. Two shares are
watched that statics wants to be nothing, whatever the deformation: the moment of the unbalanced lateral forces over
that of the lateral pressures (the averaged lateral stress inside over the applied one, less 1), and what the bottom
carries less than the top.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel

# Weight of what was seen before, look by look: vibrations even out, inertia stays.
_KEEP = 0.8


@dataclass(frozen=True)
class ForceCheck:
    """tolerance : of the larger share; slowest, fastest : bounds of the pace; chunk : steps between two looks"""

    tolerance: float
    slowest: float
    fastest: float
    chunk: int = 50


@dataclass
class Pace:
    """Where the pace stands: steps of loading per step now; both shares (smoothed); their largest and summed up."""

    now: float = 1.0
    lateral: float = 0.0
    reaction: float = 0.0
    worst: float = 0.0
    summed: float = 0.0
    looks: int = 0

    def next_steps(self, check: ForceCheck, left: float) -> tuple[int, float]:
        """Steps to take before the next look, and their pace, if `left` steps of loading are to do."""
        needed = int(np.ceil(left / self.now - 1e-9))
        return (check.chunk, self.now) if needed > check.chunk else (needed, left / needed)

    def look(self, model: BlockModel, check: ForceCheck, bottom: np.ndarray, top: np.ndarray) -> None:
        """Bring the shares up to date and choose the pace. bottom, top : flags of vertices"""
        lateral, reaction = force_shares(model, bottom, top)
        self.lateral = _KEEP * self.lateral + (1.0 - _KEEP) * lateral
        self.reaction = _KEEP * self.reaction + (1.0 - _KEEP) * reaction
        found = max(abs(self.lateral), abs(self.reaction))
        self.worst, self.summed, self.looks = max(self.worst, found), self.summed + found, self.looks + 1
        # Inertia grows with the square of the speed.
        change = np.sqrt(check.tolerance / max(found, 1e-9))
        self.now = float(np.clip(self.now * np.clip(change, 0.7, 1.02), check.slowest, check.fastest))


def force_shares(model: BlockModel, bottom: np.ndarray, top: np.ndarray) -> tuple[float, float]:
    """Lateral stress inside over applied, less 1; and what the bottom carries less than the top,
    over the larger of both. Loose blocks do not count."""
    m = model.motion
    there = ~model.loose_blocks()[model.bodies.vertex_block]
    applied = model.load()[:, 0].copy()
    x = np.where(there, m.x[:, 0] - m.x[there, 0].mean(), 0.0)
    moment = float(applied @ x)
    lateral = -float((m.zone_force[:, 0] + m.joint_force[:, 0] + applied) @ x) / moment
    below, above = (float(m.reaction[side, 1].sum()) for side in (bottom, top))
    return lateral, (below + above) / max(abs(below), abs(above), 1e-300)
