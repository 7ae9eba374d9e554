"""Quantities in scenes: strings with units, checked for dimension and turned into SI once, at the edge.

A scene says ``young = "65 GPa"``; the model's field then holds the float 6.5e10. Angles become radians.
Tension is positive and lengths are in metres everywhere behind this edge.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def to_si(text: str, unit: str) -> float:
    """Turn ``"10 GPa/m"`` into a float in the SI unit `unit`.

    Raises
    ------
    ValueError : not a quantity, unknown unit, wrong dimension, or not finite; the message says what was expected
    """
    import pint

    wanted = f'a quantity in {unit}, as a string such as "{_EXAMPLES.get(unit, "1 " + unit)}"'
    if not isinstance(text, str):
        raise ValueError(wanted + " (a bare number has no unit)")
    try:
        quantity = _registry().Quantity(text)
    except Exception as error:  # pint raises tokenizer and attribute errors of many kinds
        raise ValueError(wanted) from error
    try:
        value = float(quantity.to(unit).magnitude)
    except pint.DimensionalityError as error:
        raise ValueError(f"{wanted}; found the dimension of {quantity.units:~P}") from error
    except (TypeError, ValueError) as error:
        raise ValueError(wanted) from error
    if not math.isfinite(value):
        raise ValueError(wanted + ", finite")
    return value


def _quantity(unit: str) -> Any:
    def convert(value: Any) -> float:
        return to_si(value, unit)

    schema = {"type": "string", "description": f"quantity in {unit}", "x-unit": unit}
    return Annotated[float, BeforeValidator(convert), WithJsonSchema(schema)]


_EXAMPLES = {
    "Pa": "65 GPa",
    "Pa/m": "10 GPa/m",
    "m": "0.5 m",
    "kg/m^3": "2700 kg/m^3",
    "rad": "32 deg",
    "m/s": "5 mm/s",
    "Pa/s": "0.25 MPa/s",
    "rad/s": "200 rpm",
    "1/s": "10 1/s",
}

Length = _quantity("m")
Area = _quantity("m^2")
Pressure = _quantity("Pa")
JointStiffness = _quantity("Pa/m")
PressureSlope = _quantity("Pa/m")
ContactStiffness = _quantity("N/m")
Density = _quantity("kg/m^3")
Angle = _quantity("rad")
Speed = _quantity("m/s")
AngularSpeed = _quantity("rad/s")
Acceleration = _quantity("m/s^2")
Time = _quantity("s")
Frequency = _quantity("1/s")
Force = _quantity("N")
PressureRate = _quantity("Pa/s")


def key(default: Any = ..., description: str = "", **constraints: Any) -> Any:
    """A scene key: default (a quantity as a string with units), one line of description, pydantic constraints.

    Typed Any, so that a field declared as a float may be given its default as ``"65 GPa"``.
    """
    return Field(default, description=description, **constraints)
