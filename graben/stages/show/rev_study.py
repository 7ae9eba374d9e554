"""REV study: each scalar against the radius, samples, mean and interval, as Y's figure 4.5."""

from __future__ import annotations

import numpy as np
import xarray
from matplotlib.figure import Figure

_NAMES = {
    "secant_modulus": ("secant modulus, GPa", 1e-9),
    "poisson_ratio": ("lateral over vertical strain", 1.0),
    "peak_stress": ("peak stress, MPa", 1e-6),
    "strain_at_peak": ("strain at peak, %", 100.0),
    "dilation": ("dilation angle, deg", 180.0 / np.pi),
}


def draw(dataset: xarray.Dataset, figure: Figure) -> None:
    """One panel per scalar; a line at the recommended radius."""
    names = [n for n in _NAMES if f"{n}_mean" in dataset]
    rows = 1 if len(names) < 3 else 2
    panels = np.atleast_1d(figure.subplots(rows, -(-len(names) // rows), sharex=True)).ravel()
    radius = dataset["radius"].values
    chosen = float(dataset["recommended_radius"])
    area = dataset["area"].values.mean(axis=(1, 2))
    for axes, name in zip(panels, names):
        label, scale = _NAMES[name]
        values = dataset[name].values
        for k, r in enumerate(radius):
            points = values[k].ravel() * scale
            axes.plot(np.full(points.size, r), points, ".", color="0.6", markersize=4)
        axes.fill_between(
            radius,
            dataset[f"{name}_low"].values * scale,
            dataset[f"{name}_high"].values * scale,
            alpha=0.3,
            linewidth=0,
        )
        axes.plot(radius, dataset[f"{name}_mean"].values * scale, "o-", markersize=4)
        settled = dataset[f"{name}_settled"].values.astype(bool)
        axes.plot(
            radius[settled], (dataset[f"{name}_mean"].values * scale)[settled], "o", color="tab:green", markersize=6
        )
        if chosen > 0.0:
            axes.axvline(chosen, color="tab:red", linewidth=1.0)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        axes.set_xlabel("radius of the REV, m")
    for axes in panels[len(names) :]:
        axes.axis("off")
    head = f"recommended radius {chosen:g} m" if chosen > 0.0 else "no radius recommended"
    text = f"{head}; area inside the outline {area[0]:.3g} to {area[-1]:.3g} m2; green: settled"
    figure.suptitle(text + "\n" + _wrapped(str(dataset.attrs.get("reason", ""))), fontsize=9)


def _wrapped(text: str, width: int = 120) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, width))
