"""Scene of kind "wear": grains, their grooves, mixtures and a machine."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from graben.schemas.quantities import AngularSpeed, Area, Force, Length, Number, key
from graben.schemas.scene import InputFile, Model, Name, Scene

Share = Annotated[Number, Field(ge=0, le=1)]


class Groove(Model):
    """One groove that a grain left."""

    force: Force = key(..., "normal force on the grain", gt=0, examples=["2 N"])
    area: Area = key(..., "cross-section of the groove below the old surface", gt=0, examples=["88.4 um^2"])
    degree_of_wear: Number = key(
        ..., "f_ab: part of the groove that is gone, not pushed to its shoulders", ge=-1, le=1, examples=[0.37]
    )


class GrainClass(Model):
    """A size of grain."""

    name: Name = key(
        ..., "name of the class; mixtures and scratch artifacts refer to it", min_length=1, examples=["fine"]
    )
    diameter: Length = key(..., "diameter", gt=0, examples=["100 um"])
    grooves: tuple[Groove, ...] = key(
        (), "grooves by a grain of this size at one force or more; or give scratch artifacts with the command"
    )
    scratch: tuple[InputFile, ...] = key((), "scratch artifacts of a grain of this size")


class Mixture(Model):
    """Grains in shares of volume."""

    name: Name = key(..., "name of the mixture", min_length=1, examples=["homogeneous"])
    shares: dict[str, Share] = key(..., "class name -> volume share; sums to 1", examples=[{"fine": 1.0}])

    @model_validator(mode="after")
    def _partition(self) -> Mixture:
        if abs(sum(self.shares.values()) - 1.0) > 1e-6:
            raise ValueError(f"shares with sum 1 (found {sum(self.shares.values()):g})")
        return self


class Machine(Model):
    """Wheel or tool that the grains pass under."""

    rotation: AngularSpeed = key("200 rpm", "speed of the wheel", gt=0)
    wheel_diameter: Length = key("228.5 mm", "diameter of the wheel: grains pass at its rim speed", gt=0)
    contact_area: Area = key(
        "114.3 mm^2",
        "area of tool that grains touch; the default, one half of 18 x 12.7 mm, reproduces H table 8.4, "
        "for which H states none",
        gt=0,
    )
    applied_load: Force = key("130 N", "force that presses tool and grains together", gt=0)


class Counts(Model):
    """Where the number of contacts comes from."""

    source: Literal["graben", "hoormazdi-2021", "bed"] = key(
        "graben", "a law of contacts per area, or counts in a bed artifact"
    )
    bed: InputFile | None = key(None, "particles artifact whose floor contacts count (source bed)")


class Load(Model):
    """How much force each contact carries."""

    mode: Literal["given", "balanced"] = key(
        "balanced",
        "given: grooves as they are, whatever their forces add up to (as H does); balanced: force per contact "
        "from the applied load, grooves scaled to it",
    )
    split: Literal["equal", "area", "bed"] = key(
        "area", "force per contact between classes: equal; as diameter squared; or as measured in the bed"
    )


class WearScene(Scene):
    """Wear rate from contact counts, grooves and machine data."""

    kind: Literal["wear"]
    machine: Machine = key(default_factory=Machine, description="the machine (default: ASTM G65 as in H 8.4)")
    counts: Counts = key(default_factory=Counts, description="contacts per area")
    load: Load = key(default_factory=Load, description="force per contact")
    grains: tuple[GrainClass, ...] = key(
        ...,
        "grain classes",
        min_length=1,
        examples=[
            [
                {
                    "name": "fine",
                    "diameter": "100 um",
                    "grooves": [{"force": "2 N", "area": "88.4 um^2", "degree_of_wear": 0.37}],
                }
            ]
        ],
    )
    mixtures: tuple[Mixture, ...] = key(
        ..., "mixtures to rate", min_length=1, examples=[[{"name": "homogeneous", "shares": {"fine": 1.0}}]]
    )

    @model_validator(mode="after")
    def _names(self) -> WearScene:
        names = [g.name for g in self.grains]
        faults = []
        if len(set(names)) < len(names):
            faults.append(f"different names in grains (found {names})")
        for mixture in self.mixtures:
            unknown = sorted(set(mixture.shares) - set(names))
            if unknown:
                faults.append(f"mixture {mixture.name!r} of known classes {names} (found {unknown})")
        if faults:
            raise ValueError("; ".join(faults))
        return self
