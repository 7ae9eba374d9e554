"""Statistics of the joints inside an outline: slip, opening, state, and the fabric of the contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.mechanics.averaging.network import Network
from graben.mechanics.averaging.stress import per_state

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Flags of a joint contact as blocks save them.
SLIP, OPEN, BROKEN = 1, 2, 3


@dataclass(frozen=True)
class JointStatistics:
    """Per saved state (time,): lengths in m, fractions of the length; weights are the contacts' lengths."""

    length: Floats
    open_fraction: Floats
    slipping_fraction: Floats
    slip_mean: Floats
    slip_rms: Floats
    slip_max: Floats
    coordination: Floats


def joint_statistics(
    inside: Flags,
    count: int,
    contact_state: Ints,
    contact_block: Ints,
    contact_length: Floats,
    contact_slip: Floats,
    contact_flag: Ints,
) -> JointStatistics:
    """Slip and state of the contacts whose two blocks both lie inside.

    Parameters
    ----------
    inside : (block,)
    count : number of saved states
    contact_state : (contact,) saved state of each contact; the others per contact: blocks (contact, 2), length m,
        slip m (signed or not), flag (0 sticks, 1 slips, 2 open, 3 broken)
    """
    within = inside[contact_block].all(axis=1)
    state, length = contact_state[within], contact_length[within]
    slip, flag = np.abs(contact_slip[within]), contact_flag[within]
    closed = flag != OPEN
    total = per_state(state, length, count)
    share = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    largest = np.zeros(count)
    np.maximum.at(largest, state, slip)
    return JointStatistics(
        length=per_state(state, length * closed, count),
        open_fraction=share * per_state(state, length * ~closed, count),
        slipping_fraction=share * per_state(state, length * ((flag == SLIP) | (flag == BROKEN)), count),
        slip_mean=share * per_state(state, length * slip, count),
        slip_rms=np.sqrt(share * per_state(state, length * slip**2, count)),
        slip_max=largest,
        coordination=2.0
        * _neighbour_pairs(state[closed], contact_block[within][closed], count)
        / max(int(inside.sum()), 1),
    )


def _neighbour_pairs(state: Ints, block: Ints, count: int) -> Floats:
    """(time,) pairs of blocks that touch, however many contacts each pair has."""
    if state.size == 0:
        return np.zeros(count)
    low, high = block.min(axis=1), block.max(axis=1)
    size = np.int64(block.max()) + 1
    distinct = np.unique((state * size + low) * size + high)
    return np.bincount(distinct // (size * size), minlength=count).astype(np.float64)


def fabric(network: Network, inside: Flags, position: Floats) -> Floats:
    """Length-weighted fabric tensor <n n> of the joints between blocks inside, trace 1.

    Parameters
    ----------
    network : joints as found at the first state
    inside : (block,)
    position : (..., vertex, 2) m, where the joints' directions are taken

    Returns
    -------
    (..., 4) xx, yy, zz (0), xy; zeros where there is no joint
    """
    chosen = network.contact[inside[network.contact_block].all(axis=1), 0]
    start, end = network.ends(position, chosen)
    along = end - start
    length = np.hypot(along[..., 0], along[..., 1])
    total = length.sum(axis=-1)
    size = np.where(length > 0.0, length, 1.0)
    tensor = np.zeros((*along.shape[:-2], 4))
    share = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    tensor[..., 0] = share * (along[..., 1] ** 2 / size).sum(axis=-1)
    tensor[..., 1] = share * (along[..., 0] ** 2 / size).sum(axis=-1)
    tensor[..., 3] = -share * (along[..., 0] * along[..., 1] / size).sum(axis=-1)
    return tensor
