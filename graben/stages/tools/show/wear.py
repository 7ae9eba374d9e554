"""Picture of wear rates: a bar per mixture, cut into classes; and the load that the contacts carry."""

from __future__ import annotations

from typing import Any

import numpy as np

COLOURS = ("#4878a8", "#e08214", "#5aae61", "#8073ac", "#b2182b", "#878787")


def draw(dataset: Any, figure: Any) -> None:
    """Draw the wear rate of each mixture, stacked by class, beside carried over applied load."""
    rates, load = figure.subplots(1, 2, width_ratios=[3, 1], sharey=True)
    names = [str(n) for n in dataset["mixture_name"].values]
    place = np.arange(len(names))[::-1]
    left = np.zeros(len(names))
    for i, name in enumerate(dataset["class_name"].values):
        part = dataset["class_wear_rate"].values[:, i]
        size = f"{name}: {dataset['class_diameter'].values[i] * 1e6:.4g} um"
        rates.barh(place, part, left=left, color=COLOURS[i % len(COLOURS)], label=size)
        left += part
    for y, total in zip(place, dataset["wear_rate"].values):
        rates.annotate(
            f"{total:.3g}", (max(total, 0.0), y), (4, 0), textcoords="offset points", va="center", fontsize=8
        )
    rates.set_yticks(place, names, fontsize=8)
    rates.set_xlim(min(0.0, 1.15 * left.min()), 1.15 * max(left.max(), 1e-300))
    rates.set(xlabel="wear rate, m$^3$/s")
    rates.legend(fontsize=8, loc="lower right")
    rates.set_title(f"load {dataset.attrs.get('load_mode', '')}", fontsize=9)
    applied = float(dataset["applied_load"])
    ratio = dataset["carried_load"].values / applied
    wrong = np.abs(ratio - 1.0) > 0.1
    load.barh(place, ratio, color=np.where(wrong, "firebrick", "seagreen"))
    load.axvline(1.0, color="black", lw=1)
    load.set_xscale("log")
    load.set_xlim(min(0.5, ratio.min() / 2), max(2.0, ratio.max() * 3))
    load.set_xlabel(f"carried load / {applied:.4g} N")
    load.set_title("do the contacts carry the load?", fontsize=9)
