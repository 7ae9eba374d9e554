"""Linear transversely isotropic elasticity: layered or foliated rock with its axis of symmetry in the xy plane.

In local axes, 1 along the axis of symmetry (normal to the layers), 2 and 3 in the plane of isotropy,

    eps_1 = s_1 / E' - nu' (s_2 + s_3) / E'
    eps_2 = s_2 / E  - nu s_3 / E - nu' s_1 / E'
    gamma_12 = s_12 / G',   gamma_23 = 2 (1 + nu) s_23 / E

(S. G. Lekhnitskii, Theory of elasticity of an anisotropic body, 1963). It is positive definite when E, E', G' > 0,
-1 < nu < 1 and 1 - nu > 2 nu'^2 E / E'. The axis makes the angle `axis_angle` with x, counter-clockwise about z; z
lies in the plane of isotropy, so that plane strain stays plane.

par holds the turned stiffness, which `prepare_transverse` fills.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.declared.laws import PARAMETERS
from graben.mechanics.compiled import kernel
from graben.mechanics.materials.law import NOT_FINITE, OK, Law

_STIFFNESS = 6  # 36 slots, row by row, over (xx, yy, zz, xy, yz, zx) with engineering shears


@kernel(error_model="numpy")
def prepare_transverse(par):
    """Fill the stiffness slots of par from the five constants and the angle."""
    young, across, poisson, shear_across, angle = par[0], par[1], par[2], par[4], par[5]
    limit = math.sqrt(0.5 * (1.0 - 1e-6) * (1.0 - poisson) * across / young)
    par[3] = min(max(par[3], -limit), limit)
    poisson_across = par[3]
    ratio = young / across * poisson_across * poisson_across
    room = 1.0 - poisson - 2.0 * ratio
    local = np.zeros((6, 6))
    local[0, 0] = across * (1.0 - poisson) / room
    local[0, 1] = local[0, 2] = local[1, 0] = local[2, 0] = young * poisson_across / room
    local[1, 1] = local[2, 2] = young * (1.0 - ratio) / ((1.0 + poisson) * room)
    local[1, 2] = local[2, 1] = young * (poisson + ratio) / ((1.0 + poisson) * room)
    local[3, 3] = local[5, 5] = shear_across
    local[4, 4] = 0.5 * young / (1.0 + poisson)
    c, s = math.cos(angle), math.sin(angle)
    # local engineering strain from the strain in x, y, z
    turn = np.zeros((6, 6))
    turn[0, 0], turn[0, 1], turn[0, 3] = c * c, s * s, c * s
    turn[1, 0], turn[1, 1], turn[1, 3] = s * s, c * c, -c * s
    turn[2, 2] = 1.0
    turn[3, 0], turn[3, 1], turn[3, 3] = -2.0 * c * s, 2.0 * c * s, c * c - s * s
    turn[4, 4], turn[4, 5] = c, -s
    turn[5, 4], turn[5, 5] = s, c
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                for m in range(6):
                    total += turn[k, i] * local[k, m] * turn[m, j]
            par[_STIFFNESS + 6 * i + j] = total


@kernel(error_model="numpy")
def update_transverse(deps, sig, state, par, length, tangent):
    """The law `transverse-elastic`; arguments and return code as in `laws.update`."""
    n = deps.shape[0]
    size = 0.0
    for i in range(n):
        size += abs(deps[i]) + abs(sig[i])
    if not size < 1e140:
        return NOT_FINITE
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += par[_STIFFNESS + 6 * i + j] * deps[j]
        sig[i] += total
    for i in range(tangent.shape[0]):
        for j in range(n):
            tangent[i, j] = par[_STIFFNESS + 6 * i + j]
    return OK


def _check(values: Mapping[str, Any]) -> list[str]:
    room = 1.0 - values["poisson_ratio"]
    taken = 2.0 * values["poisson_ratio_across"] ** 2 * values["young_modulus"] / values["young_modulus_across"]
    if taken < room * (1.0 - 1e-7):
        return []
    return [
        "poisson_ratio_across: 2 nu'^2 E / E' below 1 - nu, otherwise straining sets energy free "
        f"(here {taken:.4g} against {room:.4g})"
    ]


TRANSVERSE = Law(
    id=6,
    name="transverse-elastic",
    title="linear transversely isotropic elasticity",
    parameters=PARAMETERS["transverse-elastic"],
    derived=tuple(f"c{i}{j}" for i in range(6) for j in range(6)),
    prepare=prepare_transverse,
    state_names=("equivalent_plastic_strain", "damage"),
    initial_state=lambda par: np.zeros(2),
    check=_check,
)
