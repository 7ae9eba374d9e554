"""Brackets: a load, or a loss of strength, is held until the body rests or fails; a failure is tried again with less.

Each try begins at the largest load at which the body was at rest, so that both ends of the bracket are seen: the body
rests at the lower one, and from there it does not at the upper one. What holds is dead weight, so nothing here
depends on how a failure is driven. The price is a rest for each try.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.loading.failure import Failure
from graben.mechanics.blocks.loading.programme import HOLD, RESTLESS, Programme
from graben.mechanics.blocks.loading.protocol import Moment, State
from graben.mechanics.blocks.record import snapshot

# A first step, over the whole rise; steps that it takes at least; tries at most.
_FIRST, _LEAST, _TRIES = 0.1, 500, 60

# Shares of the rise: a body that fails under less bears nothing, and nothing closer is told apart.
_LEAST_LOAD, _FINEST = 1e-4, 1e-9

# Strength is reduced from what holds more or less everything, by factors, up to what holds next to nothing.
_STRONG, _FACTOR, _WEAK = 0.125, 1.5, 20.0


class Holds(Programme):
    """A `Programme` whose loads are held between steps, and bracketed.

    steps : of the whole rise; width : of the bracket wanted, over the load
    weaken : strength is reduced instead, by a factor that takes the place of the load time; the loads stay
    low, high : the bracket [s, or the factor]; tried : whether the upper end was tried from the lower one
    tries : how many have been made
    """

    def __init__(self, *arguments: Any, steps: int, width: float, weaken: bool = False, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.steps, self.width, self.weaken = steps, width, weaken
        self.low, self.high, self.tried = (_STRONG if weaken else 0.0), np.inf, False
        self.last, self.tries, self._fallen = (_WEAK if weaken else self.end), 0, 0
        if weaken:
            self.model.weaken(self.low)

    def run(self) -> Iterator[Moment]:
        """Find the bracket; the last saved state is the failure from its lower end, where there is one."""
        m = self.model
        if self._over_and_saved:
            return
        if not self.load_times:
            m.begin_ledger()
            self.rise.load_time = self.low
            yield self._moment(save=True)
        if self.rise.failed:
            return
        kept = self._kept()
        while self.tries < _TRIES:
            target = self._next()
            yield from self._try(target)
            self.tries += 1
            if self.at_rest:
                self.low, self.tried = target, False
                if target >= self.high:
                    # From nearer by the body bears what it did not before: the search goes up again.
                    self.high = np.inf
                self.carried = m.motion.x.copy()
                if self.low >= self.last:
                    break
                kept = self._kept()
                yield self._moment(save=True)
                continue
            self.high, self.tried = target, True
            if self.narrow:
                self.rise.failed = True
                break
            if self.tries + 1 == _TRIES:
                # What is known then is a bracket all the same, though a wide one.
                self.rise.failed = True
                break
            self._bring(kept)
        yield from self._last_moment()

    @property
    def narrow(self) -> bool:
        """Whether the bracket is as narrow as wanted, over the failure load and over the time at which it came."""
        if np.isinf(self.high):
            return False
        nothing = self.low == 0.0 and self.high <= _LEAST_LOAD * self.end
        if nothing or self.high - self.low <= _FINEST * self.end:
            return True
        close = self.high - self.low <= self.width * 0.5 * (self.high + self.low)
        return close and (self.weaken or self.loads.apart(self.low, self.high) <= self.width)

    def _next(self) -> float:
        """What is tried next: further up, between, or the upper end once more, from a new lower one."""
        if np.isinf(self.high):
            further = self.low * _FACTOR if self.weaken else self.low + _FIRST * self.end
            # Between two turns loads go one way: what is borne at both ends is borne between.
            turn = np.inf if self.weaken else self.loads.next_turn(self.low)
            return min(further, turn, self.last)
        if self.narrow and not self.tried:
            return self.high
        return 0.5 * (self.low + self.high)

    def _moment(self, save: bool) -> Moment:
        # Nobody knows how many tries it takes: about twenty.
        return super()._moment(save)._replace(fraction=min(1.0, self.tries / 20))

    def _try(self, target: float) -> Iterator[Moment]:
        """Go there from where the body rests, and hold."""
        rise, start = self.rise, self.rise.load_time
        self.at_rest, self._fallen = False, len(self.falling.blocks)
        share = _FIRST if self.weaken else (target - start) / self.end
        chunks = max(_LEAST, round(share * self.steps)) // HOLD + 1
        for k in range(chunks):
            self._load((k + 1) / chunks, start, target)
            self._advance(steady=False)
            words = f"at {rise.load_time:.4g}, going to {target:.4g}"
            yield self._moment(save=False)._replace(words=words)
            if self._over():
                return
        for steps, ratio in self._stand(max(RESTLESS, self.steps)):
            words = f"at {target:.4g}, {steps} steps, unbalanced force ratio {ratio:.2g}"
            yield self._moment(save=False)._replace(words=words)

    def _over(self) -> bool:
        """Whether blocks fell in this try that are a failure."""
        return len(self.falling.blocks) > self._fallen and self._ends()

    def _load(self, share: float, start: float, target: float) -> None:
        """Loads, or strength, at a share of the way from start to target; loads get there by even steps."""
        before, self.rise.load_time = self.rise.load_time, start + share * (target - start)
        if self.weaken:
            self.model.weaken(self.rise.load_time)
        else:
            self.loads.between(self.model, before, self.rise.load_time, HOLD)

    def _advance(self, *, steady: bool) -> None:
        super()._advance(steady=steady)
        if not self.weaken:
            self.loads.stay(self.model, self.rise.load_time)

    def _look(self, *, steady: bool = False) -> None:
        super()._look(steady=steady)
        # Whether a try failed is known at its end.
        self.rise.failed = self.rise.fell = False

    def failure(self) -> Failure | None:
        """The bracket, and its middle."""
        if not self.rise.failed or np.isinf(self.high):
            return None
        look = int(np.searchsorted(np.maximum.accumulate(self.look_table()[:, 0]), self.low))
        return Failure(0.5 * (self.low + self.high), self.low, self.high, min(look, len(self.looks) - 1))

    @property
    def reached(self) -> float | None:
        """Share of the rise at which the body rested; None where strength is reduced."""
        return None if self.weaken else min(1.0, self.low / self.end)

    def _kept(self) -> tuple[State, State]:
        return snapshot.take(self.model), self.state()

    def _bring(self, kept: tuple[State, State]) -> None:
        """Back to where the body rested."""
        snapshot.bring_back(self.model, {name: values.copy() for name, values in kept[0].items()})
        looks, saved, moments, at_rest = self.looks, self._saved_at, self.load_times, self.at_rest
        super().bring_back({name: np.array(values) for name, values in kept[1].items()})
        self.looks, self._saved_at, self.load_times, self.at_rest = looks, saved, moments, at_rest
        if self.weaken:
            self.model.weaken(self.low)
        else:
            self.loads.stay(self.model, self.low)

    def state(self) -> State:
        bracket = {"low": self.low, "high": self.high, "tried": self.tried, "tries": self.tries}
        return super().state() | {f"bracket_{name}": np.array(value) for name, value in bracket.items()}

    def bring_back(self, state: State) -> None:
        super().bring_back(state)
        self.low, self.high = float(state["bracket_low"]), float(state["bracket_high"])
        self.tried, self.tries = bool(state["bracket_tried"]), int(state["bracket_tries"])
        if not 0.0 <= self.low <= self.high:
            raise Refused("test.bracket_low: at most test.bracket_high")
        if self.weaken:
            self.model.weaken(max(self.low, _STRONG))
