"""The free part of a mesh's outline, as nodes in order."""

from __future__ import annotations

import numpy as np

from graben.mechanics.meshes.mesh2d import QuadMesh


def free_surface(mesh: QuadMesh, supported: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Longest unbroken chain of outline edges that lie on no support.

    Parameters
    ----------
    supported : node numbers of each support

    Returns
    -------
    nodes (s,) in order, with the material on the right (clockwise: from left to right on a top), and the
    distance (s,) along them, m; empty when all of the outline is supported. A closed free outline is cut at its
    lowest node number.
    """
    edges = mesh.boundary_edges()
    held = np.zeros(len(edges), dtype=bool)
    for nodes in supported:
        held |= np.isin(edges, nodes).all(axis=1)
    edges = edges[~held][:, ::-1]
    after = {int(a): int(b) for a, b in edges}
    heads = sorted(set(after) - set(after.values()))
    chains = [_walk(after, head) for head in heads]
    left = set(after).difference(*chains) if chains else set(after)
    while left:
        ring = _walk(after, min(left))
        chains.append(ring)
        left -= set(ring)
    best, best_distance = np.zeros(0, dtype=np.int64), np.zeros(0)
    for chain in chains:
        nodes = np.array(chain, dtype=np.int64)
        pieces = np.hypot(*np.diff(mesh.points[nodes], axis=0).T)
        distance = np.concatenate([[0.0], np.cumsum(pieces)])
        if not len(best_distance) or distance[-1] > best_distance[-1]:
            best, best_distance = nodes, distance
    return best, best_distance


def _walk(after: dict[int, int], start: int) -> list[int]:
    chain, seen = [start], {start}
    while chain[-1] in after:
        node = after[chain[-1]]
        chain.append(node)
        if node in seen:
            break
        seen.add(node)
    return chain
