"""What a run of blocks leaves for ParaView: zones in NAME.pvd, contacts as lines in NAME-joints.pvd."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from graben.mechanics.blocks.shape.bodies import ear_clip
from graben.schemas.vtk import vtu_series

# Of zones that can yield; in the files without "zone_".
YIELD = ("zone_plastic_strain", "zone_state")

SPARE = {
    "velocity": "velocity",
    "zone_plastic_strain": "plastic_strain",
    "zone_state": "state",
    "contact_opening": "opening",
    "contact_normal_stress": "normal_stress",
    "contact_shear_stress": "shear_stress",
}
"""Variables of the artifact that no later stage needs, and the field that each of them is."""


def write_vtk(output: Path, arrays: dict[str, np.ndarray], fields: Sequence[str] | None = None) -> None:
    """Zones in NAME.pvd, contacts as lines in NAME-joints.pvd, one VTU a state each; fields : None for all."""
    reference = arrays["vertex_position"]
    rigid = "block_stress" in arrays
    triangles, owner = _triangles(arrays) if rigid else (arrays["zone_vertex"], arrays["zone_block"])
    end = np.concatenate([[0], np.cumsum(arrays["contact_count"])])
    with vtu_series(output, "", fields) as zones, vtu_series(output, "-joints", fields) as joints:
        for k, time in enumerate(arrays["time"]):
            removed = arrays["block_removed"][k] > 0 if "block_removed" in arrays else np.zeros(0, dtype=bool)
            there = ~removed[owner] if len(removed) else slice(None)
            stress = arrays["zone_stress"][k]
            if rigid:
                # Forces in the plane say nothing about zz: 0 in the file.
                stress = np.insert(arrays["block_stress"][k], 2, 0.0, axis=1)[owner]
            stress = stress[there]
            tensor = np.zeros((len(stress), 6))
            tensor[:, [0, 1, 2, 3]] = stress
            centre = 0.5 * (stress[:, 0] + stress[:, 1])
            radius = np.hypot(0.5 * (stress[:, 0] - stress[:, 1]), stress[:, 3])
            zones.add(
                time,
                reference + arrays["displacement"][k],
                {"triangle": triangles[there]},
                {
                    "displacement": arrays["displacement"][k],
                    "velocity": arrays["velocity"][k],
                    "boundary_force": arrays["boundary_force"][k],
                },
                {
                    "stress": tensor,
                    "stress_major_compressive": centre - radius,
                    "stress_minor_compressive": centre + radius,
                    "block": owner[there],
                    **{name[5:]: arrays[name][k][there] for name in YIELD if name in arrays},
                },
            )
            part = slice(end[k], end[k + 1])
            n = int(end[k + 1] - end[k])
            half = 0.5 * arrays["contact_length"][part, None] * arrays["contact_tangent"][part]
            middle = arrays["contact_position"][part]
            sets = {"set": arrays["contact_set"][part].astype(np.int32)} if "contact_set" in arrays else {}
            joints.add(
                time,
                np.vstack([middle - half, middle + half]),
                {"line": np.column_stack([np.arange(n), np.arange(n) + n])},
                None,
                {
                    "state": arrays["contact_state"][part].astype(np.int32),
                    "slip": arrays["contact_slip"][part],
                    "opening": arrays["contact_opening"][part],
                    "normal_stress": arrays["contact_normal_stress"][part],
                    "shear_stress": arrays["contact_shear_stress"][part],
                    "force": arrays["contact_force"][part],
                    **sets,
                },
            )


def _triangles(arrays: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3) that fill blocks without zones, and the block of each (n,)."""
    ends = np.cumsum(arrays["block_corner_count"])[:-1]
    rings = np.split(arrays["block_corner"], ends)
    cut = [ring[ear_clip(arrays["vertex_position"][ring])] for ring in rings]
    return np.vstack(cut), np.repeat(np.arange(len(rings)), [len(t) for t in cut])
