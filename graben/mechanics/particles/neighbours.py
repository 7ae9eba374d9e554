"""Cell list: particles sorted by cell, and the half list of pairs closer than contact plus a skin.

Each pair is stored once, in the row of the particle that comes first in cell order. Sorting the particles by cell
keeps the partners of a row close in memory.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel


@kernel
def wrap(x, width):
    """Move positions (n, 3) back into the periodic cell [0, width) along x and y, in place."""
    for i in range(x.shape[0]):
        for a in range(2):
            w = width[a]
            x[i, a] -= w * np.floor(x[i, a] / w)
            if x[i, a] >= w:  # rounding of a tiny negative coordinate
                x[i, a] = 0.0


@kernel
def cell_order(x, low, size, counts):
    """Stable counting sort by cell.

    low (3,), size (3,): corner of the grid and edge lengths of a cell; counts (3,): cells along each axis.
    Returns order (n,) int64 such that x[order] is sorted, and start (cells + 1,) int64 of each cell's range.
    """
    n = x.shape[0]
    cells = counts[0] * counts[1] * counts[2]
    of = np.empty(n, np.int64)
    start = np.zeros(cells + 1, np.int64)
    for i in range(n):
        c = np.int64(0)
        for a in range(3):
            k = np.int64((x[i, a] - low[a]) / size[a])
            k = min(max(k, 0), counts[a] - 1)  # type: ignore[arg-type]
            c = c * counts[a] + k
        of[i] = c
        start[c + 1] += 1
    for c in range(cells):  # type: ignore[assignment]
        start[c + 1] += start[c]
    fill = start[:-1].copy()
    order = np.empty(n, np.int64)
    for i in range(n):
        order[fill[of[i]]] = i
        fill[of[i]] += 1
    return order, start


@kernel
def half_list(bodies, period, start, counts, skin, first, partner):
    """Fill first (n + 1,) and partner (capacity,) int32 with the pairs closer than r_i + r_j + skin.

    bodies must be in cell order; period (2,) m of the sides or None. Returns the number of pairs; when it exceeds
    the capacity, partner is full and the caller must enlarge it and call again.
    """
    x, radius = bodies.position, bodies.radius
    nx, ny, nz = counts[0], counts[1], counts[2]
    capacity = partner.shape[0]
    found = 0
    if period is not None:
        wx, wy = period[0], period[1]
        hx, hy = 0.5 * wx, 0.5 * wy
    for cx in range(nx):
        for cy in range(ny):
            for cz in range(nz):
                c = (cx * ny + cy) * nz + cz
                for i in range(start[c], start[c + 1]):
                    first[i] = found
                    reach = radius[i] + skin
                    # own cell and the 13 cells ahead; the other 13 list the pair from their side
                    for ahead in range(14):
                        if ahead == 0:
                            dx, dy, dz = 0, 0, 0
                        elif ahead < 10:
                            dx, dy, dz = 1, (ahead - 1) // 3 - 1, (ahead - 1) % 3 - 1
                        elif ahead < 13:
                            dx, dy, dz = 0, 1, ahead - 11
                        else:
                            dx, dy, dz = 0, 0, 1
                        ex, ey, ez = cx + dx, cy + dy, cz + dz
                        if ez < 0 or ez >= nz:
                            continue
                        if period is not None:
                            ex = ex % nx
                            ey = ey % ny
                        elif ex >= nx or ey < 0 or ey >= ny:
                            continue
                        d = (ex * ny + ey) * nz + ez
                        begin = i + 1 if ahead == 0 else start[d]
                        for j in range(begin, start[d + 1]):
                            gx, gy, gz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
                            if period is not None:
                                if gx > hx:
                                    gx -= wx
                                elif gx < -hx:
                                    gx += wx
                                if gy > hy:
                                    gy -= wy
                                elif gy < -hy:
                                    gy += wy
                            limit = reach + radius[j]
                            if gx * gx + gy * gy + gz * gz < limit * limit:
                                if found < capacity:
                                    partner[found] = j
                                found += 1
    first[x.shape[0]] = found
    return found


@kernel
def carry_history(old, old_place, identity, first, partner, slip):
    """Copy tangential contact forces from an old list, a record of Contacts, to a new one.

    old_place (n,): where the particle with a given identity stood in the old order; slip (pairs, 3) is the force on
    the first particle of the pair, so it changes sign when the pair is stored the other way round.
    """
    old_first, old_partner, old_slip = old.first, old.partner, old.slip
    n = first.shape[0] - 1
    for i in range(n):
        a = old_place[identity[i]]
        for k in range(first[i], first[i + 1]):
            b = old_place[identity[partner[k]]]
            slip[k, 0] = slip[k, 1] = slip[k, 2] = 0.0
            for q in range(old_first[a], old_first[a + 1]):
                if old_partner[q] == b:
                    for c in range(3):
                        slip[k, c] = old_slip[q, c]
            for q in range(old_first[b], old_first[b + 1]):
                if old_partner[q] == a:
                    for c in range(3):
                        slip[k, c] = -old_slip[q, c]


def grid_shape(extent, cutoff):
    """Cells along each axis, (3,) int64, for a region of the given extent (3,) m; no cell shorter than cutoff."""
    return np.maximum(np.floor(np.asarray(extent) / cutoff), 1.0).astype(np.int64)
