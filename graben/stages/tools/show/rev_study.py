"""REV study: each scalar against the radius, samples, mean and interval, as Y's figure 4.5."""

from __future__ import annotations

from dataclasses import dataclass

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
_PARTS = ("mean", "low", "high", "settled")


_PARAMETER_UNITS = {"Pa": ("MPa", 1e-6), "rad": ("deg", 180.0 / np.pi), "m": ("m", 1.0), "1": ("", 1.0)}


@dataclass(frozen=True)
class _Panel:
    """One scalar: label, samples (radius, ...), and its statistics (radius,), in the units of the label."""

    label: str
    samples: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    settled: np.ndarray


def draw(dataset: xarray.Dataset, figure: Figure) -> None:
    """One panel per scalar, or per calibrated parameter; a line at the recommended radius."""
    panels = _parameters(dataset) if "parameter_value" in dataset else _scalars(dataset)
    rows = int(np.ceil(np.sqrt(len(panels) / 1.5))) if len(panels) > 2 else 1
    grid = np.atleast_1d(figure.subplots(rows, -(-len(panels) // rows), sharex=True)).ravel()
    radius = dataset["radius"].values
    chosen = float(dataset["recommended_radius"])
    area = dataset["area"].values.mean(axis=(1, 2))
    for axes, panel in zip(grid, panels):
        for k, r in enumerate(radius):
            points = panel.samples[k].ravel()
            axes.plot(np.full(points.size, r), points, ".", color="0.6", markersize=4)
        axes.fill_between(radius, panel.low, panel.high, alpha=0.3, linewidth=0)
        axes.plot(radius, panel.mean, "o-", markersize=4)
        axes.plot(radius[panel.settled], panel.mean[panel.settled], "o", color="tab:green", markersize=6)
        if chosen > 0.0:
            axes.axvline(chosen, color="tab:red", linewidth=1.0)
        axes.set_ylabel(panel.label, fontsize="small" if len(panels) > 4 else None)
        axes.grid(alpha=0.3)
        axes.set_xlabel("radius of the REV, m")
    for axes in grid[len(panels) :]:
        axes.axis("off")
    head = f"recommended radius {chosen:g} m" if chosen > 0.0 else "no radius recommended"
    text = f"{head}; area inside the outline {area[0]:.3g} to {area[-1]:.3g} m2; green: settled"
    figure.suptitle(text + "\n" + _wrapped(str(dataset.attrs.get("reason", ""))), fontsize=9)


def _scalars(dataset: xarray.Dataset) -> list[_Panel]:
    return [
        _panel(label, scale, dataset[name].values, {p: dataset[f"{name}_{p}"].values for p in _PARTS})
        for name, (label, scale) in _NAMES.items()
        if f"{name}_mean" in dataset
    ]


def _parameters(dataset: xarray.Dataset) -> list[_Panel]:
    panels = []
    for k, name in enumerate(map(str, dataset["parameter_name"].values)):
        unit, scale = _PARAMETER_UNITS.get(str(dataset["parameter_unit"].values[k]), ("", 1.0))
        told = "" if dataset["parameter_identifiable"].values[k] else "\n(not identifiable)"
        label = name.replace("_", " ") + (f", {unit}" if unit else "") + told
        parts = {p: dataset[f"parameter_{p}"].values[k] for p in _PARTS}
        panels.append(_panel(label, scale, dataset["parameter_value"].values[k], parts))
    return panels


def _panel(label: str, scale: float, samples: np.ndarray, parts: dict[str, np.ndarray]) -> _Panel:
    mean, low, high = (scale * parts[p] for p in ("mean", "low", "high"))
    return _Panel(label, scale * samples, mean, low, high, parts["settled"].astype(bool))


def _wrapped(text: str, width: int = 120) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text, width))
