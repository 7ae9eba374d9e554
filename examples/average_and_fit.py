"""From blocks to a continuum law: runs at two lateral stresses, averaged over a circle, and a law fitted to both."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import graben

scene = {
    "kind": "blocks",
    "seed": 2,
    "fidelity": "draft",
    "domain": {"width": "3 m", "height": "3 m"},
    "tessellation": {"edge": "0.6 m"},
    "loading": {"duration": "12 s", "states": 13},
    "output": {"vtk": False},
}
averages = {}
for lateral in ("1 MPa", "4 MPa"):
    result = graben.run(scene, set={"loading.confining_pressure": lateral})
    averages[lateral] = graben.average(result, radius="1.2 m")

found = graben.fit(
    averages,
    law="drucker-prager",
    free={
        "young_modulus": {"lower": "0.5 GPa", "upper": "25 GPa", "scale": "log"},
        "friction_angle": ("40 deg", "62 deg"),
        "dilation_angle": ("5 deg", "60 deg"),
        "hardening_gain": {"lower": "0.1 MPa", "upper": "200 MPa", "scale": "log"},
        "hardening_rate": {"lower": 10.0, "upper": 5000.0, "scale": "log"},
    },
    fixed={"hardening": "exponential", "initial_yield": "50 kPa", "poisson_ratio": 0.2, "flow_stress_ratio": 0.8},
    fidelity="draft",
)
for name, value in found.parameters.items():
    error = found.standard_errors[name]
    print(f"{name:16} {value:10.4g}" + ("" if error is None else f" +- {error:.2g}"))
print(f"misfit {found.rmse / 1e6:.2g} MPa", *found.warnings, sep="\n")

figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
for (name, measured), colour in zip(averages.items(), ("tab:blue", "tab:red"), strict=True):
    axes.plot(-100 * measured.strain[:, 1], -measured.stress[:, 1] / 1e6, "o", color=colour, label=f"blocks, {name}")
    fitted = found.stress[name]
    axes.plot(-100 * found.strain[name][:, 1], -fitted[:, 1] / 1e6, color=colour, label="Drucker-Prager")
axes.set(xlabel="axial shortening [%]", ylabel="axial compression [MPa]")
axes.legend()
figure.savefig("average_and_fit.png", dpi=120)
