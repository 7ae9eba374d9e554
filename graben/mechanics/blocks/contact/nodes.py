"""Contact nodes, each a blend of two vertices, with the edge that starts there: motion, and forces handed back."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.unsigned import span

# Columns of the node table: position, velocity, and of the edge that starts there unit tangent, length and rim
# (0 but for chamfers). One cache line a node, since the contact kernel reads nodes in no order.
X, Y, VX, VY, TX, TY, LENGTH, RIM, COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7, 8


@kernel(error_model="numpy")
def node_motion(x, v, first, second, weight, follow, node, begin, end):
    """Fill rows begin to end of the node table (nodes, 8) from positions x and velocities v (vertices, 2); RIM stays.

    All is read before anything is written, so that x and y go side by side. The node at the end of an edge is worked
    out anew for that: to read its row would mean to wait for its writing.
    """
    for i in span(begin, end):
        j = follow[i]
        a, b, w = first[i], second[i], weight[i]
        c, d, u = first[j], second[j], weight[j]
        ax, ay, bx, by = x[a, 0], x[a, 1], x[b, 0], x[b, 1]
        cx, cy, dx, dy = x[c, 0], x[c, 1], x[d, 0], x[d, 1]
        va, ua, vb, ub = v[a, 0], v[a, 1], v[b, 0], v[b, 1]
        px = ax + w * (bx - ax)
        py = ay + w * (by - ay)
        ex = cx + u * (dx - cx) - px
        ey = cy + u * (dy - cy) - py
        length = np.sqrt(ex * ex + ey * ey)
        inverse = 1.0 / length
        node[i, X] = px
        node[i, Y] = py
        node[i, VX] = va + w * (vb - va)
        node[i, VY] = ua + w * (ub - ua)
        node[i, TX] = ex * inverse
        node[i, TY] = ey * inverse
        node[i, LENGTH] = length


@kernel(error_model="numpy")
def scatter_nodes(fn, first, second, weight, force, begin, end):
    """Hand the forces on contact nodes, rows begin to end, back to the vertices that they blend."""
    for i in span(begin, end):
        a, b, w = first[i], second[i], weight[i]
        fx, fy = fn[i, 0], fn[i, 1]
        force[a, 0] += (1.0 - w) * fx
        force[a, 1] += (1.0 - w) * fy
        force[b, 0] += w * fx
        force[b, 1] += w * fy
