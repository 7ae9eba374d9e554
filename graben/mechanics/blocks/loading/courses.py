"""Courses: quantities that run piecewise linearly over time, such as the speed of a wall or a pressure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np


class Course:
    """Straight lines between points (time, value); level before the first, rising by `rate` after the last.

    Two points at one time make a jump. ValueError when times fall, or where there is no point.
    """

    def __init__(self, points: Sequence[tuple[float, float]], rate: float = 0.0) -> None:
        table = np.array(points, dtype=float).reshape(-1, 2)
        self.times, self.values = table[:, 0], table[:, 1]
        if len(table) == 0 or not np.isfinite(table).all() or np.any(np.diff(self.times) < 0.0):
            raise ValueError("a course needs points whose times do not fall")
        self.rate = rate

    def in_steps(self, dt: float) -> Course:
        """The same course over steps of `dt`, its points moved to whole steps."""
        return Course([(round(t / dt), v) for t, v in zip(self.times, self.values, strict=True)], self.rate * dt)

    def at(self, time: float) -> float:
        """Value; at a jump the one after it."""
        k = int(np.searchsorted(self.times, time, side="right"))
        j = max(k - 1, 0)
        return float(self.values[j] + self.slope(time) * (time - self.times[j]))

    def slope(self, time: float) -> float:
        """Rise per unit of time from `time` on."""
        k = int(np.searchsorted(self.times, time, side="right"))
        if k == len(self.times):
            return self.rate
        return 0.0 if k == 0 else float(np.diff(self.values)[k - 1] / np.diff(self.times)[k - 1])

    @property
    def fastest_rate(self) -> float:
        """Largest rise or fall per unit of time, jumps aside."""
        rates = [abs(self.slope(t)) for t in self.times]
        return max(rates)

    @property
    def changes(self) -> bool:
        """Whether it ever leaves its first value."""
        return self.rate != 0.0 or bool(np.any(self.values != self.values[0]))

    @property
    def acts(self) -> bool:
        """Whether it is ever other than nothing."""
        return self.rate != 0.0 or bool(np.any(self.values != 0.0))

    def next_point(self, time: float) -> float:
        """Time of the next point; infinite after the last."""
        k = int(np.searchsorted(self.times, time, side="right"))
        return float(self.times[k]) if k < len(self.times) else float("inf")

    def next_turn(self, time: float) -> float:
        """Time of the next point at which it jumps, or rises before and does not behind, and the like."""
        rises = np.sign([self.slope(t) for t in self.times])
        before = np.concatenate([[0.0], rises[:-1]])
        jumps = np.zeros(len(self.times), dtype=bool)
        jumps[1:] = np.diff(self.times) == 0.0
        turns = self.times[(rises != before) | jumps]
        k = int(np.searchsorted(turns, time, side="right"))
        return float(turns[k]) if k < len(turns) else float("inf")

    def integral(self, time: float) -> float:
        """Integral from 0 to `time`, exact."""
        inner = self.times[(self.times > 0.0) & (self.times < time)]
        marks = np.concatenate([[0.0], np.unique(inner), [time]])
        # Between two marks it is straight: the value in the middle is the mean.
        return float(sum((b - a) * self.at(0.5 * (a + b)) for a, b in pairwise(marks)))


class Clock:
    """A clock that stands while a course jumps: on it each jump takes a stretch, in which its course goes straight.

    Between two loads of a course that jumps there is then a reading for every load between.
    jumps : (n,) times after 0 and up to `end` at which any of the courses jumps; length : of a stretch; no courses:
    the clock reads the time
    """

    def __init__(self, courses: Sequence[Course], end: float, length: float) -> None:
        found = [c.times[1:][(np.diff(c.times) == 0.0) & (np.diff(c.values) != 0.0)] for c in courses]
        jumps = np.unique(np.concatenate([np.zeros(0), *found]))
        self.jumps, self.length = jumps[(jumps > 0.0) & (jumps <= end)], length
        self.end = end + length * len(self.jumps)

    def time(self, reading: np.ndarray | float) -> np.ndarray:
        """Times of readings."""
        count = len(self.jumps)
        begin = self.jumps + self.length * np.arange(count)
        stands = np.clip(np.asarray(reading)[..., None] - begin, 0.0, self.length).sum(axis=-1)
        return np.asarray(reading) - stands

    def reading(self, time: float) -> float:
        """What it reads at a time; where it stands, what it reads first."""
        return time + self.length * float(np.searchsorted(self.jumps, time))

    def stretched(self, course: Course) -> Course:
        """The course over readings of the clock."""
        if not len(self.jumps):
            return course
        points = []
        for number, jump in enumerate(self.jumps.tolist()):
            values = course.values[course.times == jump].tolist() or [course.at(jump)]
            values = values if len(values) > 1 else values * 2
            start = jump + self.length * number
            points += list(zip(np.linspace(start, start + self.length, len(values)).tolist(), values, strict=True))
        others = ~np.isin(course.times, self.jumps)
        times = course.times[others]
        readings = times + self.length * np.searchsorted(self.jumps, times)
        points += list(zip(readings.tolist(), course.values[others].tolist(), strict=True))
        return Course(sorted(points, key=lambda point: point[0]), course.rate)
