"""From contacts and grooves to a wear rate, H (8.13)-(8.14), and the balance of forces that H leaves out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from graben.errors import Refused

Floats = NDArray[np.float64]

# groove area of a ball that ploughs a rigid-plastic half-space: A_g ~ F^(3/2) (see GrooveTable)
PLOUGHING_EXPONENT = 1.5


def wear_rates(contacts: Floats, area: float, degree_of_wear: Floats, groove_area: Floats, speed: float) -> Floats:
    """Volume worn per second by each class (c,), m3/s: N_i A f_ab,i A_g,i v_t, H (8.13)-(8.14).

    contacts (c,) 1/m2; area m2 of tool in contact; degree_of_wear (c,) f_ab; groove_area (c,) m2; speed m/s
    """
    contacts, degree_of_wear, groove_area = (
        np.asarray(a, dtype=np.float64) for a in (contacts, degree_of_wear, groove_area)
    )
    if not contacts.shape == degree_of_wear.shape == groove_area.shape:
        raise Refused(
            "expected one value per class, found shapes "
            f"{contacts.shape}, {degree_of_wear.shape}, {groove_area.shape}"
        )
    return contacts * area * degree_of_wear * groove_area * speed


def carried_load(contacts: Floats, area: float, force: Floats) -> float:
    """Load that the contacts carry together, N: sum N_i A F_i."""
    return float(np.sum(np.asarray(contacts) * area * np.asarray(force)))


def balanced_forces(contacts: Floats, area: float, load: float, relative: Floats) -> Floats:
    """Force per contact (c,) N such that all contacts together carry `load`.

    relative (c,): force per contact of each class relative to the others, e.g. ones, or D_i^2, or measured in a bed
    """
    contacts, relative = np.asarray(contacts, dtype=np.float64), np.asarray(relative, dtype=np.float64)
    if np.any(relative < 0.0):
        raise Refused(f"relative: expected values >= 0, found {relative.tolist()}")
    total = float(np.sum(contacts * relative)) * area
    if not total > 0.0:
        raise Refused("no contact carries the load")
    return load / total * relative


def refuse_buried(name: str, area: float, radius: float) -> None:
    """Refused where a groove (m2) is larger than a grain of this radius (m) leaves when half of it is sunk in."""
    largest = 0.5 * np.pi * radius**2
    if area > largest:
        raise Refused(
            f"{name}: a groove of at most {largest:.4g} m2, half of the grain's own section; "
            f"{area:.4g} m2 would bury it"
        )


@dataclass(frozen=True)
class GrooveTable:
    """Grooves known at some forces, and what follows for others.

    Law: a scratch by a rigid ball in a medium without a length of its own depends on F / R^2 alone, so A_g / R^2 and
    f_ab are functions of F / R^2. Between samples ln(A_g / R^2) is linear in ln(F / R^2). Outside them the
    exponent is 3/2: a ball that ploughs a rigid-plastic half-space at constant pressure has half-width
    a ~ F^(1/2) and a groove of area 2/3 a^3 / R. f_ab is linear in ln(F / R^2) and constant outside.

    Limits: shallow grooves (a < R), full plasticity (F far above first yield), no size effect, no cutting.

    Parameters: force (k,) N, radius (k,) m of the grains that made the grooves, area (k,) m2, degree (k,)
    """

    force: Floats
    radius: Floats
    area: Floats
    degree: Floats

    def __post_init__(self) -> None:
        arrays = {
            n: np.atleast_1d(np.asarray(getattr(self, n), dtype=np.float64))
            for n in ("force", "radius", "area", "degree")
        }
        shape = arrays["force"].shape
        if len(shape) != 1 or shape[0] == 0 or any(a.shape != shape for a in arrays.values()):
            raise ValueError(f"expected the same number of values each, found {[a.shape for a in arrays.values()]}")
        for name in ("force", "radius", "area"):
            if not np.all(np.isfinite(arrays[name]) & (arrays[name] > 0.0)):
                raise Refused(f"{name}: expected positive values, found {arrays[name].tolist()}")
        order = np.argsort(arrays["force"] / arrays["radius"] ** 2, kind="stable")
        for name, a in arrays.items():
            object.__setattr__(self, name, a[order])
        if np.any(np.diff(self.force / self.radius**2) <= 0.0):
            raise Refused("two grooves have the same force over radius squared; keep one")

    def at(self, force: float, radius: float) -> tuple[float, float]:
        """Groove area m2 and degree of wear at a force N of a grain of radius m; force 0 leaves no groove."""
        if force <= 0.0:
            return 0.0, float(self.degree[0])
        s = np.log(force / radius**2)
        known = np.log(self.force / self.radius**2)
        size = np.log(self.area / self.radius**2)
        inside = float(np.clip(s, known[0], known[-1]))
        log_area = float(np.interp(inside, known, size)) + PLOUGHING_EXPONENT * (s - inside)
        return float(np.exp(log_area)) * radius**2, float(np.interp(inside, known, self.degree))

    def doubts(self, force: float, radius: float) -> list[str]:
        """Words about an estimate that lies far outside the known grooves; empty when it does not."""
        s = force / radius**2
        known = self.force / self.radius**2
        for beyond, word in ((known[0] / s if s > 0 else np.inf, "below"), (s / known[-1], "above")):
            if beyond > 3.0:
                return [
                    f"a force of {force:.3g} N lies {beyond:.3g} times {word} the known grooves: "
                    "area by the 3/2 power of force, degree of wear held"
                ]
        return []
