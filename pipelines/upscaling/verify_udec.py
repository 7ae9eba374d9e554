"""Hold voronoi-granite, many tessellations, against the UDEC curves in reference/.

python pipelines/upscaling/verify_udec.py RESULTS [--seeds 16] [--processes 2] [--fidelity standard] [--picture PNG]

Every seed and confinement goes through dem-run and homogenize (radius 4 m). Curves that are there already, made by
the same code from the same scene, are kept, so an interrupted call goes on where it stopped.
Writes RESULTS/udec.json.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from graben.schemas.plain import write_json

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
HERE = Path(__file__).resolve().parent
CONFINING_PA = (0.5e6, 1e6, 2e6, 4e6)
RADIUS_M = 4.0
# How far a mean may lie from UDEC's value.
WITHIN = {"peak_pa": 0.10, "strain_at_peak": 0.20, "modulus_pa": 0.15}
UNITS = {"peak_pa": ("MPa", 1e6), "strain_at_peak": ("%", 0.01), "modulus_pa": ("GPa", 1e9)}


def fingerprint(scene: Path, fidelity: str) -> str:
    """A name for what decides the curves: the scene and the sources of the block model and of the averages."""
    mechanics = HERE.parents[1] / "graben" / "mechanics"
    files = [file for room in ("blocks", "averaging", "plane") for file in (mechanics / room).rglob("*.py")]
    digest = hashlib.sha256(fidelity.encode())
    for file in [*sorted(files), scene]:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def one_curve(scene: Path, seed: int, confining: float, fidelity: str, output: Path) -> dict[str, float]:
    """Run one tessellation at one confinement and average it; returns the run's own error measures."""
    from graben.stages.dem_run import stage as dem_run
    from graben.stages.homogenize import stage as homogenize

    blocks = output.with_name(output.name.replace("curves", "blocks"))
    settings = [
        f"seed={seed}",
        f'fidelity="{fidelity}"',
        f'loading.confining_pressure="{confining} Pa"',
        "output.vtk=false",
    ]
    began = time.process_time()
    headline = dem_run.run(scene, blocks, overrides=settings, overwrite=True)
    homogenize.run([blocks], output, radii=[RADIUS_M], overwrite=True)
    blocks.unlink()
    measures = {k: v for k, v in headline.items() if isinstance(v, float | int)}
    measures["cpu_s"] = time.process_time() - began
    write_json(output.with_suffix(".json"), measures)
    return measures


def figures_of(stress: Any, strain: Any) -> dict[str, float]:
    """Peak, strain there, and the secant modulus of the first saved interval (compression positive, xx, yy)."""
    peak = int(stress[:, 1].argmax())
    return {
        "peak_pa": float(stress[peak, 1]),
        "strain_at_peak": float(strain[peak, 1]),
        "modulus_pa": float((stress[1, 1] - stress[0, 1]) / (strain[1, 1] - strain[0, 1])),
    }


