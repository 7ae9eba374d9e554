"""What a bed is made of, and what is done to it; the checks that come before."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.particles.law import LinearLaw
from graben.mechanics.particles.records import Floats, Ints

# solid fraction by which a nominal depth is turned into a number of grains
NOMINAL_FRACTION = 0.6


@dataclass(frozen=True)
class BedRecipe:
    """What is poured, and what is done to it.

    share : (c,) volume share of each class, theta_i of H (8.9); sums to 1
    width : (2,) m; depth : m, of the bed before pressing (nominal: solid fraction 0.6)
    loose_fraction : solid fraction of the inserted column
    gravity : m/s2; pressure : Pa on top
    shakes : cycles of the floor, z = amplitude sin(2 pi frequency t), amplitude m, frequency Hz
    rest : kinetic energy over (weight x smallest radius) at which a bed is at rest
    balance : unbalanced force ratio at which the quenched bed is at rest; ten times as much ends the phases before it
        (settling without friction between grains: CREEPING)
    energy_limit : allowed relative error of the energy balance
    """

    share: Floats
    width: tuple[float, float]
    depth: float
    pressure: float
    gravity: float = 9.81
    periodic: bool = True
    loose_fraction: float = 0.25
    shakes: int = 0
    shake_amplitude: float = 0.0
    shake_frequency: float = 0.0
    safety: float = 0.4
    rest: float = 1e-3
    balance: float = 1e-3
    energy_limit: float = 0.05
    ramp: float = 5.0  # half periods of the slowest mode over which the pressure rises
    max_steps: int = 2_000_000


def numbers(law: LinearLaw, recipe: BedRecipe) -> Ints:
    """Particles of each class (c,) for the nominal depth. Raises Refused for an empty bed."""
    share = np.asarray(recipe.share, dtype=np.float64)
    if share.shape != law.radius.shape or np.any(share < 0.0) or abs(share.sum() - 1.0) > 1e-6:
        raise Refused(f"share: expected {law.radius.size} shares >= 0 with sum 1, found {share.tolist()}")
    solid = NOMINAL_FRACTION * recipe.width[0] * recipe.width[1] * recipe.depth
    count = np.rint(share * solid / (4.0 / 3.0 * np.pi * law.radius**3)).astype(np.int64)
    if count.sum() == 0 or np.any((count == 0) & (share > 0.0)):
        raise Refused(f"bed is empty: the box holds {count.tolist()} particles per class; make it larger")
    return count


def check_recipe(law: LinearLaw, recipe: BedRecipe) -> None:
    """Raise Refused for a bed that cannot be made; nothing is placed."""
    if not recipe.pressure > 0.0 or not recipe.gravity > 0.0:
        raise Refused(f"expected pressure > 0 and gravity > 0, found {recipe.pressure}, {recipe.gravity}")
    if recipe.shakes > 0 and not (recipe.shake_amplitude > 0.0 and recipe.shake_frequency > 0.0):
        raise Refused("shaking: expected amplitude > 0 and frequency > 0")
    if not law.rubs and not law.damping > 0.0:
        raise Refused("contact.damping: expected a positive value where no friction acts; nothing else takes energy")
    numbers(law, recipe)
    largest = 2.0 * float(law.radius.max())
    if not recipe.periodic and min(recipe.width) <= largest:
        raise Refused(f"box.width: expected more than one grain, {largest:.6g} m, found {min(recipe.width):.6g} m")


def column_height(law: LinearLaw, recipe: BedRecipe, solid: float) -> float:
    """Height of the column that is poured, m, from the volume of its grains, m3."""
    return max(solid / (recipe.loose_fraction * recipe.width[0] * recipe.width[1]), 4.0 * float(law.radius.max()))
