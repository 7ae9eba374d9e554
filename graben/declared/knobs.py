"""Knobs of accuracy of every stage, and what draft, standard and reference mean.

A knob is a key of a scene that trades accuracy for time. Left out in a scene, it is that of the scene's fidelity.
`values_at` gives what a stage needs; `STAGES` lists all of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

Fidelity = Literal["draft", "standard", "reference"]
FIDELITIES: tuple[Fidelity, ...] = get_args(Fidelity)


class Times(NamedTuple):
    """The rule "what the scene says, times a factor".

    key : of the scene, where another factor may be given; "" where there is none
    """

    factor: float
    key: str = ""

    def __str__(self) -> str:
        return f"times {self.factor:g}"


class SlowEnough(NamedTuple):
    """The rule "so many steps, and more where inertia asks for them".

    A compression takes no fewer than keep its inertial number below `inertia`: kinetic stays below 5 % of stored
    energy from 0.1 to 4 MPa. It takes no more than `most` times `steps`; with less confinement the run warns.
    """

    steps: int
    inertia: float = 0.0125
    most: int = 20

    def __str__(self) -> str:
        return f"{self.steps} or more"


@dataclass(frozen=True)
class Knob:
    """One knob.

    key : dotted, of the scene of its stage; unit : SI, "1" where dimensionless
    trades : what it is, or what more of it buys
    draft, standard, reference : the value at each fidelity, or the rule by which the stage finds it
    settable : whether a scene has the key; else fidelity alone decides
    """

    key: str
    unit: str
    trades: str
    draft: Any
    standard: Any
    reference: Any
    settable: bool = True

    @property
    def steady(self) -> bool:
        """Whether it is the same at every fidelity."""
        return bool(self.draft == self.standard == self.reference)

    def at(self, fidelity: Fidelity) -> Any:
        """Value or rule at a fidelity."""
        return getattr(self, fidelity)

    def __str__(self) -> str:
        return ", ".join(f"{fidelity} {self.at(fidelity)}" for fidelity in FIDELITIES)


class Promise(NamedTuple):
    """What a stage promises at one fidelity.

    error : of the headline number, relative to that at reference, whose own error nobody knows; cost : CPU time over
    that at draft; None where not measured
    """

    error: float | None = None
    cost: float | None = None


@dataclass(frozen=True)
class Stage:
    """The knobs of one stage.

    command, kind : of the command line, and of its scene
    headline : the number that promises are about, by its name in the JSON of the command
    promises : one a fidelity, in their order; none before they have been measured
    """

    command: str
    kind: str
    headline: str
    knobs: tuple[Knob, ...]
    promises: tuple[Promise, ...] = ()


def _same(key: str, unit: str, trades: str, value: Any) -> Knob:
    """A knob that no fidelity turns."""
    return Knob(key, unit, trades, value, value, value)


_SWARM = ("swarms", "particles of each", "generations", "sets refined")
STAGES: tuple[Stage, ...] = (
    Stage("dem-run", "blocks", "peak_wall_stress_pa", (
        Knob("numerics.steps", "1", "steps of loading: more means less inertia",
             SlowEnough(12_500), SlowEnough(50_000), SlowEnough(200_000)),
        _same("numerics.consolidation_tolerance", "1", "unbalanced force that ends consolidation", 1e-3),
        _same("numerics.force_check", "1", "misfit of forces kept by slower loading; none: steady speed", None),
        _same("tessellation.zone_edge", "m", "longest edge of zones; none: zones span the corners of blocks", None),
        _same("programme.frame", "1", "stiffness of the frame over that of the body: how far loads overshoot", 10.0),
        _same("programme.beyond", "1", "way past the largest load, over the way there", 1.0),
    ), (Promise(0.04, 1.0), Promise(0.03, 1.3), Promise(None, 3.4))),
    Stage("dem-run", "particles", "contacts_per_m2", (
        Knob("numerics.safety", "1", "time step over the critical one: the energy balance", 0.6, 0.4, 0.2),
        Knob("numerics.rest", "1", "kinetic energy at which a poured bed has settled", 1e-2, 1e-3, 1e-4),
        Knob("numerics.balance", "1", "unbalanced force at which the bed is at rest", 5e-3, 1e-3, 1e-4),
        _same("contact.overlap", "1", "mean overlap: softer contacts take longer steps", 0.005),
        _same("beds", "1", "beds, with a seed each: scatter and interval of the count", 1),
        _same("loading.ramp", "1", "half periods over which the pressure rises", 5.0),
    ), (Promise(0.04, 1.0), Promise(0.04, 2.0), Promise(None, 7.3))),
    Stage("rev-study", "rev-study", "recommended_radius_m", (
        Knob("tests.resamples", "1", "draws of the bootstrap", 500, 2000, 20_000),
        _same("samples.grid", "1", "centres per side of the grid of places", 3),
        *(Knob(f"calibration.first.{name}", "1", f"first fit: {what}", *counts, settable=False)
          for name, what, counts in zip(
              ("starts", "particles", "generations", "best"), _SWARM,
              ((1, 2, 4), (24, 24, 48), (60, 100, 200), (3, 3, 4)))),
        Knob("calibration.each.best", "1", "each sample: sets refined", 1, 3, 6, settable=False),
        Knob("calibration.each.iterations", "1", "each sample: iterations", 20, 40, 80, settable=False),
    )),
    Stage("calibrate", "calibrate", "rmse_pa", (
        *(Knob(key, "1", what, *counts)
          for key, what, counts in zip(
              ("swarm.starts", "swarm.particles", "swarm.generations", "refine.best"), _SWARM,
              ((1, 4, 12), (24, 24, 48), (60, 100, 200), (3, 4, 6)))),
        Knob("increments", "1", "increments between two points of a curve", 1, 2, 4),
        _same("refine.iterations", "1", "iterations of a refinement at most", 40),
    ), (Promise(0.01, 1.0), Promise(0.002, 3.4), Promise(None, 34.0))),
    Stage("fem-run", "fem", "failure_load_pa", (
        Knob("mesh.size", "m", "size of elements, refinements included",
             Times(2.7, "mesh.draft_factor"), Times(1.0), Times(0.33, "mesh.reference_factor")),
        _same("stepping.largest", "s", "largest step of the load history", 2.0),
        _same("stepping.smallest", "s", "step below which failure is declared", 0.02),
        _same("stepping.tolerance", "1", "unbalanced force of an equilibrium", 1e-6),
    ), (Promise(0.7, 1.0), Promise(0.12, 1.8), Promise(None, 19.0))),
    Stage("scratch", "scratch", "degree_of_wear", (
        Knob("mesh.size", "m", "edge of bricks under the path",
             Times(1.7, "mesh.draft_factor"), Times(1.0), Times(0.75, "mesh.reference_factor")),
        *(Knob(f"numerics.{phase}_speed", "1", f"speed of {what} over the wave speed: inertia",
               Times(2.0, "numerics.draft_speed_factor"), Times(1.0), Times(0.5, "numerics.reference_speed_factor"))
          for phase, what in (("indent", "indentation"), ("slide", "sliding"), ("lift", "lifting"))),
        _same("mesh.growth", "1", "ratio of neighbouring edges beside the path", 1.25),
        _same("mesh.growth_depth", "1", "ratio of neighbouring edges from the surface down", 1.12),
        _same("numerics.points", "1", "integration points: 1 with hourglass control, or 8", 1),
        _same("numerics.safety", "1", "time step over the critical one", 0.8),
        _same("numerics.refresh", "1", "steps between looks at step, removal and history", 25),
        _same("numerics.floor", "1", "share of the first step below which elements get mass", 0.3),
        _same("numerics.hourglass", "1", "hourglass stiffness over that of bending", 0.02),
        _same("numerics.viscosity", "1", "bulk viscosity over the critical one", 0.06),
        _same("numerics.penalty", "1", "contact stiffness over that of the surface", 0.5),
    ), (Promise(0.06, 1.0), Promise(0.02, 9.8), Promise(None, 48.0))),
)  # fmt: skip
"""Stages in the order of the two chains; homogenize and wear-estimate have no knob of accuracy."""


def stage_of(kind: str) -> Stage | None:
    """The stage whose scenes are of that kind; None where it has no knob."""
    return next((s for s in STAGES if s.kind == kind), None)


def knob(kind: str, key: str) -> Knob:
    """The knob of that key in the stage whose scenes are of that kind."""
    return next(k for s in STAGES if s.kind == kind for k in s.knobs if k.key == key)


def values_at(kind: str, fidelity: Fidelity) -> dict[str, Any]:
    """Value or rule of every knob, by key, of the stage whose scenes are of that kind."""
    return {k.key: k.at(fidelity) for s in STAGES if s.kind == kind for k in s.knobs}
