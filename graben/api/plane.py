"""Finite elements in plane strain on a mesh that lies in arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.api.materials import Material
from graben.api.scenes import scene
from graben.api.units import in_units
from graben.mechanics.meshes.mesh2d import QuadMesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlaneAnalysis:
    """A body under its loads, at saved times; displacement counts from the state under gravity.

    Attributes
    ----------
    mesh : ``points`` (n, 2) m and ``quads`` (e, 4)
    time : (t,) s of load time after gravity
    displacement : (t, n, 2) m
    stress, strain : (t, e, 4) element means of xx, yy, zz, xy, Pa, tension positive, tensor shear
    plastic_strain, damage : (t, e) element means and largest values of the states of those names
    reaction : (t, 2) N/m of all supports
    step_pressure, step_settlement : (s,) Pa of the first rising load and mean settlement of its segment, m, each step
    headline : ``failed``, ``failure_load_pa`` (None where the end was reached), ``largest_load_pa``, error measures
    warnings : what a person should know before trusting the result
    """

    mesh: QuadMesh
    time: Array
    displacement: Array
    stress: Array
    strain: Array
    plastic_strain: Array
    damage: Array
    reaction: Array
    step_pressure: Array
    step_settlement: Array
    headline: dict[str, Any] = field(repr=False)
    warnings: list[str]


def plane_analysis(
    mesh: QuadMesh,
    material: Material,
    supports: Sequence[Mapping[str, Any]],
    loads: Sequence[Mapping[str, Any]],
    *,
    density: float | str = 0.0,
    gravity: tuple[float, float] = (0.0, -9.81),
    stepping: Mapping[str, Any] | None = None,
    softening_width: float | str = 0.0,
    progress: Callable[[float, str], None] | None = None,
) -> PlaneAnalysis:
    """Load a body in plane strain by gravity and then by pressures, to the end or to the load that it cannot carry.

    Parameters
    ----------
    mesh : of `graben.mesh`
    material : of `graben.material`, of one's own law too
    supports : tables of start (x, y), end (x, y), fix ("x", "y" or "both") and name, as in a scene
    loads : tables of start, end, pressure (Pa, from the start), rate (Pa/s, rising after gravity) and name
    density, gravity : kg/m3 and (x, y) m/s2
    stepping : as in a scene: goal ("failure" or "end"), end, first, largest, smallest, save_every (s), ...
    softening_width : m, least characteristic length that the law gets
    progress : called with the fraction done, 0 to 1, and a few words

    Numbers are in SI; text with a unit does as well.

    Raises
    ------
    BadInput : every fault of supports, loads and stepping
    NumericsFailed : no equilibrium under gravity, or before the end where ``goal`` is "end"
    """
    from graben.mechanics.fem.body import Material as Filling
    from graben.stages.fem_run.model import problem_of
    from graben.stages.fem_run.sizes import sizes_of
    from graben.stages.fem_run.stage import Analysis
    from graben.stages.shared.estimate import refuse_too_large
    from graben.stages.shared.record import silent

    tables = {
        "kind": "fem", "supports": list(supports), "loads": list(loads), "softening_width": softening_width,
        "gravity": {"density": density, "horizontal": gravity[0], "vertical": gravity[1]},
        "stepping": dict(stepping or {}),
    }  # fmt: skip
    model = scene({**in_units("fem", tables), "material": dict(material)})
    refuse_too_large(model.source.path, sizes_of(model, len(mesh.quads)))
    record = material.record
    filling = Filling(record.id, material.packed, record.initial_state(material.packed))
    analysis = Analysis(model, problem_of(model, mesh, filling))
    headline = dict(analysis.solve(progress or silent))
    warnings = headline.pop("warnings")
    arrays = analysis.arrays()
    names = ("time", "displacement", "stress", "strain", "plastic_strain", "damage", "reaction", "step_pressure",
             "step_settlement")  # fmt: skip
    parts = {name: np.asarray(arrays[name], dtype=np.float64) for name in names}
    return PlaneAnalysis(mesh=mesh, headline=headline, warnings=warnings, **parts)
