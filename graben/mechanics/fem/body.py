"""A meshed plane-strain body with its materials and supports, and the state that it is in."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from graben.errors import Refused
from graben.mechanics.elements import quad4
from graben.mechanics.elements.plane_strain import PlaneElements, plane_elements
from graben.mechanics.fem.assembly import assemble
from graben.mechanics.fem.pattern import Block, Pattern, block_of, pattern_of
from graben.mechanics.meshes.mesh2d import QuadMesh

_NO_VALUES = np.zeros(0)


@dataclass(frozen=True)
class Material:
    """A law of `materials.laws` with its packed parameters and the internal state of an untouched point."""

    law_id: int
    parameters: np.ndarray
    initial_state: np.ndarray


@dataclass(frozen=True)
class State:
    """Equilibrium state: displacement (2 n,) m, stress (e, 4, 4) Pa, internal variables (e, 4, s)."""

    displacement: np.ndarray
    stress: np.ndarray
    internal: np.ndarray


@dataclass(frozen=True)
class Response:
    """Result of one pass over the elements from a converged state.

    `failed_point` is -1, or 4 * element + point of the Gauss point whose law found no admissible stress (then
    the other fields must not be used).
    """

    stress: np.ndarray
    internal: np.ndarray
    force: np.ndarray
    values: np.ndarray
    failed_point: int


@dataclass(frozen=True)
class Body:
    """Mesh, elements, materials, supports and the sparsity pattern of the stiffness.

    Attributes
    ----------
    dofs : (e, 8) degrees of freedom of each element
    material_row : (e,) which of the materials fills each element
    law_ids (m,), parameters (m, k), initial_state (m, s) : the materials, padded with zeros to a common width
    fixed, free : ascending degrees of freedom (2 * node + axis) with and without prescribed displacement
    """

    mesh: QuadMesh
    elements: PlaneElements
    dofs: np.ndarray
    pattern: Pattern
    material_row: np.ndarray
    law_ids: np.ndarray
    parameters: np.ndarray
    initial_state: np.ndarray
    fixed: np.ndarray
    free: np.ndarray
    free_block: Block
    coupling_block: Block

    def untouched(self) -> State:
        """The stress-free state."""
        count = len(self.mesh.quads)
        internal = np.repeat(self.initial_state[self.material_row][:, None, :], 4, axis=1)
        return State(np.zeros(self.pattern.size), np.zeros((count, 4, 4)), np.ascontiguousarray(internal))

    def respond(self, old: State, increment: np.ndarray, stiffness: bool) -> Response:
        """Stress, internal forces and (on demand) stiffness values at `old.displacement + increment`."""
        stress, internal = np.empty_like(old.stress), np.empty_like(old.internal)
        force = np.empty(self.pattern.size)
        values = np.empty(len(self.pattern.indices)) if stiffness else _NO_VALUES
        el = self.elements
        failed = assemble(
            self.dofs,
            el.strain_matrix,
            el.weight,
            el.length,
            self.material_row,
            self.law_ids,
            self.parameters,
            increment,
            old.stress,
            old.internal,
            stress,
            internal,
            force,
            self.pattern.slot,
            values,
        )
        return Response(stress, internal, force, values, int(failed))

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """Strain (e, 4, 4) at the Gauss points, components (xx, yy, zz, xy), tensor shear strain."""
        u = displacement[self.dofs]
        in_plane = np.einsum("egic,ec->egi", self.elements.strain_matrix, u)
        strain = np.zeros((*in_plane.shape[:2], 4))
        strain[..., 0], strain[..., 1], strain[..., 3] = (
            in_plane[..., 0],
            in_plane[..., 1],
            0.5 * in_plane[..., 2],
        )
        return strain

    def internal_work(self, old: State, new: State) -> float:
        """Work of the mean stress on the strain increment between two states, J per metre of thickness."""
        strain = self.strain(new.displacement - old.displacement)
        strain[..., 3] *= 2.0
        density = 0.5 * np.einsum("egi,egi->eg", old.stress + new.stress, strain)
        return float((density * self.elements.weight).sum())


def make_body(
    mesh: QuadMesh,
    materials: list[Material],
    fixed: np.ndarray,
    material_row: np.ndarray | None = None,
    mean_dilatation: bool = True,
    least_length: float = 0.0,
) -> Body:
    """Set up a body.

    Parameters
    ----------
    mesh : the mesh
    materials : one or more
    fixed : (2 n,) bool, True where the displacement is prescribed
    material_row : (e,) index into `materials`; None: the first everywhere
    mean_dilatation : B-bar on (default) or off
    least_length : characteristic length, m, that the law gets where elements are smaller
    """
    size = 2 * len(mesh.points)
    fixed = np.asarray(fixed)
    if fixed.shape != (size,) or fixed.dtype != bool:
        raise ValueError(f"fixed must be bool of shape ({size},), found {fixed.dtype} {fixed.shape}")
    rows = np.zeros(len(mesh.quads), dtype=np.int64) if material_row is None else material_row
    rows = np.ascontiguousarray(rows, dtype=np.int64)
    if rows.shape != (len(mesh.quads),) or rows.min() < 0 or rows.max() >= len(materials):
        raise ValueError(f"material_row must name one of {len(materials)} materials for each element")
    _, derivatives = quad4.shape_functions(quad4.GAUSS)
    elements = plane_elements(mesh.points[mesh.quads], derivatives, mean_dilatation)
    elements = replace(elements, length=np.maximum(elements.length, least_length))
    dofs = np.stack([2 * mesh.quads, 2 * mesh.quads + 1], axis=-1).reshape(-1, 8)
    dofs = np.ascontiguousarray(dofs, dtype=np.int64)
    pattern = pattern_of(dofs, size)
    fixed_dofs, free_dofs = np.flatnonzero(fixed), np.flatnonzero(~fixed)
    if not len(free_dofs):
        raise Refused("every degree of freedom is prescribed")
    return Body(
        mesh=mesh,
        elements=elements,
        dofs=dofs,
        pattern=pattern,
        material_row=rows,
        law_ids=np.array([m.law_id for m in materials], dtype=np.int64),
        parameters=_padded([m.parameters for m in materials]),
        initial_state=_padded([m.initial_state for m in materials]),
        fixed=fixed_dofs,
        free=free_dofs,
        free_block=block_of(pattern, free_dofs, free_dofs),
        coupling_block=block_of(pattern, free_dofs, fixed_dofs),
    )


def _padded(rows: list[np.ndarray]) -> np.ndarray:
    """Rows of different length as one array, filled up with zeros (at least one column)."""
    table = np.zeros((len(rows), max(1, *(len(r) for r in rows))))
    for target, row in zip(table, rows):
        target[: len(row)] = row
    return table
