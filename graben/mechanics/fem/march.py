"""Adaptive load steps through time, up to the end or up to the load that cannot be carried."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from graben.mechanics.fem.body import Body, State
from graben.mechanics.fem.collapse import Overload
from graben.mechanics.fem.newton import Drag, NewtonOptions, Step, equilibrate

_COARSE = 0.1  # of the march: steps that are too long to say where an overload begins
_RESOLVED = 50  # steps that an end of the march is resolved by
_LEAST = 1e-12  # of the smallest step: the first step is no smaller
_DOWN = 0.1  # of a first step that failed, below the smallest


@dataclass(frozen=True)
class StepOptions:
    """Length of the steps, s of load time.

    first, largest, smallest : a step that fails is halved; below `smallest` the march ends
    easy, hard : iterations below which the next step grows by half, and above which it shrinks by a third
    extrapolate : start each step from the last increment, scaled
    resolve : find an early end too, to 2 %: `smallest` is at most a fiftieth of what was marched, and before
        the first step a trillionth of itself
    """

    first: float
    largest: float
    smallest: float
    easy: int = 6
    hard: int = 12
    extrapolate: bool = True
    resolve: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.smallest <= self.first <= self.largest:
            raise ValueError("step lengths must satisfy 0 < smallest <= first <= largest")

    def least_after(self, marched: float) -> float:
        """Length below which a step that fails is not halved again, s."""
        if not self.resolve:
            return self.smallest
        return min(self.smallest, marched / _RESOLVED) if marched > 0.0 else self.smallest * _LEAST


@dataclass
class March:
    """How far a march is, and what it went through.

    Attributes
    ----------
    time, state, force, drag : the last equilibrium, its internal and its viscous forces
    begin : load time of the first state
    before : the state before the last step; None before the first
    length, last_length : of the next step, 0 before the first, and of the last one
    complete : whether the end time was reached
    ended : whether the last equilibrium is no equilibrium any more (an overload)
    reason : why the last attempt failed (empty when complete)
    iterations, residuals : per accepted step: factorisations and their residuals
    rejected : number of attempts that failed
    factorisations : of all attempts
    external_work, internal_work, drag_work : J per metre
    """

    time: float
    state: State
    force: np.ndarray
    drag: np.ndarray
    begin: float
    before: State | None = None
    length: float = 0.0
    last_length: float = 0.0
    complete: bool = False
    ended: bool = False
    reason: str = ""
    iterations: list[int] = field(default_factory=list)
    residuals: list[tuple[float, ...]] = field(default_factory=list)
    rejected: int = 0
    factorisations: int = 0
    external_work: float = 0.0
    internal_work: float = 0.0
    drag_work: float = 0.0

    def energy_error(self) -> float:
        """Work of loads and supports against work of the stresses, relative; 0 before anything moved."""
        work = max(abs(self.external_work), abs(self.internal_work))
        return abs(self.external_work - self.internal_work - self.drag_work) / work if work > 0 else 0.0


def at_rest(body: Body, state: State, time: float) -> March:
    """A march that begins from a state, at a time, s.

    The forces that balance the stresses are the internal ones: no work is missed at the start.
    """
    force = body.respond(state, np.zeros(body.pattern.size), False).force
    return March(time, state, force, np.zeros_like(force), time)


def march(
    body: Body,
    start: State,
    external: Callable[[float], np.ndarray],
    begin: float,
    end: float,
    steps: StepOptions,
    newton: NewtonOptions,
    **options: Any,
) -> March:
    """Follow the load history from `begin` to its end, s; arguments and options as in `advance`."""
    run = at_rest(body, start, begin)
    for _ in advance(run, body, external, end, steps, newton, **options):
        pass
    return run


def advance(
    run: March,
    body: Body,
    external: Callable[[float], np.ndarray],
    end: float,
    steps: StepOptions,
    newton: NewtonOptions,
    *,
    prescribed: Callable[[float], np.ndarray] | None = None,
    save_times: np.ndarray | None = None,
    relaxation: float = 0.0,
    overload: Overload | None = None,
) -> Iterator[Step]:
    """Follow the load history to `end`, s: each equilibrium is given when `run` stands on it.

    At last `run` is complete, or a step of the smallest length failed: the load of its time is then the last carried.
    From a copy of `run`, made at any equilibrium, the march goes on bitwise.

    Parameters
    ----------
    run : of `at_rest`
    external : nodal loads (2 n,), N/m, at a time
    prescribed : displacement of `body.fixed`, m, at a time; None: stays as it is in the first state
    save_times : times that a step must end on
    relaxation : relaxation time, s, of the viscous stabilisation (see `newton.Drag`); 0: none
    overload : makes the first equilibrium that is one the last, not complete. A step of more than a tenth of the
        march is halved first
    """
    begin, held = run.begin, run.state.displacement[body.fixed].copy()
    supports = prescribed if prescribed is not None else (lambda _t: held)
    stops = np.array([end]) if save_times is None else np.append(np.asarray(save_times, dtype=float), end)
    stops = np.unique(stops[(stops > begin) & (stops <= end)])
    load = external(run.time)
    run.length = run.length or steps.first
    elastic = None
    if relaxation > 0:
        elastic = body.respond(body.untouched(), np.zeros(body.pattern.size), True).values
        elastic_matrix = body.pattern.matrix(elastic)
    while run.time < end and not run.ended:
        stop = float(stops[np.searchsorted(stops, run.time, side="right")])
        length, target = run.length, run.time + run.length
        # A remainder shorter than a tenth of a step is taken along.
        if target > stop - 0.1 * length:
            target = stop
        taken = target - run.time
        guess = None
        if steps.extrapolate and run.before is not None:
            last_increment = run.state.displacement - run.before.displacement
            guess = last_increment * (taken / run.last_length)
        new_load = external(target)
        resist = None if elastic is None else Drag(elastic_matrix, elastic, relaxation / taken)
        step = equilibrate(body, run.state, new_load, supports(target), newton, guess, resist)
        run.factorisations += step.iterations
        if not step.converged and guess is not None:
            # The path may have bent: once more from rest before the step is halved.
            step = equilibrate(body, run.state, new_load, supports(target), newton, None, resist)
            run.factorisations += step.iterations
        increment = step.state.displacement - run.state.displacement
        ended = overload.reason(target, step.drag, increment) if overload is not None and step.converged else ""
        if not step.converged or (ended and steps.resolve and taken > _COARSE * (target - begin)):
            run.rejected += 1
            run.reason = ended or step.reason
            run.length = 0.5 * taken if run.iterations or taken > steps.smallest else _DOWN * taken
            if run.length < steps.least_after(run.time - begin):
                return
            continue
        _book(run, body, step, increment, load, new_load)
        run.before = run.state
        run.time, run.state, run.force, load = target, step.state, step.force, new_load
        run.iterations.append(step.iterations)
        run.residuals.append(step.residuals)
        run.last_length, run.ended = taken, bool(ended)
        if ended:
            run.reason = ended
        elif step.iterations <= steps.easy:
            run.length = min(1.5 * max(length, taken), steps.largest)
        elif step.iterations > steps.hard:
            run.length = max(taken * 2 / 3, min(taken, steps.smallest))
        yield step
    if not run.ended:
        run.complete, run.reason = True, ""


def _book(
    run: March,
    body: Body,
    step: Step,
    increment: np.ndarray,
    load: np.ndarray,
    new_load: np.ndarray,
) -> None:
    """Add a step to the energy ledger: loads on free, supports on fixed degrees of freedom; trapezoidal."""
    resist = np.zeros_like(load) if step.drag is None else 0.5 * (run.drag + step.drag)
    mean = 0.5 * (load + new_load)
    mean[body.fixed] = (0.5 * (run.force + step.force) + resist)[body.fixed]
    run.external_work += float(mean @ increment)
    run.internal_work += body.internal_work(run.state, step.state)
    run.drag_work += float(resist @ increment)
    run.drag = resist if step.drag is None else step.drag
