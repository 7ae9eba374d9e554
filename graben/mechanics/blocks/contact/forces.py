"""Forces of the awake pairs of edges, from rows that hold all that a pair remembers.

Rows go in batches: `_collect` copies what they need into columns, `lanes.press_batch` works out all lanes of these,
and `_hand_out` takes the results to rows and nodes, in the order of the rows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.contact import lanes
from graben.mechanics.blocks.contact.joints import BROKEN, OPEN, SLIP, STICK
from graben.mechanics.blocks.contact.nodes import LENGTH, RIM, TX, TY, VX, VY, X, Y
from graben.mechanics.cache_lines import ask_for
from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span

# Rows between the one in work and the one whose data are asked for.
_AHEAD = 16

# Columns of Rows.edge and of Rows.mark.
E, F, E_END, F_END, PAIR, FAR, EDGE_COLUMNS = 0, 1, 2, 3, 4, 5, 8
LIVE, INTACT, MARK_COLUMNS = 2, 3, 4


class Rows(NamedTuple):
    """Awake pairs in the order of work, so that memory is read in order; their memory lives here while stepping.

    edge : (n, 8) uint32, the two edges, the nodes where they end, the pair, and the row of Motion.far if it has one
    hold : (n, 4) shear stress at both ends [Pa], slip at both ends [m]; mark : (n, 4) int8, state of both ends,
    whether live, whether intact at the start; seat : (n, 2) as of Pairs, or (0, 2)
    """

    edge: np.ndarray
    hold: np.ndarray
    mark: np.ndarray
    seat: np.ndarray


def empty_rows(n: int, seated: bool = False) -> Rows:
    """Rows for up to n pairs, with seats or without."""
    return Rows(
        np.zeros((n, EDGE_COLUMNS), dtype=np.uint32),
        np.zeros((n, 4)),
        np.zeros((n, MARK_COLUMNS), dtype=np.int8),
        np.zeros((n if seated else 0, 2)),
    )


@kernel(error_model="numpy")
def fill_row(rows, r, pairs, c, follow, far_row):
    """Row r becomes pair c."""
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    e = pairs.first[c]
    f = pairs.second[c]
    edge[r, E] = e
    edge[r, F] = f
    edge[r, E_END] = follow[e]
    edge[r, F_END] = follow[f]
    edge[r, PAIR] = c
    edge[r, FAR] = far_row
    for k in range(2):
        hold[r, k] = pairs.shear[c, k]
        hold[r, 2 + k] = pairs.slip[c, k]
        mark[r, k] = pairs.flag[c, k]
        if rows.seat.shape[0] > 0:
            rows.seat[r, k] = pairs.seat[c, k]
    mark[r, LIVE] = pairs.live[c]
    mark[r, INTACT] = pairs.intact[c]


@kernel(error_model="numpy")
def settle_rows(rows, begin, end, pairs):
    """What rows begin to end remember goes back to their pairs."""
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    shear, slip, flag, live = pairs.shear, pairs.slip, pairs.flag, pairs.live
    for r in span(begin, end):
        c = edge[r, PAIR]
        for k in range(2):
            shear[c, k] = hold[r, k]
            slip[c, k] = hold[r, 2 + k]
            flag[c, k] = mark[r, k]
        live[c] = mark[r, LIVE]


@kernel(error_model="numpy")
def forget(shear, flag, intact, c):
    """An open contact remembers no stress; what slid stays, and so does the mark of a broken joint."""
    for k in range(2):
        shear[c, k] = 0.0
        if flag[c, k] != BROKEN:
            if intact[c] == 1 and flag[c, k] != OPEN:
                flag[c, k] = BROKEN
            else:
                flag[c, k] = OPEN


@kernel(error_model="numpy")
def _collect(w, rows, begin, stop, node):
    """Copy what rows begin to stop and their nodes hold into the lanes of the work space."""
    edge, hold, mark, seat = rows.edge, rows.hold, rows.mark, rows.seat
    seated = seat.shape[0] > 0
    last = np.uint64(max(edge.shape[0], 1) - 1)
    j = np.uint64(0)
    for m in span(begin, stop):
        # Edges face each other in no order of memory: ask early for what is due some rows later.
        r = min(m + np.uint64(_AHEAD), last)
        ask_for(node, edge[r, E])
        ask_for(node, edge[r, F])
        ask_for(node, edge[r, F_END])
        e, f, d, g = edge[m, E], edge[m, F], edge[m, E_END], edge[m, F_END]
        w[j + np.uint64(lanes.EX)] = node[e, X]
        w[j + np.uint64(lanes.EY)] = node[e, Y]
        w[j + np.uint64(lanes.EVX)] = node[e, VX]
        w[j + np.uint64(lanes.EVY)] = node[e, VY]
        w[j + np.uint64(lanes.ETX)] = node[e, TX]
        w[j + np.uint64(lanes.ETY)] = node[e, TY]
        w[j + np.uint64(lanes.EL)] = node[e, LENGTH]
        w[j + np.uint64(lanes.RIM)] = node[e, RIM] + node[f, RIM]
        w[j + np.uint64(lanes.FX)] = node[f, X]
        w[j + np.uint64(lanes.FY)] = node[f, Y]
        w[j + np.uint64(lanes.FVX)] = node[f, VX]
        w[j + np.uint64(lanes.FVY)] = node[f, VY]
        w[j + np.uint64(lanes.FTX)] = node[f, TX]
        w[j + np.uint64(lanes.FTY)] = node[f, TY]
        w[j + np.uint64(lanes.GX)] = node[g, X]
        w[j + np.uint64(lanes.GY)] = node[g, Y]
        w[j + np.uint64(lanes.GVX)] = node[g, VX]
        w[j + np.uint64(lanes.GVY)] = node[g, VY]
        w[j + np.uint64(lanes.DVX)] = node[d, VX]
        w[j + np.uint64(lanes.DVY)] = node[d, VY]
        w[j + np.uint64(lanes.TAU0)] = hold[m, 0]
        w[j + np.uint64(lanes.TAU1)] = hold[m, 1]
        w[j + np.uint64(lanes.SLIP0)] = hold[m, 2]
        w[j + np.uint64(lanes.SLIP1)] = hold[m, 3]
        intact = mark[m, INTACT] == 1
        w[j + np.uint64(lanes.WHOLE0)] = 1.0 if intact and mark[m, 0] != BROKEN else 0.0
        w[j + np.uint64(lanes.WHOLE1)] = 1.0 if intact and mark[m, 1] != BROKEN else 0.0
        w[j + np.uint64(lanes.PLAIN)] = 1.0 if not seated and not intact else 0.0
        if seated:
            w[j + np.uint64(lanes.SEAT0)] = seat[m, 0]
            w[j + np.uint64(lanes.SEAT1)] = seat[m, 1]
        j += np.uint64(1)


@kernel(error_model="numpy", forceinline=True)
def _mark(mark, end, whole, brittle):
    """New mark of an end from its old one; brittle : whole joints that open are broken for good."""
    if mark == BROKEN or end == BROKEN:
        return BROKEN
    if end == OPEN:
        return BROKEN if whole and brittle else OPEN
    return STICK if end == STICK else SLIP


@kernel(error_model="numpy")
def _hand_out(w, rows, begin, stop, brittle, deepest, fn, node_end, far):
    """Take the results of a batch to rows begin to stop, nodes and the sums over batches.

    brittle : whole joints that open are broken for good. Returns the pair that overlaps too much, or -1.
    """
    edge, hold, mark = rows.edge, rows.hold, rows.mark
    whole_at_start = mark[:, INTACT]
    lost, largest = w[lanes.LOST], w[lanes.DEEPEST]
    j = -1
    for m in span(begin, stop):
        j += 1
        fate = w[lanes.FATE + j]
        if fate == lanes.AWAY:
            if mark[m, LIVE] == 1:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 0
            continue
        if fate == lanes.APART:
            if mark[m, LIVE] == 0 or mark[m, 0] != OPEN or mark[m, 1] != OPEN:
                forget(hold, mark, whole_at_start, m)
                mark[m, LIVE] = 1
            continue
        if w[lanes.OVERLAP + j] > deepest:
            if mark[m, LIVE] == 1:
                w[lanes.LOST], w[lanes.DEEPEST] = lost, w[lanes.OVERLAP + j]
                return edge[m, PAIR]
            continue
        hold[m, 0] = w[lanes.TAU0 + j]
        hold[m, 1] = w[lanes.TAU1 + j]
        hold[m, 2] = w[lanes.SLIP0 + j]
        hold[m, 3] = w[lanes.SLIP1 + j]
        mark[m, 0] = _mark(mark[m, 0], w[lanes.END0 + j], w[lanes.WHOLE0 + j] != 0.0, brittle)
        mark[m, 1] = _mark(mark[m, 1], w[lanes.END1 + j], w[lanes.WHOLE1 + j] != 0.0, brittle)
        mark[m, LIVE] = 1
        lost += w[lanes.WORK + j]
        largest = max(largest, -w[lanes.GAP0 + j], -w[lanes.GAP1 + j])
        e, f, d, g = edge[m, E], edge[m, F], edge[m, E_END], edge[m, F_END]
        fn[e, 0] += w[lanes.PX + j]
        fn[e, 1] += w[lanes.PY + j]
        fn[d, 0] += w[lanes.QX + j]
        fn[d, 1] += w[lanes.QY + j]
        if f < node_end:
            fn[f, 0] += w[lanes.RX + j]
            fn[f, 1] += w[lanes.RY + j]
            fn[g, 0] += w[lanes.SX + j]
            fn[g, 1] += w[lanes.SY + j]
        else:
            row = edge[m, FAR]
            far[row, 0] = w[lanes.RX + j]
            far[row, 1] = w[lanes.RY + j]
            far[row, 2] = w[lanes.SX + j]
            far[row, 3] = w[lanes.SY + j]
    w[lanes.LOST], w[lanes.DEEPEST] = lost, largest
    return -1


@kernel(error_model="numpy")
def contact_forces(rows, begin, stop, node, table, joint, deepest, dt, fn, node_end, far, sums):
    """Stress update and forces of the awake pairs; returns the pair that overlaps too much, or -1.

    rows begin to stop : all of set `joint` of table; node : node table
    fn : (nodes, 2) forces, added to [N/m]; those on the second edge, if it lies at or beyond node_end, go to their
    row of far (rows, 4) instead
    deepest : overlap above which a touching pair stops the run, and others are no contact [m]
    sums : [friction work, largest overlap], added to; the work that dilation gives back is not friction
    """
    w = np.zeros(lanes.WORK_SPACE)
    w[lanes.DEEPEST] = sums[1]
    bad = -1
    brittle = table[joint, 4] > 0.0 or table[joint, 7] >= 0.0
    for first in range(begin, stop, lanes.LANES):
        last = min(first + lanes.LANES, stop)
        _collect(w, rows, first, last, node)
        lanes.press_batch(w, table, joint, dt)
        bad = _hand_out(w, rows, first, last, brittle, deepest, fn, node_end, far)
        if bad >= 0:
            break
    sums[0] += w[lanes.LOST]
    sums[1] = w[lanes.DEEPEST]
    return bad
