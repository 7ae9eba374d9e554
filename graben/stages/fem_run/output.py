"""What fem-run keeps of its states, and how it is written: artifact and VTU series."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import Refused
from graben.mechanics.fem.body import Body, State
from graben.mechanics.fem.collapse import LoadCurve
from graben.mechanics.fem.march import March
from graben.mechanics.fem.stored import arrays_of_state, state_of
from graben.mechanics.fem.surface import free_surface
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.mechanics.stored import Arrays, like, listed, named, part_of
from graben.schemas.artifact import write_artifact
from graben.schemas.files import together
from graben.schemas.layouts.fem import LAYOUT
from graben.schemas.scenes.fem import FemScene, Stepping
from graben.schemas.vtk import vtu_series
from graben.stages.shared.fields import kept
from graben.stages.shared.record import Record

SPARE = {name: name for name in ("stress", "strain", "plastic_strain", "damage")}
"""Variables of the artifact that nobody needs but who asks for the field."""

Saved = tuple[float, State, np.ndarray]
"""Load time, s, a state, and its internal forces (2 n,), N/m."""


class SavedStates:
    """The states that the artifact holds: under gravity, at the scene's times, and the last."""

    def __init__(self, stepping: Stepping, settled: March) -> None:
        self._every, self._end = stepping.save_every, stepping.end
        self._latest: Saved = (0.0, settled.state, settled.force)
        self._saved = [self._latest]

    def add(self, run: March) -> None:
        """Take in an accepted step; its state is kept if it falls on a time to save."""
        self._latest = (run.time, run.state, run.force)
        whole = round(run.time / self._every)
        if abs(run.time - whole * self._every) < 1e-9 * self._end:
            self._saved.append(self._latest)

    def stored(self) -> Arrays:
        """All but the last one as arrays, without copies."""
        found = {"time": np.array([t for t, _, _ in self._saved])}
        for k, (_, state, force) in enumerate(self._saved):
            found |= named(str(k), {**arrays_of_state(state), "force": force})
        return found

    def bring_back(self, stored: Arrays, body: Body, run: March) -> None:
        """Take up states of `stored`; run: the march that stands on the last one. Refused where they are none."""
        nothing = np.zeros(body.pattern.size)
        self._saved = []
        for k, time in enumerate(listed(stored.get("time"), "saved.time")):
            own = part_of(stored, str(k))
            self._saved.append((time, state_of(own, body), like(nothing, own.get("force"), f"saved.{k}.force")))
        if not self._saved:
            raise Refused("saved.time: one state at least")
        self._latest = (run.time, run.state, run.force)

    def states(self) -> list[Saved]:
        """Saved states with the last one."""
        return self._saved if self._saved[-1][0] == self._latest[0] else [*self._saved, self._latest]


def arrays_of(
    scene: FemScene,
    body: Body,
    settled: March,
    saved: SavedStates,
    curve: LoadCurve,
    support_nodes: list[np.ndarray],
    external: Callable[[float], np.ndarray],
) -> dict[str, Any]:
    """Arrays of the layout "fem"; fields are element means (damage: the largest)."""
    states = saved.states()
    mesh, gravity = body.mesh, settled.state.displacement.reshape(-1, 2)
    weight = body.elements.weight / body.elements.weight.sum(axis=1, keepdims=True)
    times = np.array([t for t, _, _ in states])
    total = np.stack([s.displacement.reshape(-1, 2) for _, s, _ in states])
    movement = total - gravity
    stress = np.stack([np.einsum("eg,egc->ec", weight, s.stress) for _, s, _ in states])
    strain = np.stack([np.einsum("eg,egc->ec", weight, body.strain(s.displacement)) for _, s, _ in states])
    plastic = np.stack([np.einsum("eg,eg->e", weight, s.internal[..., 0]) for _, s, _ in states])
    damaged = body.initial_state.shape[1] > 1
    damage = np.stack([s.internal[..., 1].max(axis=1) if damaged else 0.0 * plastic[0] for _, s, _ in states])
    surface, distance = free_surface(mesh, support_nodes)
    fixed = np.zeros(body.pattern.size, dtype=bool)
    fixed[body.fixed] = True
    axis_fixed = fixed.reshape(-1, 2)
    reaction = np.stack(
        [np.where(axis_fixed, (f - external(t)).reshape(-1, 2), 0.0).sum(axis=0) for t, _, f in states]
    )
    return {
        "mesh": 0,
        "node_x": mesh.points[:, 0],
        "node_y": mesh.points[:, 1],
        "face_node": mesh.quads,
        "time": times,
        "displacement": movement,
        "gravity_displacement": gravity,
        "stress": stress,
        "strain": strain,
        "plastic_strain": plastic,
        "damage": damage,
        "pressure": np.array([[p.pressure + p.rate * t for p in scene.loads] for t in times]),
        "load_name": np.array([p.name for p in scene.loads], dtype=str),
        "reaction": reaction,
        "surface_node": surface,
        "surface_distance": distance,
        "surface_displacement": movement[:, surface],
        "step_time": curve.time,
        "step_pressure": curve.pressure,
        "step_carried_pressure": curve.carried,
        "step_settlement": curve.settlement,
        "step_iterations": curve.iterations,
    }


def write_run(
    path: Path,
    record: Record,
    mesh: QuadMesh,
    arrays: dict[str, Any],
    headline: dict[str, Any],
    partial: str = "",
    asked: Sequence[str] | None = None,
) -> None:
    """Write the artifact and, beside it, the VTU series; asked : names of fields, None: all."""
    failure = headline["failure_load_pa"]
    attributes = {
        "failed": int(headline["failed"]),
        "failure_load_pa": -1.0 if failure is None else failure,
        "compliance_ratio": headline["compliance_ratio"],
        "stiffness_ratio": headline["stiffness_ratio"],
    }
    with together():
        with vtu_series(path, "", asked) as series:
            for k, time in enumerate(arrays["time"]):
                stress, strain = arrays["stress"][k], arrays["strain"][k]
                fields = {
                    "stress": _six(stress),
                    "strain": _six(strain),
                    "mean_stress": stress[:, :3].mean(axis=1),
                    "von_mises_stress": von_mises(stress),
                    "plastic_strain": arrays["plastic_strain"][k],
                    "damage": arrays["damage"][k],
                }
                points = {
                    "displacement": arrays["displacement"][k],
                    "gravity_displacement": arrays["gravity_displacement"],
                }
                series.add(time, mesh.points, {"quad": mesh.quads}, points, fields)
        write_artifact(path, LAYOUT, kept(asked, arrays, SPARE), record, attributes, partial=partial)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (...,) of plane-strain components (..., 4), Pa."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)


def _six(tensor: np.ndarray) -> np.ndarray:
    """Components (e, 4) as the six that VTK knows: xx, yy, zz, xy, yz, zx."""
    return np.concatenate([tensor, np.zeros((len(tensor), 2))], axis=1)
