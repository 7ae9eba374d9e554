"""The way of the tip: its phases one after another, what is recorded of them, and where the run stands."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from graben.errors import NumericsFailed, Refused
from graben.mechanics.scratch.body import Body
from graben.mechanics.scratch.frame import Snapshot, arrays_of_snapshot, snapshot_of
from graben.mechanics.scratch.motion import Phase
from graben.mechanics.scratch.one_point import (
    ADDED_MASS,
    DAMPING,
    EXTERNAL,
    HOURGLASS_WORK,
    INTERNAL,
    KINETIC,
    NORMAL_STORED,
    TANGENT_STORED,
    TANGENTIAL,
    VISCOUS,
)
from graben.mechanics.stored import Arrays, like, listed, named, part_of

ENERGIES = (
    "external", "internal", "kinetic", "friction", "contact", "hourglass", "viscous", "damping", "added_mass"
)  # fmt: skip
_WIDTH = 10 + len(ENERGIES)  # of a row of history


# Overlap of tip and surface, over the depth, past which a run says nothing of the specimen.
_DEEPEST = 0.5


class ScratchFailed(NumericsFailed):
    """A run that cannot go on, with the last good state that was kept."""

    def __init__(self, failure: NumericsFailed, last_good: Snapshot) -> None:
        super().__init__(failure.what, where=failure.where, step=failure.step, advice=failure.advice)
        self.last_good = last_good


class Way:
    """A run under way, from one refresh of the time step to the next.

    Attributes
    ----------
    rows : of history, one a refresh; kept : snapshots, `loaded` among them at the end
    index : of the phase; the last one is rest
    """

    def __init__(self, body: Body, phases: list[Phase], frames: int) -> None:
        self.body, self.phases = body, phases
        self.ends = np.cumsum([p.duration for p in phases])
        self.rows: list[tuple[float, ...]] = []
        self.kept: list[Snapshot] = []
        self.index, self.mark, self.reference = 0, 0, 0.0
        self.left = body.numerics.rest_steps
        slide = [i for i, p in enumerate(phases) if p.name == "slide"]
        self.marks = np.array([])
        if slide and frames > 0:
            self.marks = self.ends[slide[0]] - phases[slide[0]].duration * np.arange(frames, 0, -1) / (frames + 1.0)
        self.last_good = body.snapshot("start")

    @property
    def loaded(self) -> Snapshot:
        """The end of the last phase under load."""
        ends = [p.name for p in self.phases if p.name != "lift"]
        return next(s for s in reversed(self.kept) if s.name == ends[-1])

    def follow(
        self,
        progress: Callable[[float, str], None] | None,
        keep: Callable[[Callable[[], Arrays]], None],
    ) -> None:
        """All phases that are left, then rest."""
        while self.index < len(self.phases):
            self._phase(progress, keep)
            if self.phases[self.index].name != "lift":
                self.kept.append(self.body.snapshot(self.phases[self.index].name))
                self._refuse_soft()
            self.index += 1
        try:
            self._rest(keep)
        except NumericsFailed as failure:
            raise ScratchFailed(failure, self.loaded) from None

    def _phase(
        self,
        progress: Callable[[float, str], None] | None,
        keep: Callable[[Callable[[], Arrays]], None],
    ) -> None:
        body, phase, end, last = self.body, self.phases[self.index], float(self.ends[self.index]), self.ends[-1]
        while body.time < end - 1e-9 * last:
            try:
                body.advance(body.refresh(until=end))
                self.reference = max(self.reference, body.external)
                self.rows.append((self.index, *_record(body, self.reference, self.index == 0)))
            except NumericsFailed as failure:
                raise ScratchFailed(failure, self.last_good) from None
            if phase.name == "lift" and body.touching == 0 and not body.mean_force.any():
                break  # a plastic groove springs back by little: the tip is free long before the end
            if len(self.rows) % 20 == 0:
                self.last_good = body.snapshot("last-good")
            if self.mark < len(self.marks) and body.time >= self.marks[self.mark]:
                self.kept.append(body.snapshot(f"slide-{self.mark + 1}"))
                self.mark += 1
            keep(self.stored)
            if progress is not None:
                progress(min(1.0, body.time / (1.02 * last)), f"{phase.name} {body.time / end:.0%}")

    def _refuse_soft(self) -> None:
        """Stop where the contact is too soft to dent the specimen."""
        body, phase = self.body, self.phases[self.index].name
        overlap = overlap_of(self.kept[-1], body.sphere.radius) / body.sphere.depth
        if overlap > _DEEPEST:
            soft = NumericsFailed(
                f"the tip overlaps the surface by {100 * overlap:.3g} % of its depth at the end of {phase}",
                step=body.steps,
                advice="raise numerics.penalty: contact is too soft to dent the specimen",
            )
            raise ScratchFailed(soft, self.kept[-1])

    def _rest(self, keep: Callable[[Callable[[], Arrays]], None]) -> None:
        """Bleed the vibration after lifting by damping proportional to mass."""
        body = self.body
        body.damping = 0.02 / body.first_step
        while self.left > 0:
            steps = min(self.left, body.refresh())
            body.advance(steps)
            self.left -= steps
            self.rows.append((len(self.phases), *_record(body, self.reference, False)))
            keep(self.stored)

    def stored(self) -> Arrays:
        """The state of the run; snapshots are not copied, for nothing changes them."""
        found = {
            "place": np.array([self.index, self.mark, self.left, len(self.kept)]),
            "reference": np.array([self.reference]),
            "rows": np.array(self.rows),
        }
        for k, snapshot in enumerate(self.kept):
            found |= named(f"kept.{k}", arrays_of_snapshot(snapshot))
        return found | named("body", self.body.stored())

    def bring_back(self, stored: Arrays) -> None:
        """Take up a state of `stored`. Refused where it is none of this run."""
        place = listed(stored.get("place"), "place", 4)
        self.index, self.mark, self.left, count = map(int, place)
        limits = (len(self.phases), len(self.marks), self.body.numerics.rest_steps, 10**6)
        if not all(0 <= k <= most for k, most in zip(place, limits)):
            raise Refused(f"place: phase, mark, steps and snapshots of at most {limits}")
        [self.reference] = listed(stored.get("reference"), "reference", 1)
        rows = like(np.zeros((0, _WIDTH)), stored.get("rows"), "rows", rows=True)
        self.rows = [tuple(row) for row in rows.tolist()]
        self.body.bring_back(part_of(stored, "body"))
        if not self.rows or ((rows[:, 0] < 0) | (rows[:, 0] > len(self.phases))).any():
            raise Refused("rows: one at least, of phases that there are")
        own = self.body.snapshot("like")
        self.kept = [snapshot_of(part_of(stored, f"kept.{k}"), own) for k in range(count)]
        ends = [p.name for p in self.phases[: self.index] if p.name != "lift"]
        marked = [f"slide-{k + 1}" for k in range(self.mark)]
        if sorted(s.name for s in self.kept) != sorted([*ends, *marked]):
            raise Refused("kept: snapshots of the phases that have ended")
        self.last_good = self.body.snapshot("last-good")


def overlap_of(state: Snapshot, radius: float) -> float:
    """How far the sphere reaches into the surface [m]: a penalty bears by overlap."""
    surface = state.points[np.unique(state.faces)]
    return radius - float(np.linalg.norm(surface - state.tip, axis=1).min())


def _record(body: Body, reference: float, early: bool) -> list[float]:
    """One row of history after a refresh interval; stops the run where its errors pass their limits."""
    numerics, damaged, e = body.numerics, body.removal is not None, 2.0 * body.ledger
    friction = e[TANGENTIAL] - e[TANGENT_STORED]
    contact = e[NORMAL_STORED] + e[TANGENT_STORED]
    used = e[INTERNAL] + e[KINETIC] + friction + contact + e[HOURGLASS_WORK] + e[VISCOUS] + e[DAMPING]
    lack = e[EXTERNAL] + e[ADDED_MASS] - used
    error = abs(lack) / (2.0 * reference) if reference > 0.0 else 0.0
    # in the first touch the work itself is nearly nothing
    if error > numerics.energy_limit and not (early and body.progress_of_depth() < 0.3):
        raise NumericsFailed(
            f"energy error {100 * error:.1f} % of the external work (limit {100 * numerics.energy_limit:g} %)",
            where=f"tip x = {1e6 * body.tip[0]:.2f} um",
            step=body.steps,
            advice="lower numerics.safety or the speeds, or use a finer mesh under the path",
        )
    low, high = body.volume_range
    if not damaged and max(1.0 - low, high - 1.0) > numerics.volume_limit:
        raise NumericsFailed(
            f"det F reached {low:.3f} to {high:.3f} (limit 1 +- {numerics.volume_limit:g})",
            where=f"tip x = {1e6 * body.tip[0]:.2f} um",
            step=body.steps,
            advice="the mesh under the tip is too coarse or the loading too fast",
        )
    if body.added_share > numerics.mass_cap:
        raise NumericsFailed(
            f"mass scaling added {100 * body.added_share:.1f} % of the mass (limit {100 * numerics.mass_cap:g} %)",
            step=body.steps,
            advice="lower numerics.floor, or raise numerics.mass_cap if the inertia may grow",
        )
    energies = [
        e[EXTERNAL], e[INTERNAL], e[KINETIC], friction, contact, e[HOURGLASS_WORK], e[VISCOUS], e[DAMPING],
        e[ADDED_MASS],
    ]  # fmt: skip
    force = 2.0 * body.mean_force
    force[1] = 0.0  # the other half pushes back
    return [body.time, *body.tip, *force, float(body.touching), *energies, error]
