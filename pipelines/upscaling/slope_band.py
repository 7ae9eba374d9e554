"""The failure load of the slope as a band: what the curves leave open, and how wide the softening zones may be.

python pipelines/upscaling/slope_band.py CALIBRATION.nc SLOPE.toml -o BAND.json [--fidelity standard]
       [--draws 6] [--widths 3 5]

fem-run with parameter sets drawn from the normal distribution that calibrate's covariance describes, in fractions of
the ranges and kept inside them, at the scene's softening width; and with the best set at other widths, in m. The best
set at the scene's width is the slope's own run, named by --own, or is run too.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from graben.errors import NumericsFailed
from graben.mechanics.materials.laws import LAWS
from graben.schemas.artifact import read_artifact
from graben.schemas.plain import write_json
from graben.schemas.scenes.material import read_material, write_material
from graben.stages.fem_run import stage as fem_run


def drawn(
    value: np.ndarray, lower: np.ndarray, upper: np.ndarray, log: np.ndarray, root: np.ndarray, count: int
) -> np.ndarray:
    """Parameter sets (count, k) around value; root (k, d): covariance root root', in fractions of ranges."""

    def scaled(x: np.ndarray) -> np.ndarray:
        return np.where(log, np.log(np.where(log, x, 1.0)), x)

    low, high = scaled(lower), scaled(upper)
    centre = (scaled(value) - low) / (high - low)
    noise = np.random.Generator(np.random.PCG64(1)).standard_normal((count, root.shape[1]))
    unit = np.clip(centre + noise @ root.T, 0.0, 1.0)
    found = low + unit * (high - low)
    return np.where(log, np.exp(np.where(log, found, 0.0)), found)


def materials_of(calibration: Path, count: int) -> tuple[str, list[dict[str, Any]]]:
    """Law, and parameters in SI: the best set, then those drawn around it."""
    data = read_artifact(calibration, "calibration")
    law, best = read_material(calibration)
    # A combination that the curves do not see is as uncertain as a uniform distribution over the range.
    error = np.nan_to_num(data["direction_error"].values, nan=np.sqrt(1.0 / 12.0)).clip(max=np.sqrt(1.0 / 12.0))
    root = data["direction"].values.T * error
    value, lower, upper = (data[n].values for n in ("value", "lower", "upper"))
    rows = drawn(value, lower, upper, data["log_scale"].values.astype(bool), root, 10 * count)
    names = [str(n) for n in data["parameter_name"].values]
    sets = [best | dict(zip(names, map(float, row))) for row in rows]
    return law, [best, *[s for s in sets if not LAWS[law].faults(s)][:count]]


def load_of(scene: Path, law: str, values: dict[str, Any], folder: Path, settings: list[str]) -> float | None:
    """Failure load in Pa; 0 where the slope does not stand, None where the end of the loads came first."""
    material = folder / "set.material.toml"
    write_material(material, law, values)
    try:
        headline = fem_run.run(scene, folder / "set.nc", material=material, overrides=settings, overwrite=True)
    except NumericsFailed:
        return 0.0
    load = headline["failure_load_pa"]
    return None if load is None else float(load)


def main() -> None:
    """Run the sets and the widths, write and print the band."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("calibration", type=Path)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--fidelity", default="standard")
    parser.add_argument("--own", type=Path, help="JSON of fem-run with the best set, so that it is not run again")
    parser.add_argument("--draws", type=int, default=6)
    parser.add_argument("--widths", type=float, nargs="*", default=[3.0, 5.0])
    a = parser.parse_args()
    law, sets = materials_of(a.calibration, a.draws)
    fidelity = f'fidelity="{a.fidelity}"'
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if a.own is None:
            loads = [load_of(a.scene, law, sets[0], folder, [fidelity])]
        else:
            loads = [json.loads(a.own.read_text(encoding="utf-8"))["failure_load_pa"]]
        loads += [load_of(a.scene, law, values, folder, [fidelity]) for values in sets[1:]]
        by_width = [
            load_of(a.scene, law, sets[0], folder, [fidelity, f'softening_width="{width} m"']) for width in a.widths
        ]
    carried = [load for load in (*loads, *by_width) if load is not None]
    result = {
        "failure_load_low_pa": min(carried, default=None),
        "failure_load_high_pa": max(carried, default=None) if None not in (*loads, *by_width) else None,
        "drawn_failure_load_pa": loads[1:],
        "softening_width_m": a.widths,
        "width_failure_load_pa": by_width,
    }
    write_json(a.output, result)


if __name__ == "__main__":
    main()