def udec_curves() -> dict[float, tuple[Any, Any]]:
    """Confinement -> stress and strain since the first state (states, 2) as xx, yy, compression positive."""
    import numpy as np

    from graben.mechanics.fitting.curves import since_first

    with open(HERE / "reference" / "udec_voronoi_granite_fit.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    curves = {}
    for confining in CONFINING_PA:
        own = [r for r in rows if float(r["confining_stress_pa"]) == confining]
        stress = -np.array([[float(r["stress_xx_pa"]), float(r["stress_yy_pa"])] for r in own])
        strain = -np.array([[float(r["strain_xx"]), float(r["strain_yy"])] for r in own])
        curves[confining] = (stress, since_first(strain))
    return curves


def our_curves(path: Path) -> tuple[Any, Any]:
    """Stress and strain since the first state (states, 2) of an artifact of one path, compression positive."""
    from graben.mechanics.fitting.curves import since_first
    from graben.schemas.artifact import read_artifact

    data = read_artifact(path, "curves")
    n = int(data.step_count[0])
    return -data.stress.values[0, :n, :2], -since_first(data.strain.values[0, :n, :2])


def bands(curves: list[tuple[Any, Any]], at: Any) -> dict[str, Any]:
    """Vertical stress and lateral strain (seeds, at) at the given vertical strains; nan beyond a curve."""
    import numpy as np

    def sampled(values: Any, strain: Any) -> Any:
        return np.interp(at, strain, values, right=np.nan)

    return {
        "stress": np.array([sampled(s[:, 1], e[:, 1]) for s, e in curves]),
        "lateral": np.array([sampled(-e[:, 0], e[:, 1]) for s, e in curves]),
    }


def compare(files: dict[tuple[int, float], Path]) -> tuple[dict[str, Any], dict[float, Any]]:
    """The table of udec.json, and what the picture needs."""
    import numpy as np

    seeds = sorted({seed for seed, _ in files})
    result: dict[str, Any] = {"confining_pa": list(CONFINING_PA), "seeds": seeds, "radius_m": RADIUS_M}
    names = tuple(WITHIN)
    for group in ("udec", "std", "standard_error", "quantile_05", "quantile_95", "per_seed", "error"):
        result[group] = {name: [] for name in names}
    for name in names:
        result[name] = []
    result["misses"] = []
    result["inside"] = {"peak": [], "stress_share": [], "lateral_share": []}
    drawn = {}
    for confining, (stress, strain) in udec_curves().items():
        ours = [our_curves(files[seed, confining]) for seed in seeds]
        udec = figures_of(stress, strain)
        own = [figures_of(*curve) for curve in ours]
        where = f"{confining / 1e6:g} MPa"
        for name in names:
            values = np.array([figures[name] for figures in own])
            low, high = np.quantile(values, [0.05, 0.95])
            error = float(values.mean() / udec[name] - 1.0)
            result[name].append(float(values.mean()))
            result["udec"][name].append(udec[name])
            result["std"][name].append(float(values.std(ddof=1)))
            result["standard_error"][name].append(float(values.std(ddof=1) / np.sqrt(len(values))))
            result["quantile_05"][name].append(float(low))
            result["quantile_95"][name].append(float(high))
            result["per_seed"][name].append(values.tolist())
            result["error"][name].append(error)
            if abs(error) > WITHIN[name]:
                result["misses"].append(f"{name} at {where}: {100 * error:+.1f} % (limit {100 * WITHIN[name]:.0f} %)")
            if name == "peak_pa":
                inside = bool(low <= udec[name] <= high)
                result["inside"]["peak"].append(inside)
                if not inside:
                    result["misses"].append(f"UDEC's peak at {where} lies outside the central 90 % of seeds")
        upto = int(stress[:, 1].argmax())
        band = bands(ours, strain[1 : upto + 1, 1])
        for name, reference in (("stress", stress[1 : upto + 1, 1]), ("lateral", -strain[1 : upto + 1, 0])):
            within = (np.nanmin(band[name], axis=0) <= reference) & (reference <= np.nanmax(band[name], axis=0))
            share = float(within.mean())
            result["inside"][f"{name}_share"].append(share)
            if share < 1.0:
                out = 100 * strain[1 : upto + 1, 1][~within]
                result["misses"].append(
                    f"UDEC's {name} curve at {where} leaves the band of seeds at {(~within).sum()} of {len(within)} "
                    f"states up to the peak ({out.min():.2f} to {out.max():.2f} % strain)"
                )
        drawn[confining] = (stress, strain, ours)
    return result, drawn


def picture(drawn: dict[float, Any], path: Path) -> None:
    """Bands of the seeds (all, and the central 90 %) with UDEC's curves."""
    import matplotlib
    import numpy as np

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 4, figsize=(13, 6.2), sharex=True, constrained_layout=True)
    at = np.linspace(0.0, 0.05, 101)
    for column, (confining, (stress, strain, ours)) in enumerate(drawn.items()):
        band = bands(ours, at)
        for row, (name, scale, label) in enumerate(
            (("stress", 1e6, "vertical stress, MPa"), ("lateral", 0.01, "lateral strain, %"))
        ):
            axis = axes[row, column]
            reached = np.isfinite(band[name]).sum(axis=0) > len(ours) // 2
            low, q05, mean, q95, high = (
                f(band[name][:, reached]) / scale
                for f in (
                    lambda b: np.nanmin(b, axis=0),
                    lambda b: np.nanquantile(b, 0.05, axis=0),
                    lambda b: np.nanmean(b, axis=0),
                    lambda b: np.nanquantile(b, 0.95, axis=0),
                    lambda b: np.nanmax(b, axis=0),
                )
            )
            e = 100 * at[reached]
            axis.fill_between(e, low, high, color="tab:blue", alpha=0.15, lw=0, label=f"{len(ours)} seeds, all")
            axis.fill_between(e, q05, q95, color="tab:blue", alpha=0.25, lw=0, label="central 90 %")
            axis.plot(e, mean, color="tab:blue", lw=1.2, label="mean")
            axis.plot(
                100 * strain[:, 1], (stress[:, 1] if row == 0 else -strain[:, 0]) / scale, "k-", lw=1.2, label="UDEC"
            )
            axis.grid(alpha=0.3)
            if column == 0:
                axis.set_ylabel(label)
        axes[0, column].set_title(f"confinement {confining / 1e6:g} MPa")
        axes[1, column].set_xlabel("vertical strain, %")
    axes[0, 0].legend(frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)


