"""A law of one's own: von Mises with Voce hardening, followed at a point, then in a plate with a hole."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import graben

PARAMETERS = [
    graben.Parameter("young_modulus", "Pa", lower=1.0, upper=1e15),
    graben.Parameter("poisson_ratio", "1", lower=0.0, upper=0.49),
    graben.Parameter("initial_yield", "Pa", lower=1.0, upper=1e15),
    graben.Parameter("gain", "Pa", lower=0.0, upper=1e15),
    graben.Parameter("rate", "1", lower=0.0, upper=1e6),
]


@graben.law("voce", PARAMETERS, state=["equivalent_plastic_strain"])
def voce(deps, sig, state, par, length):
    """Von Mises plasticity with strength s0 + Q (1 - exp(-b p)); no tangent: graben finds it by differences."""
    shear = par.young_modulus / (2.0 * (1.0 + par.poisson_ratio))
    bulk = par.young_modulus / (3.0 * (1.0 - 2.0 * par.poisson_ratio))
    volume = deps[0] + deps[1] + deps[2]
    mean = (sig[0] + sig[1] + sig[2]) / 3.0
    square = 0.0
    for i in range(len(sig)):
        if i < 3:
            sig[i] += 2.0 * shear * (deps[i] - volume / 3.0) - mean
            square += sig[i] ** 2
        else:
            sig[i] += shear * deps[i]  # shear strains are engineering ones
            square += 2.0 * sig[i] ** 2
    q = np.sqrt(1.5 * square)
    more, left = 0.0, par.gain * np.exp(-par.rate * state[0])
    if q > par.initial_yield + par.gain - left:
        for _ in range(50):
            soft = left * np.exp(-par.rate * more)
            step = (q - 3.0 * shear * more - par.initial_yield - par.gain + soft) / (3.0 * shear + par.rate * soft)
            more += step
            if abs(step) <= 1e-15 * more:
                break
        sig *= 1.0 - 3.0 * shear * more / q
    state[0] += more
    for i in range(3):
        sig[i] += mean + bulk * volume
    return 0


steel = graben.material(
    "voce", young_modulus="200 GPa", poisson_ratio=0.3, initial_yield="300 MPa", gain="200 MPa", rate=20.0
)
path = graben.follow(steel, np.linspace(0.0, -0.1, 60), mode="triaxial")
plastic = path.state["equivalent_plastic_strain"]
exact = 300.0 + 200.0 * (1.0 - np.exp(-20.0 * plastic))

# A quarter of a plate, 2 m by 2 m, with a hole of radius 0.5 m; pressed on top.
angle = np.linspace(0.0, np.pi / 2, 9)
arc = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
outline = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), *arc[::-1]]
mesh = graben.mesh.paved(outline, 0.08)
found = graben.plane_analysis(
    mesh,
    steel,
    supports=[
        {"start": (0.5, 0.0), "end": (1.0, 0.0), "fix": "y"},
        {"start": (0.0, 0.5), "end": (0.0, 1.0), "fix": "x"},
    ],
    loads=[{"name": "press", "start": (0.0, 1.0), "end": (1.0, 1.0), "rate": "10 MPa/s"}],
    stepping={"goal": "end", "end": "16 s", "first": "2 s", "largest": "4 s", "save_every": "16 s"},
)
print({name: found.headline[name] for name in ("largest_load_pa", "settlement_m", "energy_error", "steps")})

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
left.plot(-100 * path.strain[:, 1], -path.stress[:, 1] / 1e6, label="point")
left.plot(-100 * path.strain[plastic > 0, 1], exact[plastic > 0], "k:", label="closed form")
left.set(title="uniaxial compression", xlabel="shortening [%]", ylabel="compression [MPa]", ylim=(0, None))
left.legend()
moved = mesh.points + 5.0 * found.displacement[-1]
shade = PolyCollection(moved[mesh.quads], array=100 * found.plastic_strain[-1], cmap="magma_r", edgecolor="0.7")
right.add_collection(shade)
right.autoscale_view()
right.set(aspect="equal", title="plate at 160 MPa, movement drawn five times", xlabel="x [m]", ylabel="y [m]")
figure.colorbar(shade, ax=right, label="plastic strain [%]")
figure.savefig("own_law.png", dpi=120)
