"""Wear rate of mixtures of two sands: what a share of coarse grains does."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import graben

shares = np.linspace(0.0, 1.0, 11)
scene = {
    "kind": "wear",
    "machine": {"applied_load": "130 N"},
    "grains": [
        {
            "name": "coarse",
            "diameter": "200 um",
            "grooves": [{"force": "47 mN", "area": "2.0 um^2", "degree_of_wear": 0.4}],
        },
        {
            "name": "fine",
            "diameter": "100 um",
            "grooves": [{"force": "12 mN", "area": "0.5 um^2", "degree_of_wear": 0.37}],
        },
    ],
    "mixtures": [{"name": f"{s:.0%} coarse", "shares": {"coarse": s, "fine": 1.0 - s}} for s in shares],
    "load": {"mode": "balanced"},
}
result = graben.run(scene)
rates = {
    name: np.array([m["class_wear_rate_m3_per_s"][name] for m in result["mixtures"]]) for name in ("fine", "coarse")
}
print(f"fine alone {rates['fine'][0]:.3g} m3/s, coarse alone {rates['coarse'][-1]:.3g} m3/s")
for warning in result.warnings[:3]:
    print("warning:", warning)

figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
axes.stackplot(100 * shares, 1e9 * rates["fine"], 1e9 * rates["coarse"], labels=["by fine", "by coarse"], alpha=0.8)
axes.set(xlabel="volume share of coarse grains [%]", ylabel="wear rate [mm3/s]", xlim=(0, 100), ylim=(0, 6))
axes.legend(loc="lower left")
figure.savefig("wear.png", dpi=120)