def show(result: dict[str, Any]) -> None:
    """A table for a person."""
    for name, (unit, scale) in UNITS.items():
        print(f"{name}, {unit}: confinement | mean of seeds +- their std | UDEC | error")
        for k, confining in enumerate(CONFINING_PA):
            ours, spread, udec = (g[name][k] / scale for g in (result, result["std"], result["udec"]))
            error = 100 * result["error"][name][k]
            print(f"  {confining / 1e6:>4g} MPa | {ours:6.2f} +- {spread:5.2f} | {udec:6.2f} | {error:+5.1f} %")
    for miss in result["misses"]:
        print(f"MISS {miss}")


def main() -> None:
    """Parse arguments, run what is missing, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--fidelity", default="standard")
    parser.add_argument("--scene", type=Path, default=HERE / "voronoi-granite.toml")
    parser.add_argument("--picture", type=Path, help="picture to write; RESULTS/udec-band.png unless given")
    a = parser.parse_args()
    folder = a.results / f"udec-{fingerprint(a.scene, a.fidelity)}"
    folder.mkdir(parents=True, exist_ok=True)
    files = {
        (seed, confining): folder / f"curves-{seed:02d}-{confining / 1e6:g}MPa.nc"
        for seed in range(1, a.seeds + 1)
        for confining in CONFINING_PA
    }
    missing = {k: f for k, f in files.items() if not f.with_suffix(".json").exists()}
    failed = []
    with ProcessPoolExecutor(max_workers=a.processes) as pool:
        jobs = {pool.submit(one_curve, a.scene, *k, a.fidelity, f): f for k, f in missing.items()}
        for n, job in enumerate(as_completed(jobs), 1):
            fault = job.exception()
            if fault is not None:
                failed.append(f"{jobs[job].name}: {fault}")
            print(f"{n}/{len(jobs)} {jobs[job].name} {fault or ''}", flush=True)
    if failed:
        raise SystemExit("\n".join(failed))
    result, drawn = compare(files)
    own = [json.loads(f.with_suffix(".json").read_text()) for f in files.values()]
    result["fidelity"], result["curves"] = a.fidelity, str(folder)
    result["cpu_s"] = sum(m["cpu_s"] for m in own)
    result["largest_energy_error"] = max(m["energy_error"] for m in own)
    write_json(a.results / "udec.json", result, indent=1)
    picture(drawn, a.picture or a.results / "udec-band.png")
    show(result)


if __name__ == "__main__":
    main()
