"""Picture of a trade-off: error against CPU time, with error bars, the front, and the point recommended."""

from __future__ import annotations

from typing import Any

import numpy as np


def draw(dataset: Any, figure: Any) -> None:
    """Draw |error| of each point over its CPU time, both by their logarithms."""
    axes = figure.subplots()
    cost, error = dataset["cpu_time"].values.mean(axis=1), dataset["error"].values
    known, front = np.isfinite(error), dataset["on_front"].values.astype(bool)
    size = np.abs(error)
    # What is closer than this is drawn here: a logarithm has no zero.
    floor = max(1e-5, 0.3 * float(np.min(size[known & (size > 0.0)], initial=1.0)))
    ends = np.array([dataset["error_low"].values, dataset["error_high"].values])
    inside = (ends[0] <= 0.0) & (ends[1] >= 0.0)
    nearest = np.where(inside, floor, np.abs(ends).min(axis=0))
    drawn = np.maximum(size, floor)
    bars = np.array([drawn - np.minimum(nearest, drawn), np.maximum(np.abs(ends).max(axis=0), drawn) - drawn])
    axes.errorbar(cost[known], drawn[known], np.nan_to_num(bars[:, known]), fmt="o", color="#878787", capsize=3)
    order = np.flatnonzero(front)[np.argsort(cost[front])]
    axes.plot(cost[order], drawn[order], "o-", color="#b2182b", label="no point is both cheaper and closer")
    for i in np.flatnonzero(known):
        label = ", ".join(str(v) for v in dataset["knob_value"].values[i])
        axes.annotate(label, (cost[i], drawn[i]), (5, 4), textcoords="offset points", fontsize=8)
    best, wanted = int(dataset["recommended"]), float(dataset["wanted_error"])
    if np.isfinite(wanted):
        axes.axhline(wanted, color="black", lw=0.8, ls="--", label=f"wanted: {100 * wanted:.3g} %")
    if best >= 0:
        axes.plot(cost[best], drawn[best], "s", ms=14, mfc="none", color="black", label="recommended")
    axes.set(xscale="log", yscale="log", xlabel="CPU time, s", ylabel=f"|error| of {dataset.attrs['quantity']}")
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.3g} %")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=9)
    axes.set_title(
        f"{dataset.attrs['command']}: {', '.join(map(str, dataset['knob_key'].values))}; reference "
        f"{float(dataset['reference']):.5g}, {dataset.attrs['reference_from']}", fontsize=10,
    )  # fmt: skip
