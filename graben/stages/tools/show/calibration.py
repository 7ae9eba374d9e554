"""Picture of a calibration: the fit against the curves, how well each parameter is known, and their correlation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from graben.mechanics.fitting.curves import since_first


def draw(dataset: Any, figure: Any) -> None:
    """Fill a matplotlib figure from an artifact of kind "calibration". Compression is shown positive."""
    compared = "candidate_name" in dataset
    figure.set_size_inches(13.0, 12.0 if compared else 9.0)
    rows = (1.0, 1.0, 0.6) if compared else (1.0, 1.0)
    grid = figure.add_gridspec(len(rows), 3, width_ratios=(1.15, 1.15, 1.0), height_ratios=rows)
    _curves(dataset, figure.add_subplot(grid[0, :2]), lateral=False)
    _curves(dataset, figure.add_subplot(grid[1, :2]), lateral=True)
    _parameters(dataset, figure.add_subplot(grid[0, 2]))
    _correlation(dataset, figure.add_subplot(grid[1, 2]), figure)
    if compared:
        _candidates(dataset, figure.add_subplot(grid[2, :]))
    rmse = float(dataset.attrs["rmse_pa"]) / 1e6
    figure.suptitle(f"{dataset.attrs['law']}: RMSE of axial stress {rmse:.3f} MPa", fontsize=12)


def _curves(data: Any, axes: Any, lateral: bool) -> None:
    colours = [f"C{i}" for i in range(10)]
    band = data["member_axial_stress"].values
    for i, name in enumerate(data["curve_name"].values):
        n = int(data["step_count"].values[i])
        measured, law = (since_first(data[k].values[i, :n]) for k in ("strain_measured", "strain"))
        x = -100.0 * measured[:, 1]
        colour = colours[i % 10]
        fitted = str(data["role"].values[i]) == "fit"
        if lateral:
            y, z = 100.0 * measured[:, 0], 100.0 * law[:, 0]
        else:
            y, z = (-1e-6 * data[k].values[i, :n, 1] for k in ("stress_measured", "stress"))
            if not fitted and "axial_stress_error" in data:
                reach = 1.96e-6 * data["axial_stress_error"].values[i, :n]
                axes.fill_between(x, z - reach, z + reach, color=colour, alpha=0.12, lw=0)
            if len(band) > 1:
                b = -1e-6 * band[:, i, :n]
                axes.fill_between(x, b.min(axis=0), b.max(axis=0), color=colour, alpha=0.2, lw=0)
        axes.plot(x, y, "." if fitted else "x", color=colour, ms=4, alpha=0.6)
        error = f", {float(data['stress_rmse'].values[i]) / 1e6:.2f} MPa" if not lateral else ""
        axes.plot(x, z, "-" if fitted else "--", color=colour, lw=1.6, label=f"{name}{error}")
    axes.set_xlabel("axial strain, % (compression positive)")
    axes.set_ylabel(
        "lateral strain, % (extension positive)" if lateral else "axial stress, MPa (compression positive)"
    )
    axes.set_title(
        "lateral strain"
        if lateral
        else "points: curves; lines: law; bands: near-optimal sets, 95 % where not fitted",
        fontsize=10,
        loc="left",
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3)


def _parameters(data: Any, axes: Any) -> None:
    """Each parameter in its range, with two standard errors; those the curves do not see are grey."""
    names = [str(n) for n in data["parameter_name"].values]
    low, high = data["lower"].values, data["upper"].values
    log = data["log_scale"].values.astype(bool)
    value, error = data["value"].values, data["standard_error"].values
    members = data["member_value"].values

    def place(v: np.ndarray) -> np.ndarray:
        safe = np.where(log, np.clip(v, low, None), 1.0)
        with np.errstate(invalid="ignore"):
            return np.where(log, np.log(safe / np.where(log, low, 1.0)) / np.log(np.where(log, high / low, math.e)),
                            (v - low) / (high - low))  # fmt: skip

    at = place(value)
    spread = np.nan_to_num(
        np.where(log, error / value / np.log(np.where(log, high / low, math.e)), error / (high - low))
    )
    rows = np.arange(len(names))
    for m in members:
        axes.plot(place(m), rows, "|", color="C0", alpha=0.35, ms=9)
    for i in rows:
        known = bool(data["identifiable"].values[i])
        held = bool(data["at_bound"].values[i])
        colour = "C3" if held else "C0" if known else "0.6"
        axes.errorbar(at[i], i, xerr=min(2.0 * spread[i], 1.0), fmt="o", color=colour, capsize=3, ms=5)
    axes.set_yticks(rows, names, fontsize=7)
    axes.invert_yaxis()
    axes.set_xlim(-0.05, 1.05)
    axes.set_xticks([0, 0.5, 1], ["lower", "", "upper"])
    axes.set_title(
        "values in their bounds, +- 2 standard errors\nred: at a bound; grey: not seen by the curves", fontsize=9
    )
    axes.grid(alpha=0.3)


def _correlation(data: Any, axes: Any, figure: Any) -> None:
    matrix = data["correlation"].values
    image = axes.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
    names = [str(n) for n in data["parameter_name"].values]
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
    axes.set_yticks(range(len(names)), names, fontsize=6)
    axes.set_title("correlation (blank: held by a bound)", fontsize=9)
    figure.colorbar(image, ax=axes, shrink=0.7)


def _candidates(data: Any, axes: Any) -> None:
    """Each law's error where it was fitted, where it was not, and on each curve held out."""
    fitted, holdout = data["candidate_rmse"].values / 1e6, data["candidate_holdout_rmse"].values / 1e6
    names = [
        f"{name}\n{law}, {count} free"
        for name, law, count in zip(*(data[f"candidate_{k}"].values for k in ("name", "law", "parameters")))
    ]
    rows = np.arange(len(names))
    held = np.isfinite(holdout).any(axis=0)
    pooled = np.sqrt(np.mean(holdout[:, held] ** 2, axis=1))
    axes.barh(rows - 0.18, fitted, 0.34, color="0.85", label="fitted to all curves")
    axes.barh(rows + 0.18, pooled, 0.34, color="0.6", label="cross-validated")
    for i in np.flatnonzero(held):
        axes.plot(
            holdout[:, i],
            rows + 0.18,
            "o",
            ms=4,
            color=f"C{i % 10}",
            label=f"{data['curve_name'].values[i]} held out",
        )
    axes.set_yticks(rows, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("RMSE of axial stress, MPa")
    axes.legend(fontsize=8)
    axes.grid(alpha=0.3, axis="x")
