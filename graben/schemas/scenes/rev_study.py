"""Scene of a REV study: which radii, where, and what counts as settled."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Literal

from pydantic import field_validator, model_validator

from graben.schemas.quantities import Integer, Length, Number, key, knob_key
from graben.schemas.scene import InputFile, Model, Scene

_knob = partial(knob_key, "rev-study")


Property = Literal["secant_modulus", "poisson_ratio", "peak_stress", "strain_at_peak", "dilation"]


class Samples(Model):
    """Where the averages are taken."""

    radii: tuple[Length, ...] = key(
        ("1 m", "1.5 m", "2 m", "2.5 m", "3 m", "3.5 m", "4 m"),
        "radii of the REV, rising",
        min_length=2,
        max_length=10_000,
    )
    centres: tuple[tuple[Length, Length], ...] = key(
        (), "their centres, [x, y] each; none: a grid (see grid)", max_length=100_000
    )
    grid: Integer = _knob(
        "samples.grid", "centres per side of a square grid, as wide as the largest radius leaves room", ge=1, le=50
    )

    @field_validator("radii")
    @classmethod
    def _rising(cls, radii: tuple[float, ...]) -> tuple[float, ...]:
        if radii[0] <= 0.0 or any(b <= a for a, b in pairwise(radii)):
            raise ValueError("positive radii, each larger than the one before")
        return radii


class Curves(Model):
    """What is read off the average curves."""

    properties: tuple[Property, ...] = key(
        ("secant_modulus", "peak_stress"), "the scalars that must settle before a radius is recommended", min_length=1
    )
    secant_level: Number = key(0.5, "part of the rise to the peak at which the secant is taken", ge=1e-6, le=0.999999)


class Tests(Model):
    """When a scalar counts as settled."""

    __test__ = False  # not a test of pytest's

    confidence: Number = key(0.95, "confidence of intervals and tests", gt=0.5, le=0.999999)
    tolerance: Number = key(
        0.05, "largest relative difference of a mean from that at the largest radius", ge=1e-9, lt=1
    )
    variation: Number = key(0.10, "largest coefficient of variation to be accepted", ge=1e-9, lt=1)
    resamples: Integer | None = _knob("tests.resamples", "draws of the bootstrap", ge=100, le=1_000_000)


class Calibration(Model):
    """Fit a law to the curves of every sample; its parameters are then what must settle (Y 4.4)."""

    scene: InputFile = key(
        ..., "scene of kind calibrate: law, bounds and weights (its curves are not used)", examples=["calibrate.toml"]
    )
    properties: tuple[str, ...] = key(
        (), "parameters that must settle; none: those that the curves of the largest radius can tell"
    )


class RevStudyScene(Scene):
    """How large must the representative area be?"""

    kind: Literal["rev-study"] = key("rev-study", "what this scene is")
    samples: Samples = key(Samples(), "where the averages are taken")
    curves: Curves = key(Curves(), "what is read off the average curves")
    tests: Tests = key(Tests(), "when a scalar counts as settled")
    calibration: Calibration | None = key(None, "calibrated parameters instead of scalars of the curves (off)")
    processes: Integer = key(
        0, "processes that share the samples (0: one per core); the result is the same", ge=0, le=1024
    )

    @model_validator(mode="after")
    def _distinct(self) -> RevStudyScene:
        if len(set(self.curves.properties)) != len(self.curves.properties):
            raise ValueError("each property once")
        return self
