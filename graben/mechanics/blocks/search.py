"""Which edges of different blocks may touch: inflated edge boxes in cells, histories carried by a sorted key."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.joints import FACING_NONE, LENGTH, OPEN, RIM, TX, TY, VX, VY, Pairs, X, Y, forget
from graben.mechanics.blocks.parts import Parts
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
            live[k] = old.live[m]
            whole[k] = old.intact[m]
    return Pairs(keys, first, second, shear, slip, flag, live, whole, joint)


def no_pairs() -> Pairs:
    """An empty set of candidates."""
    i, mark, f = np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int8), np.empty((0, 2))
    flag = np.empty((0, 2), dtype=np.int8)
    return Pairs(
        np.empty(0, dtype=np.int64), i, i.copy(), f, f.copy(), flag, mark, mark.copy(), np.empty(0, dtype=np.int16)
    )


def fresh_watch(pairs: Pairs, parts: Parts, node: np.ndarray, sets: int = 1) -> dict[str, np.ndarray]:
    """The watch (fields of relaxation.Motion) over fresh candidates: all of them are due to be looked at."""
    n, count = len(pairs.key), len(parts.node) - 1
    start = np.searchsorted(pairs.first, parts.node).astype(np.int64)
    home = np.repeat(np.arange(count), np.diff(start))
    other = np.searchsorted(parts.node, pairs.second, side="right") - 1
    across = np.flatnonzero(home != other)
    far_of = np.full(n, -1, dtype=np.int32)
    far_of[across] = np.arange(len(across))
    order = np.argsort(other[across], kind="stable")
    post = np.column_stack([order, pairs.second[across][order]]).astype(np.int64)
    blocks = int(parts.block[-1])
    return {
        "start": start,
        "active": np.zeros(n, dtype=np.int64),
        "turn": np.zeros((count, sets + 1), dtype=np.int64),
        "kind": np.full(n, AWAY, dtype=np.int8),
        "wake": np.full(n, -1.0),
        "far_start": np.searchsorted(across, start).astype(np.int64),
        "far_of": far_of,
        "far": np.zeros((len(across), 4)),
        "post_start": np.searchsorted(other[across][order], np.arange(count + 1)).astype(np.int64),
        "post": post,
        "path": np.zeros(blocks),
        "gone": np.zeros(blocks),
        "reference": node[:, :2].copy(),
        "built": node[:, :2].copy(),
        "farthest": np.zeros((count, 2)),
        "due": np.zeros(1, dtype=np.int64),
    }


# What a candidate is: closed, facing with a gap, beside each other, turned away, asleep.
CLOSED, FACING, BESIDE, TURNED, AWAY = 0, 1, 2, 3, 4


@kernel(error_model="numpy")
def _look(pairs, c, follow, node, dilation):
    """What candidate c is now, and how far [m] its blocks may move, taken together, before it can touch."""
    e = pairs.first[c]
    f = pairs.second[c]
    facing = -(node[e, TX] * node[f, TX] + node[e, TY] * node[f, TY])
    shortest = min(node[e, LENGTH], node[f, LENGTH])
    # One edge turns by at most 2 / length times the motion of its ends.
    room = 0.5 * (FACING_NONE - facing) * shortest
    if facing <= -0.9:
        return TURNED, room
    scale = 1.0 / np.sqrt(2.0 + 2.0 * facing)
    tx = (node[e, TX] - node[f, TX]) * scale
    ty = (node[e, TY] - node[f, TY]) * scale
    ox = node[e, X]
    oy = node[e, Y]
    f2 = follow[f]
    se = node[e, LENGTH] * (node[e, TX] * tx + node[e, TY] * ty)
    rise = node[e, LENGTH] * (node[e, TX] * ty - node[e, TY] * tx)
    s0 = (node[f, X] - ox) * tx + (node[f, Y] - oy) * ty
    s1 = (node[f2, X] - ox) * tx + (node[f2, Y] - oy) * ty
    h0 = (node[f, X] - ox) * ty - (node[f, Y] - oy) * tx
    h1 = (node[f2, X] - ox) * ty - (node[f2, Y] - oy) * tx
    length = min(se, s0) - max(0.0, s1) - node[e, RIM] - node[f, RIM]
    held = dilation * max(abs(pairs.slip[c, 0]), abs(pairs.slip[c, 1]))
    # A turn of the tangent shifts ends by at most their distance times the turn.
    far = 2.0 * (1.0 + (abs(h0) + abs(h1)) / shortest)
    room = max(room, -length / far, (min(h0, h1) - max(0.0, rise) - held) / far)
    if facing <= FACING_NONE:
        return TURNED, room
    if length <= 0.0:
        return BESIDE, room
    if pairs.flag[c, 0] >= OPEN and pairs.flag[c, 1] >= OPEN:
        return FACING, room
    return CLOSED, room


@kernel(error_model="numpy")
def follow_blocks(p, parts, node, near, watch):
    """Add to the paths of the blocks of part p; note how far and how fast its nodes are."""
    owner, path, gone, reference, built = parts.owner, watch.path, watch.gone, watch.reference, watch.built
    farthest = 0.0
    fastest = 0.0
    i = parts.node[p]
    end = parts.node[p + 1]
    while i < end:
        b = owner[i]
        first = i
        far = 0.0
        while i < end and owner[i] == b:
            dx = node[i, X] - built[i, 0]
            dy = node[i, Y] - built[i, 1]
            d = dx * dx + dy * dy
            # Written so that a nan counts as far.
            if not d <= farthest:
                farthest = d
            dx = node[i, X] - reference[i, 0]
            dy = node[i, Y] - reference[i, 1]
            far = max(far, dx * dx + dy * dy)
            fastest = max(fastest, node[i, VX] * node[i, VX] + node[i, VY] * node[i, VY])
            i += 1
        far = np.sqrt(far)
        if far > near:
            path[b] += far
            far = 0.0
            for j in range(first, i):
                reference[j, 0] = node[j, X]
                reference[j, 1] = node[j, Y]
        gone[b] = path[b] + far
    watch.farthest[p, 0] = farthest
    watch.farthest[p, 1] = fastest


@kernel(error_model="numpy")
def look_again(p, parts, pairs, follow, node, near, dilation, watch):
    """Look at those candidates of part p whose blocks moved enough; wake them or put them to sleep.

    A pair sleeps when it is too far apart along its normal or along its tangent, or turned away; what it remembers of
    shear is then wiped, as for any open contact. dilation : largest tangent; slid joints push before they overlap.
    Awake pairs come sorted by what they were, so that branches of the contact kernel are taken in runs.
    """
    owner, gone, wake, kind = parts.owner, watch.gone, watch.wake, watch.kind
    first, second = pairs.first, pairs.second
    begin = watch.start[p]
    end = watch.start[p + 1]
    changed = False
    for c in range(begin, end):
        moved = gone[owner[first[c]]] + gone[owner[second[c]]]
        if moved < wake[c]:
            continue
        now, room = _look(pairs, c, follow, node, dilation)
        if room >= near:
            wake[c] = moved + room - 0.5 * near
            if kind[c] != AWAY or pairs.live[c] == 1:
                forget(pairs.shear, pairs.flag, pairs.intact, c)
                pairs.live[c] = 0
            now = AWAY
        else:
            wake[c] = moved + near
        if kind[c] != now:
            kind[c] = now
            changed = True
    if not changed:
        return
    active, of_set, turn = watch.active, pairs.joint, watch.turn
    sets = turn.shape[1] - 1
    fill = begin
    for s in range(sets):
        turn[p, s] = fill
        for k in range(AWAY):
            for c in range(begin, end):
                if kind[c] == k and (sets == 1 or of_set[c] == s):
                    active[fill] = c
                    fill += 1
    turn[p, sets] = fill
