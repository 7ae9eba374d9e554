"""What fem-run keeps while it runs, and how it is written: artifact and VTU series."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.fem.body import Body, State
from graben.mechanics.fem.march import March
from graben.mechanics.fem.newton import Step
from graben.mechanics.fem.surface import free_surface
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.schemas.artifact import write_artifact
from graben.schemas.files import together
from graben.schemas.layouts.fem import LAYOUT
from graben.schemas.scenes.fem import FemScene
from graben.schemas.vtk import vtu_series
from graben.stages.shared.record import Record


class History:
    """Saved states and the load history.

    Parameters
    ----------
    scene : gives the times to save at
    settled : the equilibrium under gravity, saved as the first state
    settling : (2 n,) weights whose product with a displacement is the mean settlement of the loaded segment, m
    length : length of that segment, m
    pressure : pressure of the first rising load at time 0, Pa
    """

    def __init__(self, scene: FemScene, settled: March, settling: np.ndarray, length: float, pressure: float) -> None:
        self._every, self._end = scene.stepping.save_every, scene.stepping.end
        self._settling, self._length, self._start = settling, length, settled.state.displacement
        self._latest: tuple[float, State, np.ndarray] = (0.0, settled.state, settled.force)
        self.saved: list[tuple[float, State, np.ndarray]] = [self._latest]
        self.previous: State | None = None
        self.time, self.pressure, self.settlement, self.iterations = [0.0], [pressure], [0.0], [0]
        self.carried = [pressure]

    def viscous(self, step: Step) -> float:
        """Pressure that viscous forces carry in a step from the latest state, Pa."""
        if step.drag is None:
            return 0.0
        increment = step.state.displacement - self._latest[1].displacement
        moved = float(self._settling @ increment)
        return float(step.drag @ increment) / (self._length * moved) if moved > 0 else 0.0

    def add(self, time: float, state: State, force: np.ndarray, step: Step, pressure: float) -> None:
        """Take in an accepted step; keep its state if it falls on a time to save.

        The pressure that the law carries is what remains of the applied one when the power of the viscous forces is
        taken off that of the pressure.
        """
        self.carried.append(pressure - self.viscous(step))
        self.previous = self._latest[1]
        self._latest = (time, state, force)
        self.time.append(time)
        self.pressure.append(pressure)
        self.settlement.append(float(self._settling @ (state.displacement - self._start)))
        self.iterations.append(step.iterations)
        whole = round(time / self._every)
        if abs(time - whole * self._every) < 1e-9 * self._end:
            self.saved.append(self._latest)

    def states(self) -> list[tuple[float, State, np.ndarray]]:
        """Saved states with the last one."""
        return self.saved if self.saved[-1][0] == self._latest[0] else [*self.saved, self._latest]

    def compliance_ratio(self) -> float:
        """Settlement per pressure of the last step over that of the first; grows without bound at a collapse."""
        movement, rise = np.diff(self.settlement), np.diff(self.pressure)
        good = np.flatnonzero(rise > 0)
        if not len(good) or movement[good[0]] == 0:
            return 1.0
        first, last = good[0], good[-1]
        return float((movement[last] / rise[last]) / (movement[first] / rise[first]))


def arrays_of(
    scene: FemScene,
    body: Body,
    settled: March,
    history: History,
    support_nodes: list[np.ndarray],
    external: Callable[[float], np.ndarray],
) -> dict[str, Any]:
    """Arrays of the layout "fem"; fields are element means (damage: the largest)."""
    states = history.states()
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
        "step_time": history.time,
        "step_pressure": history.pressure,
        "step_carried_pressure": history.carried,
        "step_settlement": history.settlement,
        "step_iterations": history.iterations,
    }


def write_run(
    path: Path,
    record: Record,
    mesh: QuadMesh,
    arrays: dict[str, Any],
    headline: dict[str, Any],
    partial: str = "",
) -> None:
    """Write the artifact and, beside it, the VTU series."""
    failure = headline["failure_load_pa"]
    attributes = {
        "failed": int(headline["failed"]),
        "failure_load_pa": -1.0 if failure is None else failure,
        "compliance_ratio": headline["compliance_ratio"],
        "stiffness_ratio": headline["stiffness_ratio"],
    }
    with together():
        with vtu_series(path) as series:
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
        write_artifact(path, LAYOUT, arrays, record, attributes, partial=partial)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (...,) of plane-strain components (..., 4), Pa."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * xy**2)


def _six(tensor: np.ndarray) -> np.ndarray:
    """Components (e, 4) as the six that VTK knows: xx, yy, zz, xy, yz, zx."""
    return np.concatenate([tensor, np.zeros((len(tensor), 2))], axis=1)
