"""Path of the rigid tip: phases with smooth velocity ramps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.compiled import kernel

# Columns of a phase row: start [s], duration [s], ramp [s], top speed [m/s], direction x, y, z.
START, DURATION, RAMP, SPEED, DIRECTION = 0, 1, 2, 3, 4


@dataclass(frozen=True)
class Phase:
    """One phase: the tip travels `distance` [m] along `direction` (3,) at up to `speed` [m/s].

    ramp is the share of the duration spent speeding up, and the same again slowing down (at most 0.5).
    """

    name: str
    distance: float
    speed: float
    direction: tuple[float, float, float]
    ramp: float = 0.25

    @property
    def duration(self) -> float:
        return self.distance / (self.speed * (1.0 - self.ramp))


def phase_rows(phases: list[Phase]) -> NDArray[np.float64]:
    """Rows (p, 7) for the kernels, phases one after another from time 0."""
    rows = np.zeros((len(phases), 7))
    start = 0.0
    for row, phase in zip(rows, phases, strict=True):
        row[:] = (start, phase.duration, phase.ramp * phase.duration, phase.speed, *phase.direction)
        start += phase.duration
    return rows


@kernel(error_model="numpy")
def travelled(time, duration, ramp, speed):
    """Distance [m] after `time` [s] of a phase whose speed rises and falls as half a cosine over `ramp` [s]."""
    if time <= 0.0:
        return 0.0
    if time >= duration:
        return speed * (duration - ramp)
    if time < ramp:
        return 0.5 * speed * (time - ramp / np.pi * np.sin(np.pi * time / ramp))
    if time > duration - ramp:
        left = duration - time
        return speed * (duration - ramp) - 0.5 * speed * (left - ramp / np.pi * np.sin(np.pi * left / ramp))
    return speed * (time - 0.5 * ramp)


@kernel(error_model="numpy")
def tip_position(time, phases, origin, out):
    """Centre of the sphere [m] at `time` [s] into out (3,), from phase rows (p, 7) and the centre at time 0."""
    for i in range(3):
        out[i] = origin[i]
    for p in range(phases.shape[0]):
        d = travelled(time - phases[p, 0], phases[p, 1], phases[p, 2], phases[p, 3])
        for i in range(3):
            out[i] += d * phases[p, 4 + i]
