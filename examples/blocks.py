"""Voronoi blocks of granite, compressed in plane strain: the blocks at the end, and stress against strain."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import graben

scene = {
    "kind": "blocks",
    "title": "a small specimen of granite blocks",
    "seed": 4,
    "fidelity": "draft",
    "domain": {"width": "3 m", "height": "4 m"},
    "tessellation": {"edge": "0.5 m"},
    "loading": {"confining_pressure": "4 MPa", "duration": "20 s", "states": 21},
    "output": {"vtk": False},
}
result = graben.run(scene)
print(result)

data = result.open()
place = data["vertex_position"].values + data["displacement"].values[-1]
zones = place[data["zone_vertex"].values]
stress = -data["zone_stress"].values[-1, :, 1] / 1e6
inside = graben.average(result, radius=1.3)

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 5), layout="constrained")
shade = PolyCollection(zones, array=stress, cmap="viridis", edgecolor="face", linewidth=0.2)
left.add_collection(shade)
left.autoscale_view()
left.set(aspect="equal", title="vertical compression at the end", xlabel="x [m]", ylabel="y [m]")
figure.colorbar(shade, ax=left, label="MPa")
right.plot(-100 * inside.strain[:, 1], -inside.stress[:, 1] / 1e6, "o-", label="axial")
right.plot(-100 * inside.strain[:, 1], -inside.stress[:, 0] / 1e6, "s--", label="lateral")
right.set(title="averages over a circle of 1.3 m", xlabel="axial shortening [%]", ylabel="compression [MPa]")
right.legend()
figure.savefig("blocks.png", dpi=120)
print("peak", round(float(np.max(-inside.stress[:, 1])) / 1e6, 2), "MPa")
