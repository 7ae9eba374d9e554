"""Parts of a model: runs of neighbouring blocks that one thread works on, and that fit its cache.

Parts depend on the blocks alone, never on the number of threads, and each part adds up its own forces in its own
order: so results are the same, bit for bit, whatever the number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from graben.mechanics.blocks.shape.bodies import Bodies, Skin

# Blocks in a part: few enough for a core's cache, and enough that few contacts cross from part to part.
PART_BLOCKS = 256


class Parts(NamedTuple):
    """Where each part begins in the arrays of nodes, vertices, zones and blocks in order of storage: (parts + 1,).

    owner : (nodes,) block of each node, counted in order of storage
    """

    node: np.ndarray
    vertex: np.ndarray
    zone: np.ndarray
    block: np.ndarray
    owner: np.ndarray


def cut_into_parts(bodies: Bodies, skin: Skin) -> Parts:
    """Parts of about `PART_BLOCKS` blocks, as stored; one part if vertices, zones and nodes differ in that."""
    places = [runs(a) for a in (skin.block, bodies.vertex_block, bodies.zone_block)]
    blocks = places[0][0]
    same = all(len(p[0]) == len(blocks) and np.array_equal(p[0], blocks) for p in places)
    same &= len(np.unique(blocks)) == len(blocks)
    owner = np.repeat(np.arange(len(blocks), dtype=np.int32), np.diff(places[0][1]))
    count = max(1, round(len(blocks) / PART_BLOCKS)) if same else 1
    cut = np.round(np.linspace(0, len(blocks), count + 1)).astype(np.int64)
    if count == 1:
        ends = (len(skin.block), len(bodies.vertex_block), len(bodies.zone_block), len(blocks))
        node, vertex, zone, block = (np.array([0, n]) for n in ends)
        return Parts(node, vertex, zone, block, owner)
    node, vertex, zone = (start[cut] for _, start in places)
    return Parts(node, vertex, zone, cut, owner)


def runs(block: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Blocks in order of storage, and where each begins (one more entry: the end)."""
    start = np.flatnonzero(np.append(True, block[1:] != block[:-1]))
    return block[start], np.append(start, len(block))
