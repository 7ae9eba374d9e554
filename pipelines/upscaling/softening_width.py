"""How wide are the zones in which a run of blocks shears? The measure behind slope.toml's softening_width.

python pipelines/upscaling/softening_width.py RUN.nc [--radius 4] [--smooth 0.6]

On a grid inside the averaging circle the shear strain between two saved states is the best linear fit to the
displacements of the vertices within `smooth` metres. Its mean squared over its mean square is the share of the circle
that takes part (1: all of it alike); times the root of the circle's area it is a width. Printed up to the peak of the
vertical stress and after it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from graben.schemas.artifact import read_artifact


def shear_strain(position: np.ndarray, move: np.ndarray, points: np.ndarray, smooth: float) -> np.ndarray:
    """Engineering shear strain sqrt(2 e:e), e deviatoric, at points (n, 2) from moves (v, 2) at positions (v, 2)."""
    near = cKDTree(position).query_ball_point(points, smooth)
    out = np.empty(len(points))
    for k, (point, rows) in enumerate(zip(points, near)):
        ahead = np.column_stack([np.ones(len(rows)), position[rows] - point])
        gradient = np.linalg.lstsq(ahead, move[rows], rcond=None)[0][1:]
        strain = 0.5 * (gradient + gradient.T)
        strain -= 0.5 * np.trace(strain) * np.eye(2)
        out[k] = np.sqrt(2.0 * (strain**2).sum())
    return out


def participation(shear: np.ndarray) -> float:
    """Share of equal areas that takes part in the shear: 1 where all do alike, 1/n where one of n does."""
    return float(shear.mean() ** 2 / (shear**2).mean())


def circle_grid(centre: np.ndarray, radius: float, step: float = 0.25) -> np.ndarray:
    """Points (n, 2) of a square grid inside a circle."""
    line = np.arange(-radius, radius + 0.5 * step, step)
    x, y = np.meshgrid(line, line)
    inside = x**2 + y**2 <= radius**2
    return centre + np.column_stack([x[inside], y[inside]])


def main() -> None:
    """Measure the runs named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=Path, nargs="+")
    parser.add_argument("--radius", type=float, default=4.0)
    parser.add_argument("--smooth", type=float, default=0.6)
    a = parser.parse_args()
    side = np.sqrt(np.pi) * a.radius
    for run in a.runs:
        data = read_artifact(run, "blocks")
        outline = data["outline"].values
        points = circle_grid(0.5 * (outline.min(axis=0) + outline.max(axis=0)), a.radius)
        position, moves = data["vertex_position"].values, data["displacement"].values
        peak = int(np.abs(data["wall_reaction"].values[:, 2, 1]).argmax())  # the top
        last = len(moves) - 1
        for name, begin, end in (("up to the peak", 0, peak), ("after it", peak, min(peak + 10, last))):
            if end > begin:
                part = participation(shear_strain(position, moves[end] - moves[begin], points, a.smooth))
                print(f"{run.name}: {name}, states {begin} to {end}: {part:.2f} of the circle, {part * side:.1f} m")


if __name__ == "__main__":
    main()
