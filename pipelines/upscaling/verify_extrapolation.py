"""How far do parameters carry that were fitted at 0.5 to 4 MPa? Judged on our own blocks at 3, 6, 8 and 10 MPa.

python pipelines/upscaling/verify_extrapolation.py RESULTS [--seeds 3 8 7 16] [--processes 2] [--picture PNG]

Each variant (hardening form, weights) is fitted to the curves of every tessellation at 0.5, 1, 2 and 4 MPa and
predicts the same tessellation at 3, 6, 8 and 10 MPa; then fitted to UDEC's curves, it predicts all of them. The seeds
are the four of 1 to 16 whose curves up to 4 MPa lie nearest to UDEC's. Curves of verify_udec.py are used again.
Writes RESULTS/extrapolation.json.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from verify_udec import CONFINING_PA, HERE, fingerprint, one_curve

from graben.schemas.plain import write_json

UNSEEN_PA = (3e6, 6e6, 8e6, 10e6)
QUICK = ['search="dds"', "swarm.starts=2", "increments=1"]
EQUAL = ['weights.normalise="all"', "weights.last=0.5", "weights.strain=0.02", "seed=1"]
BY_CURVE = ['weights.normalise="curve"', "weights.strain=0.05"]
VARIANTS = {
    "exponential": ("calibrate-udec.toml", []),
    "exponential, lateral strain 0.1": ("calibrate-udec.toml", ["weights.strain=0.1"]),
    "exponential, ends of curves 0.2": ("calibrate-udec.toml", ["weights.last=0.2"]),
    "exponential, each curve alike": ("calibrate-udec.toml", BY_CURVE),
    "barcelona": ("laws/barcelona.toml", EQUAL),
    "barcelona, each curve alike": ("laws/barcelona.toml", [*EQUAL, *BY_CURVE]),
    "undamaged": ("laws/undamaged.toml", EQUAL),
}


def rms(values: list[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def fit(variant: str, curves: list[Path], unseen: list[Path], output: Path) -> tuple[float, float]:
    """RMSE in Pa of a variant's fit to curves, and of its prediction of the curves of unseen."""
    from graben.stages.calibrate import stage as calibrate

    scene, settings = VARIANTS[variant]
    found = calibrate.run(
        HERE / scene, output, curves=curves, validate=unseen, overrides=[*QUICK, *settings], overwrite=True
    )
    return float(found["rmse_pa"]), float(found["validation_rmse_pa"])


def judge(files: dict[tuple[int, float], Path], folder: Path) -> dict[str, Any]:
    """A row per variant."""
    seeds = sorted({seed for seed, _ in files})
    udec = HERE / "reference" / "udec_voronoi_granite_fit.csv"
    out = folder / "calibration.nc"
    everywhere = [files[s, c] for s in seeds for c in UNSEEN_PA]
    rows: dict[str, Any] = {}
    for variant in VARIANTS:
        own = [
            fit(variant, [files[s, c] for c in CONFINING_PA], [files[s, c] for c in UNSEEN_PA], out) for s in seeds
        ]
        fitted, predicted = fit(variant, [udec], everywhere, out)
        rows[variant] = {
            "own_fit_rmse_pa": rms([f for f, _ in own]),
            "own_unseen_rmse_pa": rms([u for _, u in own]),
            "udec_fit_rmse_pa": fitted,
            "udec_to_own_unseen_rmse_pa": predicted,
        }
        print(variant, {k: round(v / 1e6, 2) for k, v in rows[variant].items()}, flush=True)
    every = [
        fit("exponential", [files[s, c] for c in (*CONFINING_PA, *UNSEEN_PA)], [files[s, 10e6]], out)[0]
        for s in seeds
    ]
    return {"seeds": seeds, "unseen_pa": list(UNSEEN_PA), "variants": rows, "fit_to_all_rmse_pa": rms(every)}


def picture(files: dict[tuple[int, float], Path], folder: Path, path: Path) -> None:
    """Our curves at all confinements with the law fitted to ours and to UDEC's up to 4 MPa."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from graben.schemas.artifact import read_artifact

    seeds = sorted({seed for seed, _ in files})
    figure, axes = plt.subplots(1, len(seeds), figsize=(3.6 * len(seeds), 4.2), sharey=True, constrained_layout=True)
    udec = HERE / "reference" / "udec_voronoi_granite_fit.csv"
    for axis, seed in zip(np.atleast_1d(axes), seeds):
        own = [files[seed, c] for c in CONFINING_PA]
        unseen = [files[seed, c] for c in UNSEEN_PA]
        for curves, color, label in ((own, "tab:blue", "these blocks"), ([udec], "tab:red", "UDEC's curves")):
            out = folder / "calibration.nc"
            fit("exponential", curves, unseen, out)
            data = read_artifact(out, "calibration")
            for k in np.flatnonzero(data["role"].values == "validation"):
                strain = -100 * data["strain_measured"].values[k, :, 1]
                if color == "tab:blue":
                    axis.plot(strain, -data["stress_measured"].values[k, :, 1] / 1e6, "k", lw=1)
                axis.plot(strain, -data["stress"].values[k, :, 1] / 1e6, "--", color=color, lw=1.2)
            axis.plot([], [], "--", color=color, label=f"law, fitted to {label} up to 4 MPa")
        axis.plot([], [], "k", label="blocks at 3, 6, 8, 10 MPa")
        axis.set_title(f"seed {seed}")
        axis.set_xlabel("vertical strain, %")
        axis.grid(alpha=0.3)
    np.atleast_1d(axes)[0].set_ylabel("vertical stress, MPa")
    np.atleast_1d(axes)[0].legend(frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)


def main() -> None:
    """Parse arguments, run the blocks that are missing, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[3, 8, 7, 16])
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--curves", type=Path, help="folder of curves made before; RESULTS/udec-... unless given")
    parser.add_argument("--picture", type=Path)
    a = parser.parse_args()
    scene = HERE / "voronoi-granite.toml"
    folder = a.curves or a.results / f"udec-{fingerprint(scene, 'standard')}"
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        (seed, confining): folder / f"curves-{seed:02d}-{confining / 1e6:g}MPa.nc"
        for seed in a.seeds
        for confining in (*CONFINING_PA, *UNSEEN_PA)
    }
    missing = {k: f for k, f in files.items() if not f.exists()}
    with ProcessPoolExecutor(max_workers=a.processes) as pool:
        jobs = [pool.submit(one_curve, scene, *k, "standard", f) for k, f in missing.items()]
        for job in jobs:
            job.result()
    result = judge(files, a.results)
    write_json(a.results / "extrapolation.json", result, indent=1)
    if a.picture:
        picture(files, a.results, a.picture)


if __name__ == "__main__":
    main()
