"""The fit of a law to stress-strain curves: a compiled batch of responses and the weighted residuals.

A curve prescribes some components (strain or stress) and observes others. First the point is brought to the
curve's first stress state, deviatoric or not; strain counts from there, in the curve and in the point alike. Then
the point follows the curve. Where a candidate's
path has no solution it keeps its last state and a penalty grows with the part that is missing, so that the
objective stays finite and continuous.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.laws import find, prepare
from graben.mechanics.materials.point import drive

Array = NDArray[np.float64]


def since_first(strain: Array) -> Array:
    """Strain (steps, ...) counted from the first state: gauges are zeroed before the cell pressure, or after."""
    strain = np.asarray(strain, dtype=np.float64)
    return strain - strain[:1]


@dataclass(frozen=True)
class Curve:
    """One measured curve in the plane: stress and strain (steps, 4) = (xx, yy, zz, xy), tensor shear,
    tension positive. Strain may be given from any zero and is kept from the first state.

    control: one letter per component, "e" strain or "s" stress prescribed; fit_stress, fit_strain: the
    components compared. The default is Y's: vertical strain and horizontal stress prescribed in plane strain
    without shear, fitted on vertical stress and horizontal strain. seat: control on the way to the first
    state. Components that are neither prescribed nor compared may be nan.
    """

    name: str
    stress: Array
    strain: Array
    control: str = "seee"
    seat: str = "ssee"
    fit_stress: tuple[int, ...] = (1,)
    fit_strain: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "strain", since_first(self.strain))


@dataclass(frozen=True)
class Weights:
    """How residuals are weighted.

    normalise: "curve" divides each curve's stress by that curve's largest, "all" by the largest of all
    curves; strains likewise. last: weight of a curve's last point relative to its first, linear in between (Y
    4.2). strain: weight of the strain residuals relative to the stress residuals. penalty: for a path that
    ends early, per missing fraction.
    """

    normalise: str = "curve"
    last: float = 0.5
    strain: float = 0.05
    penalty: float = 2.0


@kernel(error_model="numpy", nogil=True)
def _batch(
    law_id, base, slots, values, start_state, length, tolerance, parts, seat_parts, seats, controls, targets, rows,
    zero, shift, stress, strain, reached, moved,
):  # fmt: skip
    """Responses of every candidate to every curve. One function: each layer of calls would compile the laws again."""
    curves, n = targets.shape[0], targets.shape[2]
    par, state = base.copy(), start_state.copy()
    sig, eps = np.empty(n), np.empty(n)
    nothing = np.empty((0, start_state.shape[0]))
    ramp = np.zeros((2, n))
    seat_stress, seat_strain = np.empty((2, n)), np.empty((2, n))
    for k in range(values.shape[0]):
        for i in range(slots.shape[0]):
            par[slots[i]] = values[k, i]
        prepare(law_id, par)
        moved[k] = 0.0
        for i in range(slots.shape[0]):
            used = par[slots[i]]
            if used != values[k, i]:
                moved[k] += abs(values[k, i] - used) / (abs(values[k, i]) + abs(used))
        for c in range(curves):
            state[:] = start_state
            sig[:] = 0.0
            eps[:] = 0.0
            for i in range(n):
                ramp[1, i] = zero[c, i] if seats[c, i] == 1 else 0.0
            ramp[1, 1] += shift[k, c]
            done = drive(
                law_id, par, length, tolerance, seat_parts, seats[c], ramp, sig, state, eps, seat_stress, seat_strain,
                nothing,
            )  # fmt: skip
            for i in range(n):
                eps[i] = targets[c, 0, i] if controls[c, i] == 0 else 0.0
            r = rows[c]
            if done < 1.0:
                # not even the first state can be reached: everything is missing
                for row in range(r):
                    for i in range(n):
                        stress[k, c, row, i] = sig[i]
                        strain[k, c, row, i] = eps[i]
                reached[k, c] = done - 1.0
                continue
            reached[k, c] = drive(
                law_id, par, length, tolerance, parts, controls[c], targets[c, :r], sig, state, eps,
                stress[k, c, :r], strain[k, c, :r], nothing,
            )  # fmt: skip


@dataclass(frozen=True)
class Predictions:
    """stress, strain (candidates, curves, steps, 4), tensor shear; reached (candidates, curves) steps, a
    fraction counts; moved (candidates,): by what fraction `CurveFit.used` differs from what was asked."""

    stress: Array
    strain: Array
    reached: Array
    moved: Array


@cache
def _threads(workers: int) -> ThreadPoolExecutor:
    """Threads that live as long as the process: a call is too short to start them anew."""
    return ThreadPoolExecutor(workers)


@dataclass
class CurveFit:
    """A law, its fixed parameters and the curves to fit; `predict` and `residuals` take batches of free
    parameters.

    Parameters
    ----------
    law : name; fixed : named values in SI of every parameter that is not free (choices and tables included)
    free : names of the free parameters, in the order of the columns of `values`
    curves : at least one; length : characteristic length in m; parts : increments per step of a curve
    workers : threads; the numbers do not depend on it

    Refused when the law refuses the parameters or a curve is not usable.
    """

    law: str
    fixed: Mapping[str, Any]
    free: Sequence[str]
    curves: Sequence[Curve]
    weights: Weights = field(default_factory=Weights)
    length: float = 10.0
    parts: int = 2
    seat_parts: int = 4
    tolerance: float = 1e-8
    workers: int = 1

    def __post_init__(self) -> None:
        record = find(self.law)
        if not self.curves:
            raise Refused("curves: expected at least one")
        stand_in = self.stand_in(self.law, self.fixed, self.free)
        self._id = record.id
        self._base = _pack_unchecked(record, stand_in)
        self._slots = np.array([record.index(name) for name in self.free], dtype=np.int64)
        self._start = record.initial_state(self._base)
        self._arrange()

    def __getstate__(self) -> dict[str, Any]:
        """Without the law's id, which may differ in another process."""
        return {name: value for name, value in self.__dict__.items() if name != "_id"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _id=find(state["law"]).id)

    @staticmethod
    def stand_in(law: str, fixed: Mapping[str, Any], free: Sequence[str]) -> dict[str, Any]:
        """Named values with a number for every free parameter; Refused when the law does not take them."""
        record, values = find(law), dict(fixed)
        for name in free:
            parameter = record.parameter(name)
            values[name] = min(max(1.0, parameter.lower), parameter.upper)
        faults = [f for f in record.faults(values) if f[0] != ""]
        if faults:
            raise Refused("; ".join(f"{name}: expected {text}" for name, text in faults))
        return values

    def _arrange(self) -> None:
        count, steps, n = len(self.curves), max(len(c.stress) for c in self.curves), 4
        self._rows = np.array([len(c.stress) for c in self.curves], dtype=np.int64)
        flags = np.zeros((2, count, n), np.int64)
        self._targets = np.zeros((count, steps, n))
        self._zero = np.zeros((count, n))
        stress_at: list[Array] = []
        goals: list[Array] = []
        weights: list[Array] = []
        groups: list[Array] = []
        everything = [
            (np.abs(c.stress[:, list(c.fit_stress)]), np.abs(c.strain[:, list(c.fit_strain)])) for c in self.curves
        ]
        top_stress = max((float(a.max()) for a, _ in everything if a.size), default=1.0)
        top_strain = max((float(b.max()) for _, b in everything if b.size), default=1.0)
        group = 0
        for i, c in enumerate(self.curves):
            r = self._rows[i]
            if c.stress.shape != (r, n) or c.strain.shape != (r, n) or r < 2:
                raise Refused(f"curve {c.name}: expected (steps >= 2, 4) stress and strain, found {c.stress.shape}")
            flags[0, i] = [letter == "s" for letter in c.seat]
            flags[1, i] = [letter == "s" for letter in c.control]
            for k in range(n):
                source = c.stress[:, k] if flags[1, i, k] else c.strain[:, k] * (1.0 if k < 3 else 2.0)
                self._targets[i, :r, k] = source
            self._zero[i] = np.where(flags[0, i] == 1, c.stress[0], 0.0)
            along = np.linspace(1.0, self.weights.last, r)
            for kind, columns, data, top in (
                (0, c.fit_stress, c.stress, top_stress),
                (1, c.fit_strain, c.strain, top_strain),
            ):
                for k in columns:
                    own = float(np.nanmax(np.abs(data[:, k]), initial=0.0)) or top
                    size = (own if self.weights.normalise == "curve" else top) or 1.0
                    part = 1.0 if kind == 0 else self.weights.strain
                    if part == 0.0:
                        continue
                    stress_at.append(np.stack([np.full(r, kind), np.full(r, i), np.arange(r), np.full(r, k)], axis=1))
                    goals.append(data[:, k])
                    # each curve counts once, whatever its number of points
                    weights.append(part * along / (size * np.sqrt(np.sum(along**2) * count)))
                    groups.append(np.full(r, group))
                    group += 1
        if not (np.isfinite(self._targets).all() and np.isfinite(self._zero).all()):
            raise Refused("curves: prescribed components must be finite")
        index = np.concatenate(stress_at).astype(np.int64)
        self._kind, self._where = index[:, 0], tuple(index[:, 1:].T)
        self._goal, self._weight = np.concatenate(goals), np.concatenate(weights)
        if not np.isfinite(self._goal).all():
            raise Refused("curves: compared components must be finite")
        self.groups = np.concatenate([*groups, group + np.arange(count)]).astype(np.int64)
        self._seats, self._controls = np.ascontiguousarray(flags[0]), np.ascontiguousarray(flags[1])

    @property
    def points(self) -> int:
        """Number of compared points of all curves."""
        return len(self._goal)

    def used(self, values: Array) -> Array:
        """What becomes of one candidate (k,): values that do not go together are moved as `Law.prepare` does, so
        that `Law.check` accepts them. Same predictions, to the bit."""
        par = self._base.copy()
        par[self._slots] = values
        prepare(self._id, par)
        return np.asarray(par[self._slots], dtype=np.float64)

    @property
    def starts_free(self) -> NDArray[np.bool_]:
        """(curves,) where the first axial stress is only where the path starts, and is compared."""
        seated = (self._seats[:, 1] == 1) & (self._controls[:, 1] == 0)
        return seated & np.array([1 in c.fit_stress for c in self.curves])

    @property
    def zeros_free(self) -> NDArray[np.bool_]:
        """(curves,) where lateral strain is compared, and so counts from a first reading."""
        return np.array([0 in c.fit_strain and self.weights.strain > 0.0 for c in self.curves])

    @property
    def floor(self) -> float:
        """Root mean square of what the driver's tolerance leaves in a residual: it holds prescribed stresses to that
        part of the largest stress, and observed quantities are no better."""
        curve, _row, column = self._where
        largest = np.array([[np.abs(d).max(axis=0) for d in (c.stress, c.strain)] for c in self.curves])
        return self.tolerance * _rms(np.nan_to_num(largest[curve, self._kind, column]) * self._weight)

    def predict(self, values: Array, shifts: Array | None = None) -> Predictions:
        """Responses of candidates `values` (c, k), parameter values in SI in the order of `free`.

        shifts (c, curves): added to the first axial stress of each curve, in Pa, where `starts_free`."""
        values = np.ascontiguousarray(np.atleast_2d(values), dtype=np.float64)
        shape = (len(values), *self._targets.shape)
        stress, strain = np.zeros(shape), np.zeros(shape)
        reached, moved = np.empty(shape[:2]), np.empty(shape[0])
        shifts = np.zeros(shape[:2]) if shifts is None else np.ascontiguousarray(shifts, dtype=np.float64)

        def run(first: int, last: int) -> None:
            _batch(
                self._id, self._base, self._slots, values[first:last], self._start, float(self.length),
                float(self.tolerance), int(self.parts), int(self.seat_parts), self._seats, self._controls,
                self._targets, self._rows, self._zero, shifts[first:last], stress[first:last], strain[first:last],
                reached[first:last], moved[first:last],
            )  # fmt: skip

        if self.workers > 1 and len(values) > 1:
            # the kernel releases the interpreter; small parts, taken in turn: one that fails costs more than others
            edges = np.linspace(0, len(values), min(4 * self.workers, len(values)) + 1).astype(int)
            parts = pairwise(edges)
            lock = Lock()

            def share() -> None:
                while True:
                    with lock:
                        part = next(parts, None)
                    if part is None:
                        return
                    run(*part)

            others = [_threads(self.workers).submit(share) for _ in range(self.workers - 1)]
            share()
            for other in others:
                other.result()
        else:
            run(0, len(values))
        strain[..., 3:] *= 0.5
        return Predictions(stress, strain, reached, moved)

    def residuals(self, values: Array, shifts: Array | None = None) -> Array:
        """Weighted residuals (c, m): one per compared point, then one per curve for the part of it without
        solution. shifts (c, 2, curves): to the first axial stress as in `predict`, and to the zero of lateral strain.

        Rows are contiguous whatever c is: numpy adds up in another order where they are not, and sums of one point
        would depend on how many others came with it."""
        found = self.predict(values, None if shifts is None else shifts[:, 0])
        curve, row, column = self._where
        model = np.where(self._kind == 0, found.stress[:, curve, row, column], found.strain[:, curve, row, column])
        if shifts is not None:
            model = model + np.where((self._kind == 1) & (column == 0), shifts[:, 1, :][:, curve], 0.0)
        # what was moved counts too: a search would not find back over values that make no difference
        missing = np.clip(1.0 - found.reached / (self._rows - 1), 0.0, 2.0) + found.moved[:, None]
        # a strain that runs away must not overflow the sum of squares
        parts = np.clip((model - self._goal) * self._weight, -1e6, 1e6)
        out = np.empty((len(parts), self.points + len(self.curves)))
        out[:, : self.points] = parts
        out[:, self.points :] = self.weights.penalty * missing / np.sqrt(len(self.curves))
        return out

    def objective(self, values: Array) -> Array:
        """Sum of squared residuals (c,)."""
        r = self.residuals(values)
        return np.sum(r * r, axis=1)

    def errors(self, values: Array) -> dict[str, Any]:
        """Plain root mean squares of one candidate (k,): all curves and each, stress in Pa and strain; and
        `complete`."""
        found = self.predict(np.asarray(values)[None])
        stress, strain = [], []
        for i, c in enumerate(self.curves):
            r = self._rows[i]
            a, b = list(c.fit_stress), list(c.fit_strain)
            stress.append(found.stress[0, i, :r][:, a] - c.stress[:, a])
            strain.append(found.strain[0, i, :r][:, b] - c.strain[:, b])
        return {
            "stress": _rms(np.concatenate([e.ravel() for e in stress])),
            "strain": _rms(np.concatenate([e.ravel() for e in strain])),
            "stress_per_curve": np.array([_rms(e) for e in stress]),
            "strain_per_curve": np.array([_rms(e) for e in strain]),
            "complete": found.reached[0] >= self._rows - 1,
        }


def _rms(e: Array) -> float:
    return float(np.sqrt(np.mean(np.square(e)))) if e.size else 0.0


def _pack_unchecked(record: Any, values: Mapping[str, Any]) -> Array:
    """Pack with stand-ins for the free parameters, which need not agree with one another."""
    from dataclasses import replace

    return replace(record, check=lambda v: []).pack(values)
