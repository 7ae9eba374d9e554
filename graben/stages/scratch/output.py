"""What scratch measures on its groove, and how it is written: artifact and VTU series."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from graben.mechanics.scratch.frame import Snapshot
from graben.mechanics.scratch.mesh import HexMesh
from graben.mechanics.scratch.run import ENERGIES, ScratchRun
from graben.mechanics.wear.groove import Section, VolumeLedger, cut, measure, volume_ledger
from graben.schemas.files import together
from graben.schemas.layouts.scratch import LAYOUT
from graben.schemas.outputs import LAST_GOOD, beside
from graben.schemas.scenes.scratch import ScratchScene
from graben.schemas.vtk import vtu_series, write_vtu
from graben.stages.shared.last_good import write_whole
from graben.stages.shared.measures import number
from graben.stages.shared.record import Record

_STATES = ("loaded", "unloaded")
# A groove that is shallower, over the depth of the tip, is what vibration left: the specimen sprang back.
LEAST = 0.01


@dataclass(frozen=True)
class Groove:
    """Sections (state, section), their profiles (state, section, point), volumes (state), and the headline."""

    positions: np.ndarray
    s_over_a: np.ndarray
    y: np.ndarray
    z: np.ndarray
    sections: list[list[Section]]
    volumes: list[VolumeLedger]
    headline: dict[str, Any]

    def of(self, name: str) -> np.ndarray:
        """One measure of every section, (state, section)."""
        return np.array([[getattr(s, name) for s in row] for row in self.sections])


def measure_groove(scene: ScratchScene, mesh: HexMesh, result: ScratchRun) -> Groove:
    """Cut the surface across the track, under load and after lifting, and measure every section."""
    a, start, path = scene.contact_half_width, scene.tip.start, scene.tip.path
    ends = max(0.0, start - 1.6 * a), min(scene.specimen.length, start + path + 2.2 * a)
    positions = np.linspace(*ends, scene.output.sections)
    y = np.linspace(0.0, min(0.5 * scene.specimen.width, 3.0 * a), scene.output.points)
    states = (result.loaded, result.unloaded)
    z = np.array([[_profile(state, x, y) for x in positions] for state in states])
    sections = [[measure(y, profile, True) for profile in rows] for rows in z]
    volumes = [_volumes(state, result) for state in states]
    return Groove(
        positions, (positions - start) / a, y, z, sections, volumes,
        _headline(scene, result, positions, sections, volumes[1], a),
    )  # fmt: skip


def _profile(state: Snapshot, x: float, y: np.ndarray) -> np.ndarray:
    """Height of the remaining material; where nothing is left above the base, the base counts."""
    z = cut(state.points, state.faces, float(x), y)
    return np.where(np.isfinite(z), z, state.points[:, 2].min())


def _volumes(state: Snapshot, result: ScratchRun) -> VolumeLedger:
    living = state.alive == 1
    return volume_ledger(
        state.points,
        np.concatenate([state.faces, state.supports]),
        float(state.tip[0]),
        float(result.first_volumes[living].sum()),
        float(state.volumes[living].sum()),
        float(result.first_volumes[~living].sum()),
    )


def _headline(
    scene: ScratchScene,
    result: ScratchRun,
    positions: np.ndarray,
    sections: list[list[Section]],
    volumes: VolumeLedger,
    a: float,
) -> dict[str, Any]:
    start, path = scene.tip.start, scene.tip.path
    middle = start + 0.5 * path
    chosen = np.abs(positions - middle) <= max(0.1 * path, 0.51 * (positions[1] - positions[0]))
    loaded = [s for s, use in zip(sections[0], chosen, strict=True) if use]
    rest = [s for s, use in zip(sections[1], chosen, strict=True) if use]

    def mean(rows: list[Section], name: str) -> float:
        return float(np.mean([getattr(s, name) for s in rows]))

    def wear(rows: list[Section]) -> float | None:
        ag, left = mean(rows, "groove_area"), mean(rows, "depth")
        return (ag - mean(rows, "shoulder_area")) / ag if ag > 0.0 and left > LEAST * scene.tip.depth else None

    travelled = result.tip[:, 0] - start
    phases = list(result.phases)
    if path > 0.0:
        sliding = result.phase == phases.index("slide")
        steady = sliding & (travelled >= 0.5 * path) & (travelled <= 0.95 * path)
        if not steady.any():  # a path of few steps: the record nearest to where they would be
            off = np.where(sliding, np.abs(travelled - 0.7 * path), np.inf)
            steady = off == off.min()
        normal, along = -result.force[steady, 2], result.force[steady, 0]
    else:
        steady = (result.phase == 0) & (np.arange(len(result.phase)) >= np.sum(result.phase == 0) - 3)
        normal, along = -result.force[steady, 2], result.force[steady, 0]
    along_path = np.array([s.degree_of_wear for s in sections[1]])
    whole = range(1, int(path / a) + 1)
    # Between sections of which one met no groove nothing is known.
    by_path = {str(k): number(np.interp(start + k * a, positions, along_path)) for k in whole}
    return {
        "groove_area_m2": mean(rest, "groove_area"),
        "shoulder_area_m2": mean(rest, "shoulder_area"),
        "degree_of_wear": wear(rest),
        "s_over_a": 0.5 * path / a,
        "degree_of_wear_loaded": wear(loaded),
        "degree_of_wear_by_s_over_a": by_path,
        "degree_of_penetration": number(mean(rest, "degree_of_penetration")),
        "groove_width_m": mean(rest, "width"),
        "groove_depth_m": mean(rest, "depth"),
        "normal_force_n": float(normal.mean()),
        "normal_force_spread_n": float(normal.std()),
        "tangential_force_n": float(along.mean()),
        "apparent_friction": float(along.mean() / normal.mean()) if normal.mean() > 0.0 else 0.0,
        "bow_wave_share": volumes.bow / volumes.groove if volumes.groove > 0.0 else 0.0,
        "volume_closure": volumes.closure,
    }


def write_run(
    output: Path, record: Record, scene: ScratchScene, mesh: HexMesh, result: ScratchRun, groove: Groove
) -> None:
    """Write the artifact and the VTU series beside it."""
    head = groove.headline
    arrays: dict[str, Any] = {
        "groove_area": head["groove_area_m2"],
        "shoulder_area": head["shoulder_area_m2"],
        # No groove, no wear: areas of zero tell a reader.
        **{name: head[name] or 0.0 for name in ("degree_of_wear", "degree_of_wear_loaded", "degree_of_penetration")},
        "s_over_a": head["s_over_a"],
        "normal_force": head["normal_force_n"],
        "tangential_force": head["tangential_force_n"],
        "grain_radius": scene.tip.radius,
        "depth": scene.tip.depth,
        "path": scene.tip.path,
        "start": scene.tip.start,
        "contact_half_width": scene.contact_half_width,
        "friction": scene.tip.friction,
        "time": result.time,
        "phase_name": np.array(result.phases),
        "phase_index": result.phase,
        "tip_position": result.tip,
        "force": result.force,
        "contact_nodes": result.touching,
        **{f"energy_{name}": result.energy[name] for name in ENERGIES},
        "energy_error": result.error,
        "state_name": np.array(_STATES),
        "section_position": groove.positions,
        "section_s_over_a": groove.s_over_a,
        "profile_y": groove.y,
        "profile_z": groove.z,
        **{f"section_{name}": groove.of(name) for name in Section.__dataclass_fields__},
        **{
            f"volume_{name}": np.array([getattr(v, name) for v in groove.volumes])
            for name in VolumeLedger.__dataclass_fields__
        },
        "largest_plastic_strain": float(result.unloaded.plastic_strain.max()),
    }
    with together():
        with vtu_series(output, "", scene.output.fields) as series:
            for frame in result.frames:
                series.add(frame.time, *fields(mesh, frame))
        write_whole(output, LAYOUT, arrays, record)


def write_last_good(output: Path, mesh: HexMesh, frame: Snapshot) -> Path:
    """The last good state of a run that failed, as one VTU beside where the artifact would have been."""
    path = beside(output, LAST_GOOD + ".vtu")
    write_vtu(path, *fields(mesh, frame))
    return path


def fields(
    mesh: HexMesh, frame: Snapshot
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Points, cells, point data and cell data of the remaining material in its present shape."""
    living = frame.alive == 1
    stress = frame.stress[living]
    deviator = stress.copy()
    deviator[:, :3] -= stress[:, :3].mean(axis=1, keepdims=True)
    mises = np.sqrt(1.5 * ((deviator[:, :3] ** 2).sum(axis=1) + 2.0 * (deviator[:, 3:] ** 2).sum(axis=1)))
    return (
        frame.points,
        {"hexahedron": mesh.cells[living]},
        {"displacement": frame.points - mesh.points},
        {
            "stress": stress,
            "von_mises": mises,
            "plastic_strain": frame.plastic_strain[living],
            "damage": frame.damage[living],
        },
    )
