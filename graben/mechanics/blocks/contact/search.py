"""Which edges of different blocks may touch: inflated edge boxes in cells, histories carried by a sorted key."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.joints import FACING_NONE, OPEN, STICK, Pairs
from graben.mechanics.blocks.contact.nodes import LENGTH, TX, TY, X, Y
from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def find_keys(node, follow, block, reach, deepest, low, cell, nx, ny, old_key, old_live):
    """Sorted keys of the edge pairs whose boxes, each grown by reach / 2, meet.

    Left out: pairs of one block, pairs turned away from each other by more than reach can undo, and pairs that lie
    behind each other (as seen through a thin block) unless they touch already.
    low, cell, nx, ny : the search cells; positions beyond them count as in the border cells.
    """
    n = follow.shape[0]
    box = np.empty((n, 4))
    cells = np.empty((n, 4), dtype=np.int64)
    half = 0.5 * reach
    start = np.zeros(nx * ny + 1, dtype=np.int64)
    for e in range(n):
        f = follow[e]
        for d in range(2):
            box[e, d] = min(node[e, d], node[f, d]) - half
            box[e, 2 + d] = max(node[e, d], node[f, d]) + half
        cells[e, 0] = min(max(int((box[e, 0] - low[0]) / cell), 0), nx - 1)
        cells[e, 1] = min(max(int((box[e, 1] - low[1]) / cell), 0), ny - 1)
        cells[e, 2] = min(max(int((box[e, 2] - low[0]) / cell), 0), nx - 1)
        cells[e, 3] = min(max(int((box[e, 3] - low[1]) / cell), 0), ny - 1)
        for iy in range(cells[e, 1], cells[e, 3] + 1):
            for ix in range(cells[e, 0], cells[e, 2] + 1):
                start[iy * nx + ix + 1] += 1
    for k in range(nx * ny):
        start[k + 1] += start[k]
    entry = np.empty(start[nx * ny], dtype=np.int64)
    fill = start[:-1].copy()
    for e in range(n):
        for iy in range(cells[e, 1], cells[e, 3] + 1):
            for ix in range(cells[e, 0], cells[e, 2] + 1):
                entry[fill[iy * nx + ix]] = e
                fill[iy * nx + ix] += 1
    keys = np.empty(4 * n + 16, dtype=np.int64)
    count = 0
    for iy in range(ny):
        for ix in range(nx):
            k = iy * nx + ix
            for a in range(start[k], start[k + 1]):
                e = entry[a]
                for b in range(a + 1, start[k + 1]):
                    f = entry[b]
                    if block[e] == block[f]:
                        continue
                    # A pair that shares several cells counts in the first of them only.
                    if max(cells[e, 0], cells[f, 0]) != ix or max(cells[e, 1], cells[f, 1]) != iy:
                        continue
                    if (
                        box[e, 0] > box[f, 2]
                        or box[f, 0] > box[e, 2]
                        or box[e, 1] > box[f, 3]
                        or box[f, 1] > box[e, 3]
                    ):
                        continue
                    key = min(e, f) * n + max(e, f)
                    facing = -(node[e, TX] * node[f, TX] + node[e, TY] * node[f, TY])
                    slack = 2.0 * reach / min(node[e, LENGTH], node[f, LENGTH])
                    if facing < FACING_NONE - slack:
                        continue
                    if _middle_gap(node, follow, e, f) < -deepest - reach:
                        m = np.searchsorted(old_key, key)
                        if m >= old_key.shape[0] or old_key[m] != key or old_live[m] == 0:
                            continue
                    if count == keys.shape[0]:
                        larger = np.empty(2 * count, dtype=np.int64)
                        larger[:count] = keys
                        keys = larger
                    keys[count] = key
                    count += 1
    return np.sort(keys[:count])


@kernel(error_model="numpy")
def _middle_gap(node, follow, e, f):
    """Largest distance of either edge's ends in front of the other edge [m]; negative when behind."""
    gap = -1e300
    for turn in range(2):
        p = e if turn == 0 else f
        q = f if turn == 0 else e
        p2 = follow[p]
        q2 = follow[q]
        dx = node[p2, X] - node[p, X]
        dy = node[p2, Y] - node[p, Y]
        inverse = 1.0 / np.sqrt(dx * dx + dy * dy)
        g0 = ((node[q, X] - node[p, X]) * dy - (node[q, Y] - node[p, Y]) * dx) * inverse
        g1 = ((node[q2, X] - node[p, X]) * dy - (node[q2, Y] - node[p, Y]) * dx) * inverse
        gap = max(gap, g0, g1)
    return gap


@kernel(error_model="numpy")
def carry_history(keys, nodes, old, edge_material, set_of):
    """Candidate arrays for `keys`, with the history of those that were candidates before.

    edge_material : (edges,), set_of : (materials, materials) set of joints between two materials.
    """
    n = keys.shape[0]
    first = np.empty(n, dtype=np.int32)
    second = np.empty(n, dtype=np.int32)
    shear = np.zeros((n, 2))
    slip = np.zeros((n, 2))
    flag = np.full((n, 2), OPEN, dtype=np.int8)
    live = np.zeros(n, dtype=np.int8)
    whole = np.zeros(n, dtype=np.int8)
    joint = np.zeros(n, dtype=np.int16)
    seated = old.seat.shape[0] > 0
    seat = np.zeros((n if seated else 0, 2))
    m = 0
    for k in range(n):
        first[k] = keys[k] // nodes
        second[k] = keys[k] % nodes
        joint[k] = set_of[edge_material[first[k]], edge_material[second[k]]]
        while m < old.key.shape[0] and old.key[m] < keys[k]:
            m += 1
        if m < old.key.shape[0] and old.key[m] == keys[k]:
            for d in range(2):
                shear[k, d] = old.shear[m, d]
                slip[k, d] = old.slip[m, d]
                flag[k, d] = old.flag[m, d]
                if seated:
                    seat[k, d] = old.seat[m, d]
            live[k] = old.live[m]
            whole[k] = old.intact[m]
    return Pairs(keys, first, second, shear, slip, flag, live, whole, joint, seat)


def bond_touching(pairs: Pairs, node: np.ndarray, follow: np.ndarray, within: float) -> None:
    """Mark as intact the pairs that face each other without a gap, to `within` [m]."""
    p = pairs
    facing = -(node[p.first, TX] * node[p.second, TX] + node[p.first, TY] * node[p.second, TY])
    normal = np.column_stack([node[p.first, TY], -node[p.first, TX]])
    far = np.zeros(len(p.key))
    for end in (p.second, follow[p.second]):
        gap = ((node[end, :2] - node[p.first, :2]) * normal).sum(axis=1)
        far = np.maximum(far, np.abs(gap))
    whole = (facing > 0.9999) & (far < within)
    p.intact[whole] = 1
    p.flag[whole] = STICK


def no_pairs() -> Pairs:
    """An empty set of candidates."""
    i, mark, f = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int8), np.empty((0, 2))
    flag = np.empty((0, 2), dtype=np.int8)
    return Pairs(
        np.empty(0, dtype=np.int64), i, i.copy(), f, f.copy(), flag, mark, mark.copy(), np.empty(0, dtype=np.int16)
    )
