"""What a scratch test is: its tip, what trades accuracy for time, and the limit on damage."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tip:
    """Rigid sphere: radius [m], Coulomb friction, x of the indentation [m], depth [m] and path [m]."""

    radius: float
    friction: float
    start: float
    depth: float
    path: float


@dataclass(frozen=True)
class Numerics:
    """What trades accuracy for time. Speeds are shares of the longitudinal wave speed.

    points 1 or 8 per element; safety on the step; floor: share of the first step below which elements get mass;
    mass_cap: largest added share of the specimen's mass before the run stops; refresh: steps between refreshes;
    hourglass factor (1 is about the elastic bending stiffness), linear bulk viscosity; penalty factor on E A / h;
    volume_limit: |det F - 1| at which a run without damage stops; energy_limit: share of the external work.
    """

    points: int = 1
    indent_speed: float = 0.003
    slide_speed: float = 0.02
    lift_speed: float = 0.006
    rest_steps: int = 400
    safety: float = 0.8
    floor: float = 0.3
    mass_cap: float = 0.05
    refresh: int = 25
    hourglass: float = 0.02
    viscosity: float = 0.06
    penalty: float = 0.5
    volume_limit: float = 0.02
    energy_limit: float = 0.03


@dataclass(frozen=True)
class Damage:
    """Rate limit and removal: growth per external work [1/J, whole specimen], H (6.98), and the damage at which
    an element is removed. step_slot is the slot of the law's par that takes the limit."""

    per_work: float
    remove_at: float
    step_slot: int
