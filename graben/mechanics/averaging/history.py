"""Averages over time: one run of blocks, one REV, all its measures at every saved state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.averaging import rigid
from graben.mechanics.averaging.joints import fabric, joint_statistics
from graben.mechanics.averaging.network import Network, build_network
from graben.mechanics.averaging.outline import Outline, domain_outline, find_outline, outline_area
from graben.mechanics.averaging.rev import Rev
from graben.mechanics.averaging.strain import (
    joint_gradient,
    outline_gradient,
    rotation_of,
    strain_of,
    zone_gradient,
)
from graben.mechanics.averaging.stress import (
    balance_residual,
    block_motion,
    boundary_average,
    forces_on,
    hill_mandel,
    per_state,
    zone_areas,
    zone_average,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Contacts:
    """Joint contacts of all saved states in one list.

    state : (contact,) saved state; block : (contact, 2); position : (contact, 2) m, current;
    force : (contact, 2) N/m on the first block; length, slip : (contact,) m; flag : (contact,) 0 sticks, 1 slips,
    2 open, 3 broken; tangent : (contact, 2); moment : (contact, 2) N, first moment of the force along the tangent
    about `position`. Without the last two the force acts at `position`
    """

    state: Ints
    block: Ints
    position: Floats
    force: Floats
    length: Floats
    slip: Floats
    flag: Ints
    tangent: Floats | None = None
    moment: Floats | None = None

    def point_forces(self, chosen: NDArray[np.bool_]) -> tuple[Ints, Ints, Floats, Floats]:
        """State, blocks, position and force of some contacts (contact,), each as one force at either end."""
        state, block = self.state[chosen], self.block[chosen]
        position, force = self.position[chosen], self.force[chosen]
        if self.tangent is None or self.moment is None:
            return state, block, position, force
        length = self.length[chosen]
        # The same force and first moment at any distance apart.
        apart = np.where(length > 0.0, length, 1.0)[:, None]
        half, more = 0.5 * apart * self.tangent[chosen], self.moment[chosen] / apart
        return (
            np.tile(state, 2),
            np.tile(block, (2, 1)),
            np.concatenate([position - half, position + half]),
            np.concatenate([0.5 * force - more, 0.5 * force + more]),
        )


@dataclass(frozen=True)
class History:
    """What a run of blocks leaves for its averages.

    time : (time,) s; position : (vertex, 2) m at the first saved state; displacement : (time, vertex, 2) m since
    then; vertex_block : (vertex,); zone_vertex : (zone, 3); zone_block : (zone,); corner_count : (block,);
    corner : (sum,); zone_stress : (time, zone, 4) Pa, xx yy zz xy, tension positive; vertex_force :
    (time, vertex, 2) N/m from walls and pressures; body_force : (time, vertex, 2) N/m weight less inertia and
    damping, and overlap_moment : (time, block, 4) N, where the run kept them
    """

    time: Floats
    position: Floats
    displacement: Floats
    vertex_block: Ints
    zone_vertex: Ints
    zone_block: Ints
    corner_count: Ints
    corner: Ints
    zone_stress: Floats
    contacts: Contacts
    vertex_force: Floats
    body_force: Floats | None = None
    overlap_moment: Floats | None = None

    @cached_property
    def network(self) -> Network:
        """Joints at the first state; found once for all REVs."""
        return build_network(
            self.position, self.corner_count.size, self.zone_vertex, self.zone_block, self.corner_count, self.corner
        )

    @cached_property
    def current(self) -> Floats:
        """(time, vertex, 2) m."""
        return self.position + self.displacement

    @cached_property
    def velocity(self) -> Floats:
        """(time, vertex, 2) m/s, the mean motion between saved states, not that of an instant."""
        if self.time.size < 2:
            return np.zeros_like(self.displacement)
        return np.gradient(self.displacement, self.time, axis=0, edge_order=2 if self.time.size > 2 else 1)

    @cached_property
    def motion(self) -> tuple[Floats, Floats, Floats]:
        """Affine motion of each block between saved states, see `block_motion`."""
        return block_motion(self.current, self.velocity, self.vertex_block, self.corner_count.size)

    @cached_property
    def zoned(self) -> NDArray[np.bool_]:
        """(block,) true for blocks that have zones; the stress of the others comes from the forces on them."""
        flags = np.zeros(self.corner_count.size, dtype=bool)
        flags[self.zone_block] = True
        return flags

    @cached_property
    def domain(self) -> Floats:
        """(n, 2) m outline of the whole model at the first state."""
        return domain_outline(self.network)


@dataclass(frozen=True)
class Average:
    """Measures of one REV; (time, 4) tensors are xx, yy, zz, xy; see the layout of curves for their meaning."""

    outline: Outline
    area: float
    stress: Floats
    strain: Floats
    strain_blocks: Floats
    strain_joints: Floats
    rotation: Floats
    current_area: Floats
    solid_fraction: Floats
    stress_boundary: Floats
    force_imbalance: Floats
    moment_imbalance: Floats
    hill_mandel_residual: Floats
    hill_mandel_work: Floats
    fabric: Floats
    joint_length: Floats
    joint_open_fraction: Floats
    joint_slipping_fraction: Floats
    joint_slip_mean: Floats
    joint_slip_rms: Floats
    joint_slip_max: Floats
    coordination: Floats
    strain_closure: float
    balance_residual: Floats | None


def average(history: History, rev: Rev, deformed: bool = False, chosen_at: int = 0) -> Average:
    """All measures of one REV at every saved state.

    Parameters
    ----------
    history : the run
    rev : the region, at the positions of state `chosen_at`
    deformed : areas, and the gradient of the displacement, in the current shape of the outline; otherwise in that
        of the first state, as for small strain. Zone stress is Cauchy stress either way
    chosen_at : saved state at which blocks are said to meet the region

    Raises
    ------
    Refused : no block meets the region
    """
    network, count = history.network, history.time.size
    outline = find_outline(network, rev, history.current[chosen_at] if chosen_at else None)
    x, u = outline.follow(history.position), outline.follow(history.displacement)
    now = x + u
    area, current_area = float(outline_area(x)), outline_area(now)
    measure = current_area if deformed else np.full(count, area)
    gradient = outline_gradient(now if deformed else x, u)
    within = outline.blocks[history.zone_block]
    inner_zones = history.zone_vertex[within]
    first_areas = zone_areas(history.position, inner_zones)
    current_areas = zone_areas(history.current, inner_zones)
    stress = zone_average(history.zone_stress[:, within], current_areas if deformed else first_areas, measure)

    solid = current_areas.sum(axis=1)
    c = history.contacts
    bare = outline.blocks & ~history.zoned
    if bare.any():
        moment = rigid.force_moment(
            bare, history.motion[0], *c.point_forces(np.any(bare[c.block], axis=1)),
            history.vertex_block, history.current, history.vertex_force,
        ) / np.broadcast_to(measure, (count,))[:, None, None]  # fmt: skip
        stress[:, 0] += moment[:, 0, 0]
        stress[:, 1] += moment[:, 1, 1]
        stress[:, 3] += 0.5 * (moment[:, 0, 1] + moment[:, 1, 0])
        stress[:, 2] = np.nan  # forces in the plane say nothing about it
        solid = solid + rigid.outline_areas(network, history.current, bare)

    # The parts of the strain are those of the first state: there the network's joints are shut.
    shift = history.displacement - u[:, :1]
    in_blocks = zone_gradient(history.position, shift, history.zone_vertex, within) / area
    if bare.any():
        in_blocks = in_blocks + rigid.outline_gradients(network, history.position, shift, bare) / area
    in_joints = joint_gradient(network, outline, shift) / area
    whole = outline_gradient(x, u)
    closure = float(np.abs(whole - in_blocks - in_joints).max())

    forces = forces_on(
        outline.blocks,
        *c.point_forces(outline.blocks[c.block[:, 0]] != outline.blocks[c.block[:, 1]]),
        history.vertex_block,
        history.current,
        history.vertex_force,
    )
    origin = x.mean(axis=0)
    own = outline.blocks[history.vertex_block]
    symmetric, resultant, skew = boundary_average(forces, count, measure, origin)
    stress_boundary = np.stack([symmetric[:, 0], symmetric[:, 1], stress[:, 2], symmetric[:, 2]], axis=1)
    moment = per_state(forces.state, forces.force[:, :, None] * (forces.position - origin)[:, None, :], count)
    balance = None
    if history.body_force is not None and history.overlap_moment is not None and not bare.any():
        balance = balance_residual(
            moment,
            zone_average(history.zone_stress[:, within], current_areas, np.ones(count)),
            history.body_force[:, own],
            history.current[:, own] - origin,
            history.overlap_moment[:, outline.blocks],
        )
    work = hill_mandel(
        forces,
        history.time,
        history.motion,
        history.motion[1][:, outline.blocks].mean(axis=1),
        outline_gradient(now, outline.follow(history.velocity)),
        moment / current_area[:, None, None],
        current_area,
    )
    joints = joint_statistics(outline.blocks, count, c.state, c.block, c.length, c.slip, c.flag)
    return Average(
        outline=outline,
        area=area,
        stress=stress,
        strain=strain_of(gradient),
        strain_blocks=strain_of(in_blocks),
        strain_joints=strain_of(in_joints),
        rotation=rotation_of(gradient),
        current_area=current_area,
        solid_fraction=solid / current_area,
        stress_boundary=stress_boundary,
        force_imbalance=resultant,
        moment_imbalance=skew,
        hill_mandel_residual=work.residual,
        hill_mandel_work=work.work,
        fabric=fabric(network, outline.blocks, history.current),
        joint_length=joints.length,
        joint_open_fraction=joints.open_fraction,
        joint_slipping_fraction=joints.slipping_fraction,
        joint_slip_mean=joints.slip_mean,
        joint_slip_rms=joints.slip_rms,
        joint_slip_max=joints.slip_max,
        coordination=joints.coordination,
        strain_closure=closure,
        balance_residual=balance,
    )
