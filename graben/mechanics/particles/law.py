"""Linear contact law H (4.11)-(4.12) as tables over pairs of particle classes, and the time step it allows.

A class is a set of spheres that share radius, density and stiffness. Tables over classes spare the contact loop a
division and a square root per contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused
from graben.mechanics.particles.dispatch import LawTables, LinearTable

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LinearLaw:
    """Stiffness, friction and viscous damping of contacts.

    Parameters
    ----------
    radius, density, normal_stiffness : (c,) per class, m, kg/m3, N/m. The stiffness is that of one body:
        two bodies in contact act in series, H (4.11).
    wall_stiffness : N/m, of floor, piston and side walls
    shear_ratio : k_t / k_n of particles and walls
    friction, wall_friction : Coulomb coefficients H (4.8); 0 switches tangential forces and rotation off
    damping, shear_damping : ratio of critical damping of a contact H (4.10), normal and tangential; 1 is critical
    """

    radius: Floats
    density: Floats
    normal_stiffness: Floats
    wall_stiffness: float
    shear_ratio: float = 0.8
    friction: float = 0.0
    wall_friction: float = 0.0
    damping: float = 0.3
    shear_damping: float = 0.3

    mass: Floats = field(init=False)  # (c,) kg
    pairs: LinearTable = field(init=False)  # (c, c)
    walls: LinearTable = field(init=False)  # (c, 1): all walls are of one class

    def __post_init__(self) -> None:
        arrays = {
            name: np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            for name in ("radius", "density", "normal_stiffness")
        }
        shape = arrays["radius"].shape
        for name, a in arrays.items():
            if a.ndim != 1 or a.shape != shape or a.size == 0:
                raise ValueError(f"{name}: expected one value per class, shape {shape}, found shape {a.shape}")
            if not np.all(np.isfinite(a) & (a > 0.0)):
                raise Refused(f"{name}: expected positive finite values, found {a.tolist()}")
            object.__setattr__(self, name, a)
        if not (np.isfinite(self.wall_stiffness) and self.wall_stiffness > 0.0):
            raise Refused(f"wall_stiffness: expected a positive value, found {self.wall_stiffness}")
        for name in ("shear_ratio", "friction", "wall_friction", "damping", "shear_damping"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0.0):
                raise Refused(f"{name}: expected zero or a positive value, found {value}")
        if self.rubs and self.shear_ratio == 0.0:
            raise Refused("shear_ratio: expected a positive value where friction acts, found 0")

        k = arrays["normal_stiffness"]
        mass = arrays["density"] * 4.0 / 3.0 * np.pi * arrays["radius"] ** 3
        reduced = mass[:, None] * mass[None, :] / (mass[:, None] + mass[None, :])
        kn = k[:, None] * k[None, :] / (k[:, None] + k[None, :])
        kw = k * self.wall_stiffness / (k + self.wall_stiffness)
        kt, kwt = self.shear_ratio * kn, self.shear_ratio * kw
        cn, ct = (2.0 * self.damping * np.sqrt(reduced * kn), 2.0 * self.shear_damping * np.sqrt(reduced * kt))
        cw, cwt = (2.0 * self.damping * np.sqrt(mass * kw), 2.0 * self.shear_damping * np.sqrt(mass * kwt))
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "pairs", LinearTable(kn, cn, kt, ct, np.full(kn.shape, float(self.friction))))
        one_class = [a[:, None] for a in (kw, cw, kwt, cwt, np.full(kw.shape, float(self.wall_friction)))]
        object.__setattr__(self, "walls", LinearTable(*map(np.ascontiguousarray, one_class)))

    @property
    def tables(self) -> LawTables:
        """What the kernels take."""
        return LawTables(self.pairs, self.walls)

    @property
    def rubs(self) -> bool:
        """True when tangential forces exist, so that history and rotation must be carried."""
        return self.friction > 0.0 or self.wall_friction > 0.0


def critical_step(law: LinearLaw) -> float:
    """Largest stable time step, s, estimated before any contact exists.

    A particle wrapped by as many neighbours as fit around it has stiffness Z K / 3 along any axis, and the largest
    frequency of the assembly obeys omega^2 <= 2 max(stiffness / mass) (Gershgorin). The explicit step then is
    2 / omega (sqrt(1 + xi^2) - xi), where xi = omega c / (2 K) since the dashpots sit beside the springs.
    """
    worst = np.inf
    pairs, walls = law.pairs, law.walls
    kt_weight = (2.0 + 2.0 / 0.4) if law.rubs else 0.0  # sliding and rolling share of the tangential springs
    for i, r in enumerate(law.radius):
        for j, s in enumerate(law.radius):
            touching = 0.81 * 2.0 / (1.0 - np.sqrt(1.0 - (s / (r + s)) ** 2))  # 12 for equal spheres
            k = touching / 3.0 * (pairs.kn[i, j] + kt_weight * pairs.kt[i, j])
            omega = np.sqrt(2.0 * k / law.mass[i])
            beta = max(
                pairs.cn[i, j] / pairs.kn[i, j],
                pairs.ct[i, j] / pairs.kt[i, j] if law.rubs and law.shear_ratio > 0 else 0.0,
            )
            xi = 0.5 * omega * beta
            worst = min(worst, 2.0 / omega * (np.sqrt(1.0 + xi * xi) - xi))
        k = 2.0 * (walls.kn[i, 0] + kt_weight * walls.kt[i, 0])
        omega = np.sqrt(k / law.mass[i])
        xi = 0.5 * omega * walls.cn[i, 0] / walls.kn[i, 0]
        worst = min(worst, 2.0 / omega * (np.sqrt(1.0 + xi * xi) - xi))
    return float(worst)
