"""Scene of calibrate: which law, which parameters are free and between which bounds, how to search."""

from __future__ import annotations

from functools import partial
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from graben.declared.laws import PARAMETERS, parameter, parameters_of
from graben.errors import Refused
from graben.schemas.quantities import Integer, Length, Number, Switch, key, knob_key
from graben.schemas.scene import InputFile, Model, Scene
from graben.schemas.scenes.material import parameter_to_si

_knob = partial(knob_key, "calibrate")


class Prior(Model):
    """What is known of a parameter beforehand: a normal distribution."""

    mean: str | Number = key(..., "its middle, in the parameter's unit")
    deviation: str | Number = key(..., "its standard deviation, in the same unit (of a log scale: at the mean)")


class Free(Model):
    """A free parameter."""

    lower: str | Number = key(..., "lower bound, in the parameter's unit")
    upper: str | Number = key(..., "upper bound")
    initial: str | Number | None = key(None, "a guess that every swarm begins with")
    scale: Literal["linear", "log"] = key("linear", "scale on which the search moves")
    prior: Prior | None = key(None, "knowledge from elsewhere: { mean = ..., deviation = ... }")


class CsvFormat(Model):
    """How to read curves from CSV."""

    sign: Literal["tension-positive", "compression-positive"] = key(
        "tension-positive", "sign of stresses and strains in the file; a confining stress may have either"
    )
    allow_tension: Switch = key(False, "accept curves that pull; otherwise they are taken for a wrong sign")
    allow_narrowing: Switch = key(
        False, "accept specimens that contract laterally while they shorten; otherwise the sign is taken for wrong"
    )


class WeightTable(Model):
    """Weights of the residuals."""

    normalise: Literal["curve", "all"] = key(
        "curve", "divide by the largest stress (strain) of each curve, so that none dominates, or of all curves"
    )
    last: Number = key(
        0.5, "weight of a curve's last point relative to its first, linear in between (Y 4.2)", ge=0, le=10
    )
    strain: Number = key(0.05, "weight of the lateral strain relative to the axial stress", ge=0, le=100)
    penalty: Number = key(2.0, "weight of the part of a curve that a candidate's path cannot reach", ge=0, le=1e6)
    noise: Number = key(
        0.05,
        "expected misfit as a fraction of the largest stress: sets what priors weigh against curves",
        ge=1e-9,
        le=1,
    )


class SwarmTable(Model):
    """Budget of the global search and rule of the swarm, Y 2.6.1."""

    starts: Integer | None = _knob("swarm.starts", "searches with different seeds", ge=1, le=1000)
    particles: Integer | None = _knob(
        "swarm.particles", "particles of each swarm, or population (Y: 24)", ge=2, le=100_000
    )
    generations: Integer | None = _knob("swarm.generations", "generations (Y: 100)", ge=0, le=100_000)
    inertia: Number = key(0.73, "inertia omega of Y (2.54) (Y: 1.2)", ge=0, le=2)
    inertia_reduction: Number = key(0.0, "fraction of the inertia lost in each generation (Y: 0.1)", ge=0, lt=1)
    cognitive: Number = key(1.5, "trust in a particle's own best, c1 (Y: 2)", ge=0, le=4)
    social: Number = key(1.5, "trust in the swarm's best, c2 (Y: 2)", ge=0, le=4)
    constriction: Number = key(1.0, "constriction zeta (Y: 1)", ge=1e-6, le=1)


class RefineTable(Model):
    """Levenberg-Marquardt, Y 2.6.3."""

    best: Integer | None = _knob(
        "refine.best", "particles of each swarm to refine, apart from one another", ge=1, le=1000
    )
    damping: Number = key(1e-2, "first lambda, on scaled columns (Y: 10)", ge=1e-15, le=1e15)
    factor: Number = key(4.0, "ratio of neighbouring trial values of lambda (Y: 1.1)", ge=1.001, le=1e6)
    move_limit: Number = key(
        0.1, "largest move in one iteration, as a fraction of a parameter's range", ge=1e-6, le=1
    )
    iterations: Integer = _knob("refine.iterations", "at most this many iterations (Y: 20)", ge=0, le=100_000)


_FREE: Any = {
    "young_modulus": {"lower": "0.5 GPa", "upper": "25 GPa", "scale": "log"},
    "poisson_ratio": {"lower": 0.05, "upper": 0.45},
    "friction_angle": {"lower": "40 deg", "upper": "62 deg"},
    "dilation_angle": {"lower": "5 deg", "upper": "60 deg"},
    "flow_stress_ratio": {"lower": 0.78, "upper": 1.0},
    "initial_yield": {"lower": "1 kPa", "upper": "1 MPa", "scale": "log"},
    "hardening_gain": {"lower": "0.1 MPa", "upper": "10 MPa", "scale": "log"},
    "hardening_rate": {"lower": 10.0, "upper": 5000.0, "scale": "log"},
    "initiation_strain_050": {"lower": 1e-4, "upper": 0.5, "scale": "log"},
    "initiation_strain_060": {"lower": 1e-3, "upper": 0.5, "scale": "log"},
    "failure_displacement": {"lower": "0.01 m", "upper": "10 m", "scale": "log"},
}


