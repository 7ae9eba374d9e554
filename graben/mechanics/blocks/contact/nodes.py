"""Contact nodes, each a blend of two vertices, with the edge that starts there: motion, and forces handed back."""

from __future__ import annotations

import numpy as np

from graben.mechanics.cache_lines import ask_for
from graben.mechanics.compiled import kernel

# Nodes between the one in work and the one whose row is asked for.
_AHEAD = 6

# Columns of the node table: position, velocity, and of the edge that starts there unit tangent, length and rim
# (0 but for chamfers). One cache line a node, since the contact kernel reads nodes in no order.
X, Y, VX, VY, TX, TY, LENGTH, RIM, COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7, 8


@kernel(error_model="numpy")
def node_motion(x, v, first, second, weight, follow, node, begin, end):
    """Fill rows begin to end of the node table (nodes, 8) from positions x and velocities v (vertices, 2); RIM stays.

    Rows begin and end with a block.
    """
    last = node.shape[0] - 1
    for i in range(begin, end):
        ask_for(node, min(i + _AHEAD, last))
        a = first[i]
        b = second[i]
        w = weight[i]
        node[i, X] = x[a, 0] + w * (x[b, 0] - x[a, 0])
        node[i, Y] = x[a, 1] + w * (x[b, 1] - x[a, 1])
        node[i, VX] = v[a, 0] + w * (v[b, 0] - v[a, 0])
        node[i, VY] = v[a, 1] + w * (v[b, 1] - v[a, 1])
    for i in range(begin, end):
        j = follow[i]
        dx = node[j, X] - node[i, X]
        dy = node[j, Y] - node[i, Y]
        length = np.sqrt(dx * dx + dy * dy)
        inverse = 1.0 / length
        node[i, TX] = dx * inverse
        node[i, TY] = dy * inverse
        node[i, LENGTH] = length


@kernel(error_model="numpy")
def scatter_nodes(fn, first, second, weight, force, begin, end):
    """Hand the forces on contact nodes, rows begin to end, back to the vertices that they blend."""
    for i in range(begin, end):
        a = first[i]
        b = second[i]
        w = weight[i]
        for d in range(2):
            force[a, d] += (1.0 - w) * fn[i, d]
            force[b, d] += w * fn[i, d]
