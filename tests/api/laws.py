"""A law from outside the package for the tests of this room: von Mises plasticity with Voce's hardening."""

import numpy as np

import graben

VOCE = (
    graben.Parameter("young_modulus", "Pa", 1.0, 1e15),
    graben.Parameter("poisson_ratio", "1", 0.0, 0.49),
    graben.Parameter("initial_yield", "Pa", 1.0, 1e15),
    graben.Parameter("gain", "Pa", 0.0, 1e15),
    graben.Parameter("rate", "1", 0.0, 1e6, 20.0),
)
STEEL = {"young_modulus": "200 GPa", "poisson_ratio": 0.3, "initial_yield": "300 MPa", "gain": 2e8, "rate": 20.0}


def voce(deps, sig, state, par, length):
    """Radial return to sigma_y = s0 + Q (1 - exp(-b p)), by Newton."""
    shear = par.young_modulus / (2.0 * (1.0 + par.poisson_ratio))
    bulk = par.young_modulus / (3.0 * (1.0 - 2.0 * par.poisson_ratio))
    volume = deps[0] + deps[1] + deps[2]
    mean = (sig[0] + sig[1] + sig[2]) / 3.0
    square = 0.0
    for i in range(sig.shape[0]):
        if i < 3:
            sig[i] += 2.0 * shear * (deps[i] - volume / 3.0) - mean
            square += sig[i] ** 2
        else:
            sig[i] += shear * deps[i]
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
