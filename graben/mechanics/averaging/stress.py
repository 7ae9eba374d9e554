"""Average stress over the area of an outline: from zones, Y (2.9), and from the forces on it; their agreement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def zone_areas(position: Floats, zone_vertex: Ints) -> Floats:
    """(..., zone) m2 of triangles, at positions (..., vertex, 2)."""
    p = position[..., zone_vertex, :]
    a, b = p[..., 1, :] - p[..., 0, :], p[..., 2, :] - p[..., 0, :]
    return 0.5 * np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def zone_average(zone_stress: Floats, zone_area: Floats, area: Floats) -> Floats:
    """Average stress Y (2.9): voids count as area and carry nothing.

    Parameters
    ----------
    zone_stress : (time, zone, 4) Pa, the zones inside the outline only
    zone_area : (zone,) or (time, zone) m2
    area : scalar or (time,) m2 inside the outline

    Returns
    -------
    (time, 4) Pa
    """
    total = np.einsum("...z,...zc->...c", np.broadcast_to(zone_area, zone_stress.shape[:-1]), zone_stress)
    return total / np.broadcast_to(np.asarray(area), total.shape[:-1])[..., None]


@dataclass(frozen=True)
class BoundaryForces:
    """External forces on the blocks inside an outline, all saved states in one list.

    state : (n,) index of the saved state
    position : (n, 2) m, where the force acts
    force : (n, 2) N/m, on the blocks inside
    block : (n,) the block inside that it acts on
    """

    state: Ints
    position: Floats
    force: Floats
    block: Ints


def forces_on(
    inside: Flags,
    contact_state: Ints,
    contact_block: Ints,
    contact_position: Floats,
    contact_force: Floats,
    vertex_block: Ints,
    vertex_position: Floats,
    vertex_force: Floats | None,
) -> BoundaryForces:
    """Forces across the outline: contacts with blocks outside, and walls or pressures on vertices inside.

    Parameters
    ----------
    inside : (block,) true for blocks inside the outline
    contact_state : (contact,) index of the saved state of each contact
    contact_block : (contact, 2); contact_force (contact, 2) N/m acts on the first, its reverse on the second
    contact_position : (contact, 2) m
    vertex_block : (vertex,)
    vertex_position, vertex_force : (time, vertex, 2) m and N/m, external forces; None: no such forces
    """
    first, second = inside[contact_block[:, 0]], inside[contact_block[:, 1]]
    across = first != second
    sign = np.where(first[across], 1.0, -1.0)[:, None]
    state = [contact_state[across]]
    position = [contact_position[across]]
    force = [sign * contact_force[across]]
    block = [np.where(first[across], contact_block[across, 0], contact_block[across, 1])]
    if vertex_force is not None:
        loaded = inside[vertex_block][None, :] & (vertex_force != 0.0).any(axis=-1)
        when, vertex = np.nonzero(loaded)
        state.append(when)
        position.append(vertex_position[when, vertex])
        force.append(vertex_force[when, vertex])
        block.append(vertex_block[vertex])
    return BoundaryForces(*(np.concatenate(part) for part in (state, position, force, block)))


def per_state(state: Ints, values: Floats, count: int) -> Floats:
    """Sums (count, ...) over the entries of each saved state, in the order given."""
    flat = values.reshape(values.shape[0], int(np.prod(values.shape[1:])))
    # bincount of nothing gives integers
    sums = [np.bincount(state, flat[:, k], minlength=count).astype(np.float64) for k in range(flat.shape[1])]
    return np.stack(sums, axis=1).reshape(count, *values.shape[1:])


def boundary_average(
    forces: BoundaryForces, count: int, area: Floats, origin: Floats
) -> tuple[Floats, Floats, Floats]:
    """Average stress from the forces on the outline: (1/A) sum of force (x) position.

    It equals the zone average over the same current area where forces balance and inertia is small.

    Parameters
    ----------
    forces : as `forces_on`
    count : number of saved states
    area : scalar or (time,) m2
    origin : (2,) m, a point near the middle: the unbalanced part of the forces then weighs least

    Returns
    -------
    stress : (time, 3) Pa, xx, yy, xy of the symmetric part
    force_imbalance : (time,) resultant over the sum of force sizes
    moment_imbalance : (time,) antisymmetric part over the size of the tensor
    """
    moment = per_state(forces.state, forces.force[:, :, None] * (forces.position - origin)[:, None, :], count)
    moment /= np.broadcast_to(np.asarray(area), (count,))[:, None, None]
    stress = np.stack([moment[:, 0, 0], moment[:, 1, 1], 0.5 * (moment[:, 0, 1] + moment[:, 1, 0])], axis=1)
    size = per_state(forces.state, np.hypot(*forces.force.T), count)
    resultant = per_state(forces.state, forces.force, count)
    scale = np.sqrt((moment**2).sum(axis=(1, 2)))
    skew = np.abs(moment[:, 0, 1] - moment[:, 1, 0])
    return stress, _ratio(np.hypot(*resultant.T), size), _ratio(skew, scale)


def balance_residual(
    outline_moment: Floats, zones: Floats, body_force: Floats, arm: Floats, overlap: Floats
) -> Floats:
    """How far stress by zones is from stress by forces, inertia accounted for: (time,) over the former's size.

    Parameters
    ----------
    outline_moment : (time, 2, 2) N, sum of force (x) position over the forces on an outline
    zones : (time, 4) N, sum of stress x area over the zones inside, at the same state
    body_force, arm : (time, vertex, 2) N/m and m, of the vertices inside, about the same origin
    overlap : (time, block, 4) N, of the blocks inside
    """
    total = outline_moment + np.einsum("tvi,tvj->tij", body_force, arm)
    missing = overlap.sum(axis=1) - zones
    total[:, 0, 0] += missing[:, 0]
    total[:, 1, 1] += missing[:, 1]
    total[:, 0, 1] += missing[:, 3]
    total[:, 1, 0] += missing[:, 3]
    size = np.sqrt(zones[:, 0] ** 2 + zones[:, 1] ** 2 + 2.0 * zones[:, 3] ** 2)
    return _ratio(np.sqrt((total**2).sum(axis=(1, 2))), size)


def _ratio(part: Floats, whole: Floats) -> Floats:
    return np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0)


@dataclass(frozen=True)
class HillMandel:
    """How far the work of the forces on an outline is from that of the averages.

    residual : (time,) (power of the forces per area - average stress : rate of average strain) over the largest
        size of the second one; saved states are as fine as the power gets
    work : (time,) the same for the work done since the first state; 0 at the first state
    """

    residual: Floats
    work: Floats


def hill_mandel(
    forces: BoundaryForces,
    time: Floats,
    motion: tuple[Floats, Floats, Floats],
    mean: Floats,
    gradient: Floats,
    stress: Floats,
    area: Floats,
) -> HillMandel:
    """The Hill-Mandel condition <stress : strain rate> = <stress> : <strain rate> on the outline.

    The left side is the power of the forces on the outline, at velocities of the blocks they act on (the
    best affine motion of each block between saved states).

    Parameters
    ----------
    forces : as `forces_on`
    time : (time,) s, rising
    motion : middle, velocity and velocity gradient of blocks, from `block_motion`
    mean : (time, 2) m/s, a velocity near that of the whole; balanced forces do no work on it
    gradient : (time, 2, 2) average velocity gradient, 1/s
    stress : (time, 2, 2) Pa, the boundary-force stress, not symmetrized
    area : scalar or (time,) m2
    """
    middle, velocity, spin = motion
    count = time.size
    t, b = forces.state, forces.block
    arm = forces.position - middle[t, b]
    # Relative to the mean motion: a translation does no work on balanced forces.
    v = velocity[t, b] - mean[t] + np.einsum("nij,nj->ni", spin[t, b], arm)
    power = per_state(t, (forces.force * v).sum(axis=1), count) / np.broadcast_to(np.asarray(area), (count,))
    macro = np.einsum("tij,tij->t", stress, gradient)
    largest = float(np.abs(macro).max()) if count else 0.0
    residual = (power - macro) / largest if largest > 0.0 else np.zeros(count)
    step = np.diff(time)
    done = np.concatenate([[0.0], np.cumsum(0.5 * step * (power - macro)[1:] + 0.5 * step * (power - macro)[:-1])])
    reach = np.concatenate([[0.0], np.cumsum(0.5 * step * (np.abs(macro[1:]) + np.abs(macro[:-1])))])
    return HillMandel(residual, _ratio(done, reach))


def block_motion(
    position: Floats, velocity: Floats, vertex_block: Ints, block_count: int
) -> tuple[Floats, Floats, Floats]:
    """Best affine motion of each block over its vertices.

    Parameters
    ----------
    position, velocity : (time, vertex, 2) m, m/s
    vertex_block : (vertex,)

    Returns
    -------
    middle : (time, block, 2) m; velocity : (time, block, 2) m/s there; gradient : (time, block, 2, 2) 1/s
    """
    count = np.maximum(np.bincount(vertex_block, minlength=block_count), 1).astype(np.float64)
    order = np.argsort(vertex_block, kind="stable")
    offset = np.searchsorted(vertex_block[order], np.arange(block_count))

    def gathered(values: Floats) -> Floats:
        return np.add.reduceat(values[:, order], np.minimum(offset, order.size - 1), axis=1)

    middle = gathered(position) / count[:, None]
    speed = gathered(velocity) / count[:, None]
    arm, slip = position - middle[:, vertex_block], velocity - speed[:, vertex_block]
    spread = gathered(arm[..., :, None] * arm[..., None, :])
    drive = gathered(slip[..., :, None] * arm[..., None, :])
    det = spread[..., 0, 0] * spread[..., 1, 1] - spread[..., 0, 1] ** 2
    inverse = np.empty_like(spread)
    inverse[..., 0, 0], inverse[..., 1, 1] = spread[..., 1, 1], spread[..., 0, 0]
    inverse[..., 0, 1] = inverse[..., 1, 0] = -spread[..., 0, 1]
    safe = np.where(det > 0.0, det, 1.0)
    gradient = drive @ (inverse / safe[..., None, None]) * (det > 0.0)[..., None, None]
    return middle, speed, gradient
