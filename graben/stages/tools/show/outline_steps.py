"""The steps of Y 2.3 as pictures: how the outline of a REV was found (Y's figures 2.4 to 2.12)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from graben.mechanics.averaging.history import History
from graben.mechanics.averaging.outline import Outline
from graben.mechanics.averaging.rev import Circle, Polygon, Rev
from graben.schemas.files import whole_file
from graben.schemas.outputs import picture_mark


def save_steps(path: Path, history: History, outline: Outline, rev: Rev) -> None:
    """Draw the nine steps into a picture file."""
    figure = Figure(figsize=(12, 12.5), layout="constrained")
    draw_steps(figure, history, outline, rev)
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=120, metadata=picture_mark(path.suffix))


def draw_steps(figure: Figure, history: History, outline: Outline, rev: Rev) -> None:
    """Nine panels, at the positions of the first state."""
    from matplotlib.collections import LineCollection, PolyCollection

    network, x, s = history.network, history.position, outline.steps
    rings = [x[r] for r in np.split(history.corner, np.cumsum(history.corner_count)[:-1])]
    nodes = outline.follow(x)
    contacts = np.stack(network.ends(x, network.contact[:, 0]), axis=1)
    panels = figure.subplots(3, 3, sharex=True, sharey=True).ravel()
    blocks = {
        0: (s.boundary_blocks, "tab:blue"),
        1: (s.outside_blocks, "tab:gray"),
        5: (s.outline_blocks, "tab:orange"),
    }
    lines = {2: s.boundary_contacts, 4: s.block_contacts}
    corners = {3: s.contact_corners, 6: s.block_corners, 7: s.corners}
    titles = (
        "1 blocks on the REV's boundary",
        "2 blocks outside",
        "3 contacts between 1 and 2",
        "4 corners of 3",
        "5 contacts of blocks in 1",
        "6 blocks with contacts in 3 and 5",
        "7 corners of blocks in 6",
        "8 corners in 4 and 7",
        "9 the closed outline",
    )
    for k, axes in enumerate(panels):
        axes.add_collection(PolyCollection(rings, facecolors="none", edgecolors="0.75", linewidths=0.4))
        if k in blocks:
            axes.add_collection(PolyCollection([rings[b] for b in blocks[k][0]], facecolors=blocks[k][1], alpha=0.5))
        if k in lines:
            axes.add_collection(LineCollection(list(contacts[lines[k]]), colors="tab:red", linewidths=1.2))
        if k in corners:
            axes.plot(*x[corners[k]].T, ".", color="tab:red", markersize=2.5)
        if k == 8:
            axes.fill(*nodes.T, facecolor="tab:green", alpha=0.3, edgecolor="k", linewidth=1.2)
        curve = _curve(rev)
        axes.plot(*curve.T, color="k", linewidth=0.8)
        axes.set_title(titles[k], fontsize=9)
        axes.set_aspect("equal")
    room = 0.15 * np.ptp(nodes, axis=0).max()
    panels[0].set_xlim(nodes[:, 0].min() - room, nodes[:, 0].max() + room)
    panels[0].set_ylim(nodes[:, 1].min() - room, nodes[:, 1].max() + room)


def _curve(rev: Rev) -> np.ndarray:
    if isinstance(rev, Polygon):
        return np.vstack([rev.points, rev.points[:1]])
    assert isinstance(rev, Circle)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    return np.asarray(rev.centre) + rev.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
