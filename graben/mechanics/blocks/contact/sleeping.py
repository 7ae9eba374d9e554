"""Which candidates are awake; the others sleep: too far apart to touch before their blocks have moved so far."""

from __future__ import annotations

from typing import Any

import numpy as np

from graben.mechanics.blocks.contact.forces import empty_rows, fill_row, forget, settle_rows
from graben.mechanics.blocks.contact.joints import FACING_NONE, OPEN, Pairs
from graben.mechanics.blocks.contact.nodes import LENGTH, RIM, TX, TY, VX, VY, X, Y
from graben.mechanics.blocks.shape.partition import Parts
from graben.mechanics.compiled import kernel

# What a candidate is: closed, facing with a gap, beside each other, turned away, asleep.
CLOSED, FACING, BESIDE, TURNED, AWAY = 0, 1, 2, 3, 4

# A bound on motion holds for moves of up to this share of the shorter edge; what is left out of second order is less
# than the slack in each bound.
_FAR, _SLACK = 0.25, 1.25


def fresh_sleep(pairs: Pairs, parts: Parts, node: np.ndarray, sets: int = 1) -> dict[str, Any]:
    """Fields of relaxation.Motion for fresh candidates: all of them are due to be looked at."""
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
        "rows": empty_rows(n, len(pairs.seat) > 0),
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


@kernel(error_model="numpy")
def safe_motion(e, f, f2, node, held):
    """What edges e and f (which ends at f2) are to each other, and how far [m] their blocks may move, taken together,
    before they can bear on each other, if joints push at a gap of `held` [m].

    With a motion d the common tangent turns by at most d / shortest, and what lies far off is carried along by that.
    """
    facing = -(node[e, TX] * node[f, TX] + node[e, TY] * node[f, TY])
    shortest = min(node[e, LENGTH], node[f, LENGTH])
    most = _FAR * shortest
    # One edge turns by at most 2 / length times the motion of its ends.
    room = (FACING_NONE - facing) * shortest / (2.0 * _SLACK)
    if facing <= -0.9:
        return TURNED, min(room, most)
    scale = 1.0 / np.sqrt(2.0 + 2.0 * facing)
    tx = (node[e, TX] - node[f, TX]) * scale
    ty = (node[e, TY] - node[f, TY]) * scale
    ox = node[e, X]
    oy = node[e, Y]
    se = node[e, LENGTH] * (node[e, TX] * tx + node[e, TY] * ty)
    he = node[e, LENGTH] * (node[e, TX] * ty - node[e, TY] * tx)
    s0 = (node[f, X] - ox) * tx + (node[f, Y] - oy) * ty
    s1 = (node[f2, X] - ox) * tx + (node[f2, Y] - oy) * ty
    h0 = (node[f, X] - ox) * ty - (node[f, Y] - oy) * tx
    h1 = (node[f2, X] - ox) * ty - (node[f2, Y] - oy) * tx
    rim = node[e, RIM] + node[f, RIM]
    # They pass each other by where the end of one has not come to the start, or the end, of the other.
    room = max(
        room,
        (rim - s0) / (_SLACK + abs(h0) / shortest),
        (rim - se + s1) / (_SLACK + abs(he - h1) / shortest),
    )
    if facing <= FACING_NONE:
        return TURNED, min(room, most)
    low = max(0.0, s1)
    high = min(se, s0)
    if high - low <= rim:
        return BESIDE, min(room, most)
    front = (h1 - h0) / (s1 - s0)
    rise = he / se
    gap0 = h0 + (low - s0) * front - low * rise
    gap1 = h0 + (high - s0) * front - high * rise
    # Sliding along each other brings slopes into play.
    slope = 3.0 * max(abs(front), abs(rise)) * (1.0 + max(gap0, gap1, 0.0) / shortest)
    room = max(room, (min(gap0, gap1) - held) / (_SLACK + slope))
    return FACING, min(room, most)


@kernel(error_model="numpy")
def follow_blocks(p, parts, node, near, m):
    """Add to the paths of the blocks of part p; note how far and how fast its nodes are."""
    owner, path, gone, reference, built = parts.owner, m.path, m.gone, m.reference, m.built
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
    m.farthest[p, 0] = farthest
    m.farthest[p, 1] = fastest


@kernel(error_model="numpy")
def look_again(p, parts, pairs, follow, node, near, dilation, m):
    """Look at those candidates of part p whose blocks moved enough; wake them or put them to sleep.

    A pair sleeps when it is too far apart along its normal or along its tangent, or turned away; what it remembers of
    shear is then wiped, as for any open contact. dilation : largest tangent; slid joints push before they overlap.
    """
    owner, gone, wake, kind = parts.owner, m.gone, m.wake, m.kind
    first, second, slip, flag = pairs.first, pairs.second, pairs.slip, pairs.flag
    begin = m.start[p]
    end = m.start[p + 1]
    settle_rows(m.rows, m.turn[p, 0], m.turn[p, -1], pairs)
    changed = False
    for c in range(begin, end):
        moved = gone[owner[first[c]]] + gone[owner[second[c]]]
        if moved < wake[c]:
            continue
        held = dilation * max(abs(slip[c, 0]), abs(slip[c, 1]))
        if pairs.seat.shape[0] > 0:
            held += max(pairs.seat[c, 0], pairs.seat[c, 1])
        now, room = safe_motion(first[c], second[c], follow[second[c]], node, held)
        if now == FACING and (flag[c, 0] < OPEN or flag[c, 1] < OPEN):
            now = CLOSED
        if room >= near:
            wake[c] = moved + room - 0.5 * near
            if kind[c] != AWAY or pairs.live[c] == 1:
                forget(pairs.shear, flag, pairs.intact, c)
                pairs.live[c] = 0
            now = AWAY
        else:
            wake[c] = moved + near
        if kind[c] != now:
            kind[c] = now
            changed = True
    if changed:
        line_up(p, pairs, follow, m)


@kernel(error_model="numpy")
def line_up(p, pairs, follow, m):
    """Rows of the awake pairs of part p, by set of joints and by what they are: so branches are taken in runs."""
    kind, of_set, turn, far_of = m.kind, pairs.joint, m.turn, m.far_of
    begin = m.start[p]
    end = m.start[p + 1]
    sets = turn.shape[1] - 1
    fill = begin
    for s in range(sets):
        turn[p, s] = fill
        for k in range(AWAY):
            for c in range(begin, end):
                if kind[c] == k and (sets == 1 or of_set[c] == s):
                    fill_row(m.rows, fill, pairs, c, follow, far_of[c])
                    fill += 1
    turn[p, sets] = fill
