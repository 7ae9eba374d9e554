"""One scratch test from a set-up to its history, surfaces and fields."""

from __future__ import annotations

import time as clock_module
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from graben.mechanics.scratch.body import Body, elastic_moduli
from graben.mechanics.scratch.frame import Snapshot
from graben.mechanics.scratch.mesh import Floats, HexMesh, Ints
from graben.mechanics.scratch.motion import Phase, phase_rows
from graben.mechanics.scratch.setup import Damage, Numerics, Tip
from graben.mechanics.scratch.way import ENERGIES, ScratchFailed, Way, overlap_of
from graben.mechanics.stored import Arrays

__all__ = ["ENERGIES", "ScratchFailed", "ScratchRun", "simulate"]


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
    keep: Callable[[Callable[[], Arrays]], None] = lambda take: None,
    stored: Arrays | None = None,
) -> ScratchRun:
    """Indent, slide, lift, and let the specimen come to rest.

    Parameters
    ----------
    mesh : half specimen with its free surface at z = 0
    law, par, state : law id, packed parameters and the state (m,) of a virgin point
    density : kg/m3
    frames : snapshots kept while sliding, besides those at the end of each phase
    names : slots of equivalent plastic strain and of damage in the state, -1 where the law has none
    keep : told of each state that a run can go on from bitwise, and how to take it
    stored : such a state, to go on from

    Raises
    ------
    ScratchFailed : energy or volume error beyond its limit, an inverted element, a law that gives up, or more added
        mass than allowed
    Refused : stored is no state of this run
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
    way = Way(body, phases, frames)
    if stored is not None:
        way.bring_back(stored)
    way.follow(progress, keep)
    unloaded = body.snapshot("rest")
    table = np.array(way.rows)
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
        "tip_overlap_share": overlap_of(way.loaded, tip.radius) / tip.depth,
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
        loaded=way.loaded,
        unloaded=unloaded,
        frames=[*way.kept, unloaded],
        first_volumes=body.first_volumes,
        cost=cost,
    )
