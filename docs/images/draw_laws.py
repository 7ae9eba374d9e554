"""Draw docs/images/law-*.png, one example per constitutive law. Run by hand after a law changes:

python docs/images/draw_laws.py
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from graben.mechanics.materials.laws import pack
from graben.mechanics.materials.point import follow

IMAGES = Path(__file__).parent
ROCK = {"young_modulus": 10e9, "poisson_ratio": 0.25}
STEEL = {"young_modulus": 210e9, "poisson_ratio": 0.3}
DRUCKER = {
    "young_modulus": 2e9, "poisson_ratio": 0.2, "friction_angle": 0.9, "dilation_angle": 0.5,
    "flow_stress_ratio": 0.85, "initial_yield": 5e4, "hardening_gain": 1e6, "hardening_rate": 300.0,
}  # fmt: skip
DUCTILE = {
    "damage": "ductile", "initiation_strain_050": 0.004, "initiation_strain_060": 0.012, "failure_displacement": 0.05,
}  # fmt: skip
QUASI_BRITTLE = {
    "young_modulus": 20e9, "poisson_ratio": 0.2, "dilation_angle": 0.4, "initial_yield": 10e6, "peak_yield": 30e6,
    "strain_at_peak": 0.002, "tensile_yield": 3e6, "tensile_decay": 2000.0, "compressive_damage": 0.6,
    "tensile_damage": 0.6, "largest_inelastic_strain": 0.02, "largest_cracking_strain": 0.01,
}  # fmt: skip


def compress(law: str, values: dict[str, Any], axial: NDArray[np.float64], cell: float = 0.0) -> NDArray[np.float64]:
    """Axial stress (Pa) along axial strains, the sides at `cell` (Pa, tension +); nan where none exists."""
    path = np.full((axial.size, 4), cell)
    path[:, 1], path[:, 3] = axial, 0.0
    r = follow(law, pack(law, values), "sese", path, stress=np.array([cell, cell, cell, 0.0]), parts=4)
    stress = r.stress[0, :, 1].copy()
    stress[int(r.reached[0]) + 1 :] = np.nan
    return stress


def picture(name: str, lines: list[tuple[NDArray[np.float64], NDArray[np.float64], str]], x: str, y: str) -> None:
    figure, axes = plt.subplots(figsize=(4.6, 2.9), dpi=80, layout="constrained")
    for a, b, label in lines:
        axes.plot(a, b, label=label, lw=1.5)
    axes.set(xlabel=x, ylabel=y)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, frameon=False)
    figure.savefig(IMAGES / f"law-{name}.png")
    plt.close(figure)


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    strain, stress = "axial shortening, %", "axial stress, MPa (compression +)"
    short = np.linspace(0.0, -0.02, 401)

    def squeezed(law: str, values: dict[str, Any], cells: tuple[float, ...], axial: NDArray[np.float64] = short):
        return [
            (-100 * axial, -1e-6 * compress(law, values, axial, -c), f"{c / 1e6:g} MPa on the sides") for c in cells
        ]

    picture("elastic", squeezed("elastic", ROCK, (0.0, 20e6), short[:41]), strain, stress)

    degrees = np.linspace(0.0, 90.0, 91)
    layered = {
        "young_modulus": 30e9, "young_modulus_across": 12e9, "poisson_ratio": 0.22, "poisson_ratio_across": 0.15,
    }  # fmt: skip
    lines = []
    for shear in (3e9, 5e9, 9e9):
        moduli = [
            compress("transverse-elastic", {**layered, "shear_modulus_across": shear, "axis_angle": a}, short[:2])[1]
            / short[1]
            for a in np.radians(90.0 - degrees)
        ]
        lines.append((degrees, 1e-9 * np.array(moduli), f"G' = {shear / 1e9:g} GPa"))
    picture("transverse-elastic", lines, "angle of load to the axis, deg", "Young's modulus, GPa")

    rows = [[0.0, 380e6], [0.02, 436e6], [0.2, 588e6], [1.0, 762e6]]
    pull = np.concatenate([np.linspace(0, 0.1, 200), np.linspace(0.1, 0.095, 50)])
    metal = {
        "table": {"hardening": rows},
        "linear": {"hardening": "linear", "initial_yield": 380e6, "hardening_modulus": 1.5e9},
        "exponential": {
            "hardening": "exponential", "initial_yield": 380e6, "hardening_gain": 200e6, "hardening_rate": 30.0,
        },
    }  # fmt: skip
    lines = [(100 * pull, 1e-6 * compress("j2", {**STEEL, **v}, pull), k) for k, v in metal.items()]
    picture("j2", lines, "axial strain, %", "axial stress, MPa")

    mohr = {
        **ROCK, "friction_angle": math.radians(35), "dilation_angle": math.radians(10), "cohesion": 2e6,
        "tensile_strength": 0.5e6,
    }  # fmt: skip
    picture("mohr-coulomb", squeezed("mohr-coulomb", mohr, (0.0, 2e6, 5e6), short[:101]), strain, stress)

    confining = (0.5e6, 1e6, 2e6)
    picture(
        "drucker-prager", squeezed("drucker-prager", {**DRUCKER, **DUCTILE}, confining, 2 * short), strain, stress
    )

    cycle = np.concatenate([np.linspace(0, 8e-4, 80), np.linspace(8e-4, -4e-3, 400), np.linspace(-4e-3, 0, 200)])
    lines = [(1e3 * cycle, 1e-6 * compress("lubliner", QUASI_BRITTLE, cycle), "tension, compression, unloading")]
    picture("lubliner", lines, "axial strain, 1e-3", "axial stress, MPa")

    crushed = {**QUASI_BRITTLE, "young_modulus": 30e9, "compressive_damage": 0.9, "largest_inelastic_strain": 0.003}
    axial = np.linspace(0, -0.005, 501)
    curves = {form: compress("lubliner", {**crushed, "crack_strain": form}, axial) for form in ("current", "printed")}
    lines = [
        (-100 * (axial - s / crushed["young_modulus"]), -1e-6 * s, f"crack_strain = {form}")
        for form, s in curves.items()
    ]
    picture("lubliner-crack-strain", lines, "e - s/E, %", stress)

    small = np.linspace(0, 4e-3, 400)
    relaxed = {**STEEL, "damage_threshold": 0.5e6, "hardening": [[0.0, 380e6], [1.0, 762e6]]}
    lines = [
        (1e3 * small, 1e-6 * compress("erve", {**relaxed, "max_damage_step": s}, small), f"step {s:g}")
        for s in (0.0, 0.002, 0.01)
    ]
    picture("erve", lines, "axial strain, 1e-3", "axial stress, MPa")

    brittle = {**STEEL, "hardening": "linear", "initial_yield": 150e6, "hardening_modulus": 20e9}
    lines = [
        (
            1e3 * small,
            1e-6 * compress("energy-damage", {**brittle, "damage_threshold": r, "split": "none"}, small),
            f"r_d = {r / 1e6:g} MPa",
        )
        for r in (0.04e6, 0.06e6, 0.08e6)
    ]
    picture("energy-damage", lines, "axial strain, 1e-3", "axial stress, MPa")


if __name__ == "__main__":
    main()
