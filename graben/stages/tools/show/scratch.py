"""Picture of a scratch: the groove from above, its section, forces along the path, degree of wear over s/a."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_UM = 1e6


def draw(dataset: xarray.Dataset, figure: Figure) -> None:
    """Draw a scratch artifact into an empty figure."""
    axes = figure.subplot_mosaic([["above", "above", "volumes"], ["section", "forces", "wear"]])
    _from_above(dataset, figure, axes["above"])
    _volumes(dataset, axes["volumes"])
    _section(dataset, axes["section"])
    _forces(dataset, axes["forces"])
    _degree_of_wear(dataset, axes["wear"])
    radius, depth = _UM * float(dataset["grain_radius"]), _UM * float(dataset["depth"])
    figure.suptitle(
        f"R {radius:g} µm, depth {depth:g} µm: groove {1e12 * float(dataset['groove_area']):.1f} µm², "
        f"degree of wear {float(dataset['degree_of_wear']):.2f} at s/a {float(dataset['s_over_a']):.2f}, "
        f"{float(dataset['normal_force']):.2f} N"
    )


def _from_above(dataset: xarray.Dataset, figure: Figure, ax: Axes) -> None:
    x, y = _UM * dataset["section_position"].values, _UM * dataset["profile_y"].values
    z = _UM * dataset["profile_z"].values[1]
    both = np.concatenate([-y[:0:-1], y])
    heights = np.concatenate([z[:, :0:-1], z], axis=1).T
    limit = max(1e-9, float(np.nanmax(np.abs(heights))))
    mesh = ax.pcolormesh(x, both, heights, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="gouraud")
    ax.contour(x, both, heights, levels=[0.0], colors="k", linewidths=0.6)
    start, path = _UM * float(dataset["start"]), _UM * float(dataset["path"])
    ax.annotate("", (start + path, 0), (start, 0), arrowprops={"arrowstyle": "->", "lw": 0.8})
    ax.set(
        aspect="equal", xlabel="x [µm]", ylabel="y [µm]", title="after lifting, from above (the path is the arrow)"
    )
    figure.colorbar(mesh, ax=ax, label="height [µm]", panchor="C")


def _volumes(dataset: xarray.Dataset, ax: Axes) -> None:
    names = ("groove", "shoulders", "bow", "compressed", "removed")
    values = [1e18 * float(dataset[f"volume_{n}"].values[1]) for n in names]
    ax.bar(range(len(names)), values, color=["tab:blue", "tab:red", "tab:orange", "0.5", "k"])
    ax.set_xticks(range(len(names)), ["groove", "shoulders", "bow wave", "compressed", "removed"], rotation=30)
    ax.set(ylabel="volume [µm³]", title="where the groove went")


def _section(dataset: xarray.Dataset, ax: Axes) -> None:
    middle = float(dataset["start"]) + 0.5 * float(dataset["path"])
    i = int(np.argmin(np.abs(dataset["section_position"].values - middle)))
    y = _UM * dataset["profile_y"].values
    both = np.concatenate([-y[:0:-1], y])
    for state, (name, style) in enumerate((("under load", "--"), ("after lifting", "-"))):
        z = _UM * dataset["profile_z"].values[state, i]
        ax.plot(both, np.concatenate([z[:0:-1], z]), style, label=name)
    radius, depth = _UM * float(dataset["grain_radius"]), _UM * float(dataset["depth"])
    inside = np.abs(both) <= np.sqrt(max(0.0, 2 * radius * depth - depth**2))
    ax.plot(both[inside], radius - depth - np.sqrt(radius**2 - both[inside] ** 2), ":", color="0.4", label="grain")
    ax.axhline(0.0, color="0.7", lw=0.6)
    ax.set(xlabel="y [µm]", ylabel="z [µm]", title="section at mid-path (heights stretched)")
    ax.legend(fontsize=8)


def _forces(dataset: xarray.Dataset, ax: Axes) -> None:
    names = [str(n) for n in dataset["phase_name"].values]
    travelled = _UM * (dataset["tip_position"].values[:, 0] - float(dataset["start"]))
    force = dataset["force"].values
    if "slide" in names:
        use = dataset["phase_index"].values == names.index("slide")
        ax.plot(travelled[use], -force[use, 2], label="normal")
        ax.plot(travelled[use], force[use, 0], label="tangential")
        ax.set(xlabel="sliding distance [µm]")
    else:
        use = dataset["phase_index"].values == 0
        sunk = _UM * (float(dataset["grain_radius"]) - dataset["tip_position"].values[use, 2])
        ax.plot(sunk, -force[use, 2], label="normal")
        ax.set(xlabel="depth [µm]")
    ax.set(ylabel="force [N]", ylim=(0, None), title="forces on the specimen")
    ax.legend(fontsize=8)


def _degree_of_wear(dataset: xarray.Dataset, ax: Axes) -> None:
    s = dataset["section_s_over_a"].values
    path = float(dataset["path"]) / float(dataset["contact_half_width"])
    use = (s >= 0) & (s <= path)
    for state, (name, style) in enumerate((("under load", "--"), ("after lifting", "-"))):
        ax.plot(s[use], dataset["section_degree_of_wear"].values[state, use], style, label=name)
    ax.plot(float(dataset["s_over_a"]), float(dataset["degree_of_wear"]), "ko", ms=4, label="reported")
    ax.set(xlabel="path over contact half-width s/a", ylabel="(Ag - As) / Ag", ylim=(min(0.0, ax.get_ylim()[0]), 1))
    ax.set(title="degree of wear")
    ax.legend(fontsize=8)
