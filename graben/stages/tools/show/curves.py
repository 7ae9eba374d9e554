"""Curves: axial stress and lateral strain against axial strain, as Y draws them (figure 4.1)."""

from __future__ import annotations

import numpy as np
import xarray
from matplotlib.figure import Figure

from graben.mechanics.fitting.curves import since_first


def draw(dataset: xarray.Dataset, figure: Figure) -> None:
    """Compression positive here, as rock engineers plot it; the artifact itself has tension positive."""
    push, wide = figure.subplots(1, 2, sharex=True)
    for k in range(dataset.sizes["path"]):
        n = int(dataset["step_count"][k])
        strain = since_first(dataset["strain"].values[k, :n])
        stress = dataset["stress"].values[k, :n]
        label = str(dataset["path_name"].values[k])
        confining = float(dataset["confining_stress"][k])
        if np.isfinite(confining):
            label += f" ({-confining / 1e6:g} MPa)"
        short = -100.0 * strain[:, 1]
        (line,) = push.plot(short, -stress[:, 1] / 1e6, label=label)
        if "stress_boundary" in dataset:
            forces = dataset["stress_boundary"].values[k, :n]
            push.plot(short, -forces[:, 1] / 1e6, ":", color=line.get_color(), linewidth=1.0)
        push.plot(short, -stress[:, 0] / 1e6, "--", color=line.get_color(), linewidth=0.8)
        wide.plot(short, 100.0 * strain[:, 0], color=line.get_color())
    push.set(xlabel="vertical shortening, %", ylabel="average stress, MPa (compression positive)")
    push.set_title("solid: vertical, dashed: lateral, dotted: vertical from boundary forces", fontsize=9)
    wide.set(xlabel="vertical shortening, %", ylabel="lateral extension, %")
    for axes in (push, wide):
        axes.grid(alpha=0.3)
    push.legend(fontsize=8)
