"""The model of a fem scene: a body with its supports, and its loads as nodal forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.fem.body import Body, Material, make_body
from graben.mechanics.fem.collapse import RisingPressure
from graben.mechanics.fem.loads import body_force, edge_traction
from graben.mechanics.meshes.mesh2d import QuadMesh
from graben.schemas.scenes.fem import FemScene


@dataclass(frozen=True)
class Problem:
    """A scene in arrays.

    Attributes
    ----------
    steady, rising : (2 n,) nodal loads: applied with gravity, and per second after it
    pressure : the first rising load
    notes : what of a mesh file was left out or mended
    """

    body: Body
    support_nodes: list[np.ndarray]
    steady: np.ndarray
    rising: np.ndarray
    pressure: RisingPressure
    notes: tuple[str, ...] = ()

    def external(self, time: float) -> np.ndarray:
        """Nodal loads (2 n,), N/m, at a load time after gravity, s."""
        return self.steady + time * self.rising


def problem_of(scene: FemScene, mesh: QuadMesh, law: Material) -> Problem:
    """Supports and loads of a scene on a mesh, whichever the scene asks for; BadInput names every fault."""
    file = str(scene.source.path)
    faults: list[Fault] = []
    fixed = np.zeros((len(mesh.points), 2), dtype=bool)
    outline = np.unique(mesh.boundary_edges())
    support_nodes = []
    for k, support in enumerate(scene.supports):
        start, end = np.array(support.start), np.array(support.end)
        nodes = mesh.nodes_on_segment(start, end)
        nodes = nodes[np.isin(nodes, outline)]
        if len(nodes) < (2 if np.any(start != end) else 1):
            expected = "a segment that holds nodes of the outline, two at least where it has a length"
            faults.append(Fault(file, f"supports.{k}", support.name, expected + _sizes(scene, mesh)))
        fixed[nodes, 0] |= support.fix in ("x", "both")
        fixed[nodes, 1] |= support.fix in ("y", "both")
        support_nodes.append(nodes)
    if not faults and not _holds_still(mesh, fixed):
        faults.append(Fault(file, "supports", "", "supports that leave the body no rigid motion"))
    weight = np.array([scene.gravity.horizontal, scene.gravity.vertical])
    steady = body_force(mesh, scene.gravity.density, weight)
    rising = np.zeros_like(steady)
    unit, length, rate, offset = np.zeros_like(steady), 1.0, 0.0, 0.0
    for k, load in enumerate(scene.loads):
        try:
            force, covered = edge_traction(mesh, np.array(load.start), np.array(load.end))
        except Refused as error:
            expected = f"a segment of the outline ({error})" + _sizes(scene, mesh)
            faults.append(Fault(file, f"loads.{k}", load.name, expected))
            continue
        steady += load.pressure * force
        rising += load.rate * force
        if load.rate != 0 and rate == 0:
            unit, length, rate, offset = force, covered, load.rate, load.pressure
    if faults:
        raise BadInput(faults)
    try:
        body = make_body(mesh, [law], fixed.ravel(), least_length=scene.softening_width)
    except Refused as error:
        raise BadInput(Fault(file, "supports", "", f"supports that leave something free ({error})")) from None
    pressure = RisingPressure(unit / length, length, offset, rate)
    return Problem(body, support_nodes, steady, rising, pressure)


def _sizes(scene: FemScene, mesh: QuadMesh) -> str:
    """A hint for a mesh file whose size is far from that of the scene's segments: units slip."""
    segments = [(s.start, s.end) for s in scene.supports] + [(load.start, load.end) for load in scene.loads]
    ends = np.array(segments, dtype=float).reshape(-1, 2)
    spans = np.ptp(mesh.points, axis=0), np.ptp(ends, axis=0)
    ratio = spans[0].max() / spans[1].max() if spans[1].max() > 0 else 1.0
    if scene.mesh.method != "file" or 0.1 < ratio < 10.0:
        return ""
    mine, others = (f"{a[0]:g} m x {a[1]:g} m" for a in spans)
    return f"; the mesh spans {mine}, loads and supports {others}: coordinates of the file are taken as metres"


def _holds_still(mesh: QuadMesh, fixed: np.ndarray) -> bool:
    """Whether the supports stop both translations and the rotation."""
    x, y = (mesh.points - mesh.points.mean(axis=0)).T
    rigid = np.zeros((len(x), 2, 3))
    rigid[:, 0, 0], rigid[:, 1, 1] = 1.0, 1.0
    rigid[:, 0, 2], rigid[:, 1, 2] = -y / mesh.diameter(), x / mesh.diameter()
    return int(np.linalg.matrix_rank(rigid[fixed], tol=1e-6)) == 3 if fixed.any() else False
