"""Picture of a run of blocks: the last state with its stress and open joints, and stress against strain."""

from __future__ import annotations

from typing import Any

import numpy as np


def draw(dataset: Any, figure: Any) -> None:
    """Blocks at the last state coloured by vertical stress; stress over strain, or settlement under a rising load."""
    from matplotlib.collections import LineCollection, PolyCollection

    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    x = dataset.vertex_position.values + dataset.displacement.values[-1]
    there = np.ones(dataset.sizes["block"], dtype=bool)
    if "block_removed" in dataset:
        there = dataset.block_removed.values[-1] == 0
    ends = np.cumsum(dataset.block_corner_count.values)[:-1]
    rings = [ring for ring, kept in zip(np.split(x[dataset.block_corner.values], ends), there, strict=True) if kept]
    rigid = "block_stress" in dataset
    drawn = there if rigid else there[dataset.zone_block.values]
    stress = -(dataset.block_stress if rigid else dataset.zone_stress).values[-1, drawn, 1] / 1e6
    cells = rings if rigid else x[dataset.zone_vertex.values[drawn]]
    field = PolyCollection(cells, array=stress, cmap="viridis", edgecolors="none")
    field.set_clim(0.0, max(float(np.percentile(stress, 97)), 1e-6))
    left.add_collection(field)
    left.add_collection(PolyCollection(rings, facecolors="none", edgecolors="0.15", linewidths=0.4))
    count = dataset.contact_count.values
    last = slice(int(count[:-1].sum()), int(count.sum()))
    sliding = dataset.contact_state.values[last] == 1
    half = 0.5 * dataset.contact_length.values[last, None] * dataset.contact_tangent.values[last]
    middle = dataset.contact_position.values[last]
    segments = np.stack([middle - half, middle + half], axis=1)[sliding]
    left.add_collection(LineCollection(segments, colors="crimson", linewidths=1.2))
    left.autoscale()
    left.set_aspect("equal")
    left.set_xlabel("x, m")
    left.set_ylabel("y, m")
    left.set_title(f"t = {float(dataset.time[-1]):.3g} s; sliding joints red")
    figure.colorbar(field, ax=left, label="vertical compression, MPa", shrink=0.6)

    if "look_settlement" in dataset:
        _rising(dataset, right)
    else:
        _compression(dataset, right)
    figure.suptitle(f"{dataset.sizes['block']} blocks, {dataset.sizes['zone']} zones")


def _rising(dataset: Any, axis: Any) -> None:
    """Settlement against the time for which pressures rose; the surface at the last load carried, below."""
    axis.plot(dataset.look_settlement.values * 1e3, dataset.look_load_time.values)
    axis.plot(0.0, 0.0, ".", color="none")
    axis.set_xlabel("settlement of the loaded ground, mm\n(mean displacement where no load changes)")
    axis.set_ylabel("time of loading, waiting not counted, s")
    low = axis.inset_axes((0.42, 0.1, 0.55, 0.4))
    x = dataset.vertex_position.values[dataset.surface_vertex.values]
    level = x[:, 1] > x[:, 1].max() - 0.05 * np.ptp(dataset.outline.values[:, 1])
    low.plot(x[level, 0], dataset.surface_carried_displacement.values[level, 1] * 1e3, ".", ms=2, color="0.2")
    low.set_xlabel("x, m", fontsize=8)
    low.set_title("top surface at the last load carried, mm", fontsize=8)
    low.tick_params(labelsize=8)


def _compression(dataset: Any, right: Any) -> None:
    """Stress of the top wall and of the zones inside, over nominal strain."""
    outline = dataset.outline.values
    size = np.ptp(outline, axis=0)
    top = int(np.argmax(0.5 * (outline + np.roll(outline, -1, axis=0))[:, 1]))
    held = np.abs(dataset.vertex_position.values[:, 1] - outline[:, 1].max()) < 1e-3 * size[1]
    strain = -dataset.displacement.values[:, held, 1].mean(axis=1) / size[1] * 100.0
    right.plot(strain, -dataset.wall_reaction.values[:, top, 1] / size[0] / 1e6, label="top wall")
    x = dataset.vertex_position.values
    if "block_stress" in dataset:
        ends = np.cumsum(dataset.block_corner_count.values)[:-1]
        middle = np.array([ring.mean(axis=0) for ring in np.split(x[dataset.block_corner.values], ends)])
        name, area, stress = "blocks", dataset.block_area.values, dataset.block_stress.values
    else:
        p = x[dataset.zone_vertex.values]
        middle, d1, d2 = p.mean(axis=1), p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        name, area, stress = "zones", 0.5 * (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]), dataset.zone_stress.values
    inside = np.hypot(*(middle - outline.mean(axis=0)).T) < 0.4 * size.min()
    if inside.any():
        mean = np.average(stress[:, inside], axis=1, weights=area[inside])
        right.plot(strain, -mean[:, 1] / 1e6, label=f"{name} inside, vertical")
        right.plot(strain, -mean[:, 0] / 1e6, label=f"{name} inside, lateral")
    right.axhline(-float(dataset.confining_stress) / 1e6, color="0.6", ls=":", label="confinement")
    right.set_xlabel("nominal axial strain, %")
    right.set_ylabel("compression, MPa")
    right.legend(frameon=False)
