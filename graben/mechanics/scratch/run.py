"""One scratch test from a set-up to its history, surfaces and fields."""

from __future__ import annotations

import time as clock_module
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from graben.errors import NumericsFailed
from graben.mechanics.scratch.body import Body, elastic_moduli
from graben.mechanics.scratch.frame import Snapshot
from graben.mechanics.scratch.mesh import Floats, HexMesh, Ints
from graben.mechanics.scratch.motion import Phase, phase_rows
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
from graben.mechanics.scratch.setup import Damage, Numerics, Tip

ENERGIES = (
    "external", "internal", "kinetic", "friction", "contact", "hourglass", "viscous", "damping", "added_mass"
)  # fmt: skip


@dataclass
class ScratchRun:
    """Result. Forces and energies are those of the whole specimen, twice the half model's.

    phase (t,) index into `phases`; tip (t, 3) m, centre of the sphere; force (t, 3) N on the specimen; contact
    (t,) m2 projected from nodes in contact; energy[name] (t,) J; error (t,) share of the external work.
    """

    phases: tuple[str, ...]
    time: Floats
    phase: Ints
    tip: Floats
    force: Floats
    touching: Ints
    energy: dict[str, Floats]
    error: Floats
    loaded: Snapshot
    unloaded: Snapshot
    frames: list[Snapshot]
    first_volumes: Floats
    cost: dict[str, float] = field(default_factory=dict)


# Overlap of tip and surface, over the depth, past which a run says nothing of the specimen.
_DEEPEST = 0.5


class ScratchFailed(NumericsFailed):
    """A run that cannot go on, with the last good state that was kept."""

    def __init__(self, failure: NumericsFailed, last_good: Snapshot) -> None:
        super().__init__(failure.what, where=failure.where, step=failure.step, advice=failure.advice)
        self.last_good = last_good


