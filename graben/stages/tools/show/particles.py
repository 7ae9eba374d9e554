"""Picture of a bed: a slice, the map of what touches the floor, how it came to rest."""

from __future__ import annotations

from typing import Any

import numpy as np

COLOURS = ("#4878a8", "#e08214", "#5aae61", "#8073ac", "#b2182b", "#878787")


def draw(dataset: Any, figure: Any) -> None:
    """Draw the first bed of a particles artifact: slice through the middle, floor contacts, history."""
    (slice_axes, floor_axes), (push_axes, energy_axes) = figure.subplots(2, 2)
    first = dataset["particle_bed"].values == 0
    x = dataset["position"].values[-1][first] * 1e3
    r = dataset["particle_radius"].values[first] * 1e3
    kind = dataset["particle_class"].values[first]
    force = dataset["floor_force"].values[first]
    width = float(dataset["bed_width"].values[0]) * 1e3
    names = [str(n) for n in dataset["class_name"].values]
    _slice(slice_axes, x, r, kind, width, float(dataset["bed_piston_height"].values[0]) * 1e3)
    _floor(floor_axes, x, r, kind, force, width, names, dataset)
    _history(push_axes, energy_axes, dataset)
    figure.suptitle(dataset.attrs.get("title", ""), fontsize=10)


def _discs(axes: Any, centre: np.ndarray, radius: np.ndarray, colours: list[Any], **style: Any) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    patches = [Circle((float(a), float(b)), float(s)) for (a, b), s in zip(centre, radius)]
    axes.add_collection(PatchCollection(patches, facecolor=colours, **style))


def _slice(axes: Any, x: np.ndarray, r: np.ndarray, kind: np.ndarray, width: float, top: float) -> None:
    offset = np.abs(x[:, 1] - 0.5 * width)
    cut = offset < r
    shown = np.sqrt(r[cut] ** 2 - offset[cut] ** 2)
    colours = [COLOURS[k % len(COLOURS)] for k in kind[cut]]
    _discs(axes, x[cut][:, [0, 2]], shown, colours, edgecolor="black", linewidth=0.3)
    axes.axhline(0.0, color="black", lw=2)
    axes.axhline(top, color="firebrick", lw=1.5)
    axes.set(xlim=(0, width), ylim=(-0.05 * top, 1.1 * top), xlabel="x, mm", ylabel="z, mm", aspect="equal")
    axes.set_title("slice through the middle, under the piston (red)", fontsize=9)


def _floor(
    axes: Any,
    x: np.ndarray,
    r: np.ndarray,
    kind: np.ndarray,
    force: np.ndarray,
    width: float,
    names: list[str],
    data: Any,
) -> None:
    from matplotlib.lines import Line2D

    low = x[:, 2] < 2.0 * r
    touching = force > 0.0
    near = low & ~touching
    _discs(axes, x[near][:, :2], r[near], ["none"] * int(near.sum()), edgecolor="silver", linewidth=0.5)
    strength = (
        np.clip(force[touching] / np.quantile(force[touching], 0.95), 0.0, 1.0) if touching.any() else np.zeros(0)
    )
    from matplotlib.colors import to_rgba

    colours = [(*to_rgba(COLOURS[k % len(COLOURS)])[:3], 0.2 + 0.8 * s) for k, s in zip(kind[touching], strength)]
    _discs(axes, x[touching][:, :2], r[touching], colours, edgecolor="black", linewidth=0.3)
    axes.set(xlim=(0, width), ylim=(0, width), xlabel="x, mm", ylabel="y, mm", aspect="equal")
    found = data["floor_contacts_per_area"].values * data["class_diameter"].values ** 2
    marks = [
        Line2D([], [], marker="o", ls="", color=COLOURS[i % len(COLOURS)], label=f"{name}: N D$^2$ = {found[i]:.3f}")
        for i, name in enumerate(names)
    ]
    marks.append(Line2D([], [], marker="o", ls="", mfc="none", color="silver", label="low, not touching"))
    axes.legend(handles=marks, fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_title("what touches the floor (darker: more force)", fontsize=9)


def _history(push_axes: Any, energy_axes: Any, data: Any) -> None:
    own = data["sample_bed"].values == 0
    time = data["time"].values[own] * 1e3
    push_axes.plot(time, data["floor_push"].values[own], label="on floor", color=COLOURS[0])
    push_axes.plot(time, data["piston_push"].values[own], label="on piston", color=COLOURS[4])
    push_axes.set(xlabel="time, ms", ylabel="force, N")
    count = push_axes.twinx()
    count.plot(time, data["floor_contacts"].values[own], color="gray", lw=0.8)
    count.set_ylabel("floor contacts", color="gray")
    push_axes.legend(fontsize=7, loc="center right")
    push_axes.set_title("forces and floor contacts", fontsize=9)
    for name, colour in (("potential", 0), ("dashpots", 1), ("piston_work", 2), ("elastic", 3), ("kinetic", 4)):
        energy_axes.plot(time, data[name].values[own], label=name.replace("_", " "), color=COLOURS[colour], lw=1)
    energy_axes.plot(time, data["total"].values[own], "k--", lw=1, label="total")
    energy_axes.set(xlabel="time, ms", ylabel="energy, J")
    energy_axes.legend(fontsize=7, loc="center right")
    energy_axes.set_title("energy balance", fontsize=9)
