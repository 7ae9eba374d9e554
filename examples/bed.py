"""A bed of two sizes of grains, poured and pressed: the grains, and the forces with which they push on the floor."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection

import graben

bed = graben.bed(
    "particles",
    seed=1,
    fidelity="draft",
    box={"width": "0.7 mm", "depth": "0.35 mm"},
    grains=[
        {"name": "coarse", "diameter": "150 um", "share": 0.7},
        {"name": "fine", "diameter": "100 um", "share": 0.3},
    ],
)
print(f"{len(bed.radius)} grains, solid fraction {bed.solid_fraction:.3f}, energy error {bed.energy_error:.2%}")

low = bed.position[:, 1] < 0.35e-3
touching = bed.floor_force > 0.0
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
order = np.flatnonzero(low)[np.argsort(-bed.position[low, 1])]
width, colours = 2e3 * bed.radius[order], np.array(["tab:brown", "tab:olive"])[bed.kind[order]]
grains = EllipseCollection(
    width, width, 0.0 * width, units="xy", offsets=1e3 * bed.position[order][:, [0, 2]],
    offset_transform=left.transData, facecolors=colours, edgecolors="k", linewidths=0.4,
)  # fmt: skip
left.add_collection(grains)
left.set(aspect="equal", title="the nearer half of the bed", xlabel="x [mm]", ylabel="height [mm]")
left.set(xlim=(-0.1, 0.8), ylim=(0.0, 1.05e3 * (bed.position[:, 2] + bed.radius).max()))
right.hist(1e6 * bed.floor_force[touching], bins=12, color="tab:gray", edgecolor="k")
right.set(title=f"{touching.sum()} grains push on the floor", xlabel="force [micronewton]", ylabel="grains")
figure.savefig("bed.png", dpi=120)
