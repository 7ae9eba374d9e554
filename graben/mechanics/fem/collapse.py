"""How near a body is to the load that it cannot carry: what of a rising pressure its law carries, and its compliance.

With viscous stabilisation a march goes on past that load: viscous forces carry the rest. So the load that counts is
what the law carries, and an overload ends the march.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.stored import Arrays, listed

# Viscous stress below this multiple of the rise of the pressure in the relaxation time is that of elastic strain.
_ELASTIC = 5.0
_COLUMNS = ("time", "pressure", "carried", "settlement", "iterations")


@dataclass(frozen=True)
class RisingPressure:
    """A pressure on a segment of the outline that rises with the load time.

    Attributes
    ----------
    settling : (2 n,) weights whose product with a displacement is the mean settlement of the segment, m
    length : of the segment, m
    offset, rate : pressure at time 0, Pa, and its rise, Pa/s
    """

    settling: np.ndarray
    length: float
    offset: float
    rate: float

    def at(self, time: float) -> float:
        """Pressure at a load time, Pa."""
        return self.offset + self.rate * time

    def viscous(self, drag: np.ndarray | None, increment: np.ndarray) -> float:
        """Pressure, Pa, that viscous nodal forces (2 n,), N/m, carry in a step with this displacement increment."""
        if drag is None:
            return 0.0
        moved = float(self.settling @ increment)
        return float(drag @ increment) / (self.length * moved) if moved > 0 else 0.0

    def hidden(self, relaxation: float) -> float:
        """Pressure, Pa, below which stabilisation of that relaxation time, s, hides a failure.

        The elastic response to a rising pressure has a viscous part of its own, which is no overload.
        """
        return _ELASTIC * self.rate * relaxation


@dataclass(frozen=True)
class Overload:
    """The criterion of failure of a march with viscous stabilisation.

    Attributes
    ----------
    share : of the pressure; failure is where viscous forces carry more
    relaxation : of the stabilisation, s
    """

    pressure: RisingPressure
    share: float
    relaxation: float

    def reason(self, time: float, drag: np.ndarray | None, increment: np.ndarray) -> str:
        """Why a step to that time, with these viscous forces and increment (2 n,), is an overload; "" where not."""
        viscous = self.pressure.viscous(drag, increment)
        if viscous > self.share * self.pressure.at(time) and viscous > self.pressure.hidden(self.relaxation):
            return f"viscous stress carries {viscous / 1e6:.3g} MPa of the pressure"
        return ""


class LoadCurve:
    """Pressure, what of it the law carries, and settlement, from the state under gravity on and after each step.

    Attributes
    ----------
    time, pressure, carried, settlement, iterations : s, Pa, Pa, m, factorisations
    """

    def __init__(self, load: RisingPressure, start: np.ndarray) -> None:
        """start: (2 n,) displacement that settlement counts from, m."""
        self._load, self._start, self._now = load, start, start
        self.time, self.pressure, self.carried = [0.0], [load.offset], [load.offset]
        self.settlement, self.iterations = [0.0], [0]

    def add(self, time: float, displacement: np.ndarray, drag: np.ndarray | None, iterations: int) -> None:
        """Take in a step to a displacement (2 n,), with its viscous forces.

        The law carries what is left of the pressure when the power of the viscous forces is taken off its own.
        """
        pressure = self._load.at(time)
        self.time.append(time)
        self.pressure.append(pressure)
        self.carried.append(pressure - self._load.viscous(drag, displacement - self._now))
        self.settlement.append(float(self._load.settling @ (displacement - self._start)))
        self.iterations.append(iterations)
        self._now = displacement

    def stored(self) -> Arrays:
        """The curve as arrays."""
        return {name: np.array(getattr(self, name)) for name in _COLUMNS}

    def bring_back(self, stored: Arrays, now: np.ndarray) -> None:
        """Take up a curve of `stored`; now: displacement (2 n,) of its end. Refused where it is none."""
        length = np.size(stored.get("time", ()))
        columns = {name: listed(stored.get(name), f"curve.{name}", length) for name in _COLUMNS}
        if not length:
            raise Refused("curve.time: one state at least")
        for name, values in columns.items():
            setattr(self, name, [int(v) for v in values] if name == "iterations" else values)
        self._now = now

    def compliance_ratio(self) -> float:
        """Settlement per pressure of the last step over that of the first; grows without bound at a collapse."""
        movement, rise = np.diff(self.settlement), np.diff(self.pressure)
        good = np.flatnonzero(rise > 0)
        if not len(good) or movement[good[0]] == 0:
            return 1.0
        first, last = good[0], good[-1]
        return float((movement[last] / rise[last]) / (movement[first] / rise[first]))