class CalibrateScene(Scene):
    """Turn stress-strain curves into the parameters of a constitutive law."""

    kind: Literal["calibrate"]
    curves: list[InputFile] = key(
        [],
        "files of curves: artifacts of homogenize, or CSV; files on the command line replace these",
        max_length=10_000,
    )
    test: Literal["plane-strain", "triaxial"] = key(
        "plane-strain",
        "axial (yy) strain and lateral (xx) stress are prescribed; zz: no strain, or the lateral stress",
    )
    law: str = key("drucker-prager", "constitutive law: " + ", ".join(PARAMETERS) + ", or module:law")
    fixed: dict[str, Any] = Field(
        {"hardening": "exponential", "damage": "ductile"},
        description="parameters that are given: quantities with units, bare numbers, words, tables",
    )
    free: dict[str, Free] = Field(_FREE, description="parameters to find, with bounds; scale = linear or log")
    length: Length = key("10 m", "characteristic length that the curves stand for, for displacement-based damage")
    increments: Integer | None = _knob("increments", "increments between two points of a curve", ge=1, le=1000)
    weights: WeightTable = key(WeightTable(), "weights of the residuals")
    search: Literal["swarm", "appso", "dds", "differential-evolution", "cma-es"] = key(
        "swarm", "the global search; appso: a swarm that does not wait for its slowest particle (Y 2.6.2)"
    )
    staged: Switch = key(
        False, "search elastic, hardening and damage parameters one group after the other first, then all (Y 5.2)"
    )
    swarm: SwarmTable = key(SwarmTable(), "budget of the global search")
    refine: RefineTable = key(RefineTable(), "the local search")
    cross_validation: Switch = key(False, "fit again without each curve in turn and predict it")
    correlation_length: Integer = key(
        5,
        "points along a curve over which residuals are taken as correlated, for the standard errors",
        ge=0,
        le=1_000_000,
    )
    workers: Integer = key(1, "threads (appso: processes); the numbers do not depend on it", ge=1, le=1024)
    csv: CsvFormat = key(CsvFormat(), "how to read CSV")

    @model_validator(mode="after")
    def _parameters(self) -> Self:
        try:
            parameters_of(self.law)
        except Refused as error:
            raise ValueError(f"law = {self.law!r}: expected {error}") from error
        faults = []
        for name, value in self.fixed.items():
            try:
                parameter_to_si(self.law, name, value)
            except Refused as error:
                faults.append(f"fixed.{name} = {value!r}: expected {error}")
        for name, free in self.free.items():
            faults += self._free_faults(name, free)
            if name in self.fixed:
                faults.append(f"free.{name}: expected either free or fixed, not both")
        if not self.free:
            faults.append("free: expected at least one parameter")
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def _free_faults(self, name: str, free: Free) -> list[str]:
        p = parameter(self.law, name)
        if p is None or p.form != "number":
            numbers_of = ", ".join(p.name for p in PARAMETERS[self.law] if p.form == "number")
            return [f"free.{name}: expected a number parameter of {self.law}: {numbers_of}"]
        faults, numbers = [], {}
        for part in ("lower", "upper", "initial"):
            value = getattr(free, part)
            if value is None:
                continue
            try:
                numbers[part] = parameter_to_si(self.law, name, value)
            except Refused as error:
                faults.append(f"free.{name}.{part} = {value!r}: expected {error}")
                continue
            if not p.holds(numbers[part]):
                faults.append(f"free.{name}.{part} = {value!r}: expected {p.bounds}")
        if faults:
            return faults
        if not numbers["lower"] < numbers["upper"]:
            faults.append(f"free.{name}.lower = {free.lower!r}: expected less than upper ({free.upper!r})")
        elif not numbers["lower"] <= numbers.get("initial", numbers["lower"]) <= numbers["upper"]:
            faults.append(f"free.{name}.initial = {free.initial!r}: expected from {free.lower!r} to {free.upper!r}")
        if free.scale == "log" and numbers["lower"] <= 0.0:
            faults.append(f"free.{name}.lower = {free.lower!r}: expected above zero on a log scale")
        return faults or self._prior_faults(name, free, numbers["lower"], numbers["upper"])

    def _prior_faults(self, name: str, free: Free, lower: float, upper: float) -> list[str]:
        if free.prior is None:
            return []
        faults = []
        for part in ("mean", "deviation"):
            value = getattr(free.prior, part)
            try:
                number = parameter_to_si(self.law, name, value)
            except Refused as error:
                faults.append(f"free.{name}.prior.{part} = {value!r}: expected {error}")
                continue
            if part == "mean" and not lower <= number <= upper:
                faults.append(f"free.{name}.prior.mean = {value!r}: expected from {free.lower!r} to {free.upper!r}")
            if part == "deviation" and number <= 0.0:
                faults.append(f"free.{name}.prior.deviation = {value!r}: expected above zero")
        return faults

    def fixed_si(self) -> dict[str, Any]:
        """The fixed parameters in SI."""
        return {n: parameter_to_si(self.law, n, v) for n, v in self.fixed.items()}

    def priors_si(self) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation in SI of the parameters that have a prior."""
        return {
            n: (parameter_to_si(self.law, n, f.prior.mean), parameter_to_si(self.law, n, f.prior.deviation))
            for n, f in self.free.items()
            if f.prior is not None
        }

    def bounds_si(self) -> tuple[list[str], list[float], list[float], list[bool], list[float | None]]:
        """Names, lower, upper, log flags and initial values of the free parameters, in SI."""
        names = list(self.free)
        lower = [parameter_to_si(self.law, n, self.free[n].lower) for n in names]
        upper = [parameter_to_si(self.law, n, self.free[n].upper) for n in names]
        initial = [
            None if self.free[n].initial is None else parameter_to_si(self.law, n, self.free[n].initial)
            for n in names
        ]
        return names, lower, upper, [self.free[n].scale == "log" for n in names], initial