def simulate(
    mesh: HexMesh,
    law: int,
    par: Floats,
    state: Floats,
    density: float,
    tip: Tip,
    numerics: Numerics,
    damage: Damage | None = None,
    frames: int = 0,
    progress: Callable[[float, str], None] | None = None,
    names: tuple[int, int] = (0, -1),
) -> ScratchRun:
    """Indent, slide, lift, and let the specimen come to rest.

    Parameters
    ----------
    mesh : half specimen with its free surface at z = 0
    law, par, state : law id, packed parameters and the state (m,) of a virgin point
    density : kg/m3
    frames : snapshots kept while sliding, besides those at the end of each phase
    names : slots of equivalent plastic strain and of damage in the state, -1 where the law has none

    Raises
    ------
    ScratchFailed : energy or volume error beyond its limit, an inverted element, a law that gives up, or more added
        mass than allowed
    """
    began = clock_module.perf_counter()
    bulk, shear = elastic_moduli(par)
    wave = float(np.sqrt((bulk + 4.0 / 3.0 * shear) / density))
    phases = [
        Phase("indent", tip.depth, numerics.indent_speed * wave, (0.0, 0.0, -1.0)),
        Phase("lift", 1.1 * tip.depth, numerics.lift_speed * wave, (0.0, 0.0, 1.0)),
    ]
    if tip.path > 0.0:
        phases.insert(1, Phase("slide", tip.path, numerics.slide_speed * wave, (1.0, 0.0, 0.0), ramp=0.1))
    body = Body(mesh, law, par.copy(), state, density, numerics, tip, phase_rows(phases), wave, damage, names)
    ends = np.cumsum([p.duration for p in phases])
    rows: list[tuple[float, ...]] = []
    kept: list[Snapshot] = []
    slide = [i for i, p in enumerate(phases) if p.name == "slide"]
    marks = np.array([])
    if slide and frames > 0:
        marks = ends[slide[0]] - phases[slide[0]].duration * np.arange(frames, 0, -1) / (frames + 1.0)
    loaded: Snapshot | None = None
    last_good = body.snapshot("start")
    reference = 0.0
    mark = 0
    for index, phase in enumerate(phases):
        while body.time < ends[index] - 1e-9 * ends[-1]:
            try:
                body.advance(body.refresh(until=float(ends[index])))
                reference = max(reference, body.external)
                rows.append((index, *_record(body, numerics, reference, damage is not None, index == 0)))
            except NumericsFailed as failure:
                raise ScratchFailed(failure, last_good) from None
            if phase.name == "lift" and body.touching == 0 and not body.mean_force.any():
                break  # a plastic groove springs back by little: the tip is free long before the end
            if len(rows) % 20 == 0:
                last_good = body.snapshot("last-good")
            if mark < len(marks) and body.time >= marks[mark]:
                kept.append(body.snapshot(f"slide-{mark + 1}"))
                mark += 1
            if progress is not None:
                progress(min(1.0, body.time / (1.02 * ends[-1])), f"{phase.name} {body.time / ends[index]:.0%}")
        if phase.name != "lift":
            kept.append(body.snapshot(phase.name))
            loaded = kept[-1]
            overlap = _overlap(loaded, tip) / tip.depth
            if overlap > _DEEPEST:
                soft = NumericsFailed(
                    f"the tip overlaps the surface by {100 * overlap:.3g} % of its depth at the end of {phase.name}",
                    step=body.steps,
                    advice="raise numerics.penalty: contact is too soft to dent the specimen",
                )
                raise ScratchFailed(soft, loaded)
    try:
        _rest(body, numerics, rows, len(phases), damage is not None, reference)
    except NumericsFailed as failure:
        raise ScratchFailed(failure, loaded or last_good) from None
    unloaded = body.snapshot("rest")
    assert loaded is not None
    table = np.array(rows)
    cost = {
        "steps": float(body.steps),
        "elements": float(len(mesh.cells)),
        "nodes": float(len(mesh.points)),
        "element_updates": float(body.updates),
        "loop_seconds": body.loop_seconds,
        "updates_per_second": body.updates / max(body.loop_seconds, 1e-9),
        "wall_seconds": clock_module.perf_counter() - began,
        "first_step_s": body.first_step,
        "smallest_step_s": body.smallest_step,
        "added_mass_share": body.added_share,
        "largest_mass_factor": body.largest_factor,
        "volume_ratio_min": body.volume_range[0],
        "volume_ratio_max": body.volume_range[1],
        "wave_speed_m_per_s": wave,
        "tip_overlap_share": _overlap(loaded, tip) / tip.depth,
        "removed_elements": float(len(mesh.cells) - body.alive.sum()),
    }
    energy = {name: table[:, 9 + i] for i, name in enumerate(ENERGIES)}
    return ScratchRun(
        phases=(*(p.name for p in phases), "rest"),
        time=table[:, 1],
        phase=table[:, 0].astype(np.int64),
        tip=table[:, 2:5],
        force=table[:, 5:8],
        touching=table[:, 8].astype(np.int64),
        energy=energy,
        error=table[:, -1],
        loaded=loaded,
        unloaded=unloaded,
        frames=[*kept, unloaded],
        first_volumes=body.first_volumes,
        cost=cost,
    )


def _overlap(state: Snapshot, tip: Tip) -> float:
    """How far the sphere reaches into the surface [m]: a penalty bears by overlap."""
    surface = state.points[np.unique(state.faces)]
    return tip.radius - float(np.linalg.norm(surface - state.tip, axis=1).min())


def _record(body: Body, numerics: Numerics, reference: float, damaged: bool, early: bool) -> list[float]:
    """One row of history after a refresh interval; stops the run where its errors pass their limits."""
    e = 2.0 * body.ledger
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


def _rest(
    body: Body, numerics: Numerics, rows: list[tuple[float, ...]], index: int, damaged: bool, reference: float
) -> None:
    """Bleed the vibration after lifting by damping proportional to mass."""
    left = numerics.rest_steps
    body.damping = 0.02 / body.first_step
    while left > 0:
        steps = min(left, body.refresh())
        body.advance(steps)
        left -= steps
        rows.append((index, *_record(body, numerics, reference, damaged, False)))
