"""Picture of a fem artifact: deformed mesh with stress, plastic strain, load against settlement, surface."""

from __future__ import annotations

from typing import Any

import numpy as np


def draw(dataset: Any, figure: Any) -> None:
    """Draw the last state of a fem artifact into a matplotlib figure."""
    nodes = np.stack([dataset["node_x"].values, dataset["node_y"].values], axis=1)
    quads = dataset["face_node"].values
    movement = dataset["displacement"].values[-1]
    extent = float(np.ptp(nodes, axis=0).max())
    largest = float(np.hypot(*movement.T).max())
    scale = 0.04 * extent / largest if largest > 0 else 1.0
    corners = (nodes + scale * movement)[quads]
    axes = figure.subplots(2, 3)
    # What `output.fields` left out has an empty place.
    if "stress" in dataset:
        stress = dataset["stress"].values[-1]
        _field(figure, axes[0, 0], corners, stress[:, 1] / 1e6, "vertical stress (MPa)", "viridis")
        axes[0, 0].set_title(f"vertical stress, deformation x {scale:.3g}", fontsize=10)
        _field(figure, axes[0, 1], corners, stress[:, 0] / 1e6, "horizontal stress (MPa)", "viridis")
        _field(figure, axes[0, 2], corners, stress[:, 3] / 1e6, "shear stress (MPa)", "RdBu_r", centred=True)
    if "plastic_strain" in dataset:
        plastic = dataset["plastic_strain"].values[-1]
        _field(figure, axes[1, 0], corners, 100 * plastic, "equivalent plastic strain (%)", "magma_r")
    for place in axes.flat:
        if not place.has_data() and place not in (axes[1, 1], axes[1, 2]):
            place.set_axis_off()
    _history(dataset, axes[1, 1])
    _surface(dataset, axes[1, 2])


def _field(
    figure: Any, axes: Any, corners: Any, values: Any, label: str, colours: str, centred: bool = False
) -> None:
    from matplotlib.collections import PolyCollection

    fine = len(values) > 5000
    patches = PolyCollection(
        corners, array=values, cmap=colours, edgecolors="face" if fine else (0, 0, 0, 0.25), linewidths=0.2
    )
    # A few elements at a corner of the load would take up the whole scale.
    low, high = np.percentile(values, [0.5, 99.5])
    if centred:
        high = max(abs(low), abs(high))
        low = -high
    if high > low:
        patches.set_clim(low, high)
    axes.add_collection(patches)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_title(label.rsplit(" (", 1)[0], fontsize=10)
    axes.tick_params(labelsize=8)
    bar = figure.colorbar(patches, ax=axes, orientation="horizontal", shrink=0.9)
    bar.set_label(label, fontsize=9)
    bar.ax.tick_params(labelsize=8)


def _history(dataset: Any, axes: Any) -> None:
    settlement = 1e3 * dataset["step_settlement"].values
    pressure = dataset["step_pressure"].values / 1e6
    axes.plot(settlement, pressure, ".-", color="#225588", markersize=4)
    if int(dataset.attrs.get("failed", 0)):
        load = float(dataset.attrs["failure_load_pa"]) / 1e6
        axes.axhline(load, color="#aa3322", linewidth=1)
        axes.annotate(
            f"failure at {load:.2f} MPa",
            (0.03, load),
            xycoords=("axes fraction", "data"),
            va="bottom",
            fontsize=9,
            color="#aa3322",
        )
        axes.set_ylim(top=1.12 * max(load, pressure.max()))
    axes.set_xlabel("settlement of the loaded segment (mm)")
    axes.set_ylabel("pressure (MPa)")
    axes.grid(alpha=0.3)


def _surface(dataset: Any, axes: Any) -> None:
    distance = dataset["surface_distance"].values
    vertical = 1e3 * dataset["surface_displacement"].values[..., 1]
    times = dataset["time"].values
    chosen = np.unique(np.linspace(1, len(times) - 1, min(6, len(times) - 1)).astype(int)) if len(times) > 1 else [0]
    for k in chosen:
        shade = 0.25 + 0.75 * k / max(1, len(times) - 1)
        axes.plot(distance, vertical[k], color=(0.13, 0.33, 0.53, shade), label=f"{times[k]:.3g} s")
    axes.set_xlabel("distance along the free surface (m)")
    axes.set_ylabel("vertical displacement (mm)")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)
