"""Quantities in scenes: one number and one unit, checked for dimension and turned into SI once, at the edge.

A scene says ``young = "65 GPa"``; the model's field then holds the float 6.5e10. Angles become radians.
Tension is positive and lengths are in metres everywhere behind this edge.

A quantity is read by a grammar of its own, so that a slip of spelling is refused and never read as another value:

    quantity = number unit            "65 GPa", "2.7e3 kg/m^3", "200 rpm", "10 1/s"
    number   = digits with at most one decimal point, a sign and an exponent if need be
    unit     = names joined by * and /, each to a power from -9 to 9; a product below a / stands in parentheses
"""

from __future__ import annotations

import math
import re
from functools import cache, lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from graben.declared.knobs import knob
from graben.declared.laws import parameter
from graben.errors import Refused

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_POWER = r"(?:\s*(?:\^|\*\*)\s*-?[1-9])?"
_FACTOR = rf"[A-Za-z]+(?![A-Za-z0-9]){_POWER}(?![0-9])"
_PRODUCT = rf"{_FACTOR}(?:\s*\*\s*{_FACTOR})*"
_GROUP = rf"\(\s*{_PRODUCT}\s*\)"
_DIVISOR = rf"\s*/\s*(?:{_FACTOR}|{_GROUP})"
_UNIT = rf"(?:(?:{_PRODUCT}|{_GROUP})(?:{_DIVISOR})*|1?(?:{_DIVISOR})+)"
_QUANTITY = re.compile(rf"({_NUMBER})\s*({_UNIT})")
_LONGEST = 80

# What has one meaning is taken: signs that typesetters use for ASCII ones.
_SIGNS = str.maketrans(
    {"\u2212": "-", "\u00b5": "u", "\u03bc": "u", "\u00b7": "*", "\u22c5": "*", "\u00b0": "deg", "\u00ba": "deg"}
    | dict.fromkeys("\u00a0\u2007\u2009\u202f", " ")
)
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")

# The units of this field, each with one meaning. An angle is a dimension: 35 is no angle, and 1/s no angular speed.
_DEFINITIONS = """
meter = [length] = m = metre
second = [time] = s
gram = [mass] = g
radian = [angle] = rad
newton = kilogram * meter / second ** 2 = N
pascal = newton / meter ** 2 = Pa
joule = newton * meter = J
hertz = 1 / second = Hz
bar = 1e5 * pascal
liter = 1e-3 * meter ** 3 = l = L = litre
minute = 60 * second = min
hour = 60 * minute = h
day = 24 * hour = d
degree = 0.017453292519943295 * radian = deg
gon = 0.015707963267948967 * radian
turn = 6.283185307179586 * radian = revolution = rev
revolutions_per_minute = turn / minute = rpm
tonne = 1000 * kilogram = t
standard_gravity = 9.80665 * meter / second ** 2
kilogram_force = kilogram * standard_gravity = kgf
tonne_force = tonne * standard_gravity = tf
atmosphere = 101325 * pascal = atm
inch = 0.0254 * meter = in = inches
foot = 12 * inch = ft = feet
pound = 0.45359237 * kilogram = lb
pound_force = pound * standard_gravity = lbf
kip = 1000 * pound_force
psi = pound_force / inch ** 2
ksi = 1000 * psi
psf = pound_force / foot ** 2
pcf = pound / foot ** 3
"""
_PREFIXES = {
    "nano": ("n", 1e-9), "micro": ("u", 1e-6), "milli": ("m", 1e-3), "centi": ("c", 1e-2), "deci": ("d", 1e-1),
    "hecto": ("h", 1e2), "kilo": ("k", 1e3), "mega": ("M", 1e6), "giga": ("G", 1e9), "tera": ("T", 1e12),
}  # fmt: skip
_SYMBOLS_WITH_PREFIX = ("m", "s", "g", "N", "Pa", "J", "Hz", "bar", "l", "L")
_NAMES_WITH_PREFIX = ("metre", "meter", "second", "gram", "newton", "pascal", "joule", "hertz", "litre")
_SYMBOLS = (
    "min", "h", "d", "rad", "mrad", "urad", "deg", "gon", "rev", "rpm", "t", "kgf", "tf", "atm",
    "in", "ft", "lb", "lbf", "kip", "psi", "ksi", "psf", "pcf",
)  # fmt: skip
_NAMES = ("minute", "hour", "day", "radian", "degree", "turn", "revolution", "tonne")

# unit -> example, smallest magnitude that is not 0, largest magnitude
_UNITS = {
    "m": ("0.5 m", 1e-12, 1e9),
    "m^2": ("80 mm^2", 1e-24, 1e18),
    "Pa": ("65 GPa", 1e-9, 1e17),
    "Pa/m": ("10 GPa/m", 1e-9, 1e21),
    "Pa/s": ("0.25 MPa/s", 1e-12, 1e21),
    "N": ("2 N", 1e-15, 1e15),
    "N/m": ("100 N/m", 1e-12, 1e18),
    "kg/m^3": ("2700 kg/m^3", 1e-9, 1e15),
    "rad": ("32 deg", 1e-12, 1e3),
    "rad/s": ("200 rpm", 1e-12, 1e9),
    "m/s": ("5 mm/s", 1e-15, 1e6),
    "m/s^2": ("9.81 m/s^2", 1e-12, 1e9),
    "s": ("100 s", 1e-15, 1e15),
    "1/s": ("10 1/s", 1e-15, 1e18),
}
KNOWN = tuple(_UNITS)
"""SI units that scenes know."""

# The units of most scenes, with the factors that pint gives, which takes longer to import than a scene to read.
_USUAL: dict[str, dict[str, float]] = {
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "um": 1e-06, "km": 1000.0},
    "m^2": {"m^2": 1.0, "cm^2": 0.0001, "mm^2": 1e-06, "um^2": 1e-12},
    "Pa": {"Pa": 1.0, "kPa": 1000.0, "MPa": 1e6, "GPa": 1e9},
    "Pa/m": {"Pa/m": 1.0, "MPa/m": 1e6, "GPa/m": 1e9},
    "Pa/s": {"Pa/s": 1.0, "kPa/s": 1000.0, "MPa/s": 1e6},
    "N": {"N": 1.0, "mN": 0.001, "kN": 1000.0},
    "N/m": {"N/m": 1.0, "kN/m": 1000.0},
    "kg/m^3": {"kg/m^3": 1.0},
    "rad": {"rad": 1.0, "deg": 0.017453292519943295},
    "rad/s": {"rad/s": 1.0, "rpm": 0.10471975511965977, "deg/s": 0.017453292519943295},
    "m/s": {"m/s": 1.0, "mm/s": 0.001, "um/s": 1e-06},
    "m/s^2": {"m/s^2": 1.0},
    "s": {"s": 1.0, "ms": 0.001, "us": 1e-06},
    "1/s": {"/s": 1.0, "1/s": 1.0, "Hz": 1.0, "kHz": 1000.0},
}

_ANGULAR = {
    "rad": "an angle names its unit, deg or rad",
    "rad/s": "an angular speed names its angle: rpm, deg/s or rad/s",
    "1/s": "a frequency has no angle: 1/s or Hz",
}


def plain_number(text: str) -> float:
    """A float from digits with at most one decimal point, a sign and an exponent; Refused says how to write it."""
    text = text.translate(_SIGNS).strip()
    if len(text) > _LONGEST or not re.fullmatch(_NUMBER, text):
        raise Refused("one plain number, such as 0.5 or 2e-3: a decimal point, no thousands separators")
    return _finite(text)


def _finite(text: str) -> float:
    """The float of a plain number that is neither too large nor too small for one."""
    value = float(text)
    if not math.isfinite(value) or (value == 0.0 and re.search("[1-9]", re.split("[eE]", text)[0])):
        raise Refused(f"a finite number; {text} is too {'small' if value == 0.0 else 'large'}")
    return value


def to_si(text: Any, unit: str, *, tiny: bool = False) -> float:
    """Turn ``"10 GPa/m"`` into a float in the SI unit `unit`, one of those that scenes know.

    tiny: also take magnitudes too small for a scene's key, as a fit may find them.

    Raises
    ------
    Refused : no string, not one number and one unit, unknown unit, another dimension, too large; with the cure
    """
    example, smallest, largest = _UNITS[unit]
    wanted = f'a quantity in {unit}, as a string such as "{example}"'
    if not isinstance(text, str):
        bare = isinstance(text, int | float) and not isinstance(text, bool)
        raise Refused(wanted + (" (a bare number has no unit)" if bare else " (one number and one unit)"))
    plain = re.sub(r"[⁰¹²³⁴-⁹⁻]+", lambda m: "^" + m[0].translate(_SUPERSCRIPTS), text[: _LONGEST + 1])
    plain = plain.translate(_SIGNS).strip()
    match = _QUANTITY.fullmatch(plain) if len(plain) <= _LONGEST else None
    if match is None:
        raise Refused(f"{wanted}; {_cure(plain, unit)}")
    number = _finite(match[1])
    named = re.sub(r"\s", "", match[2])
    usual = _USUAL[unit].get(named)
    value = number * (_factor(named, unit, wanted) if usual is None else usual)
    if not abs(value) <= largest:
        raise Refused(f"{wanted}, finite and at most {largest:g} {unit}")
    if number and abs(value) < smallest and not tiny:
        raise Refused(f"{wanted}, 0 or of at least {smallest:g} {unit}")
    return value


def _cure(text: str, unit: str) -> str:
    """What to change in a text that is no quantity."""
    decimal = re.fullmatch(r"([+-]?[0-9]+),([0-9]+)(\s*[^\s,0-9][^,]*)?", text)
    if decimal and len(decimal[2]) != 3:
        return f"write {text.replace(',', '.')}: a decimal point, no thousands separators"
    if decimal:
        return f"write {text.replace(',', '.')} or {text.replace(',', '')}: a decimal point, no thousands separators"
    if re.fullmatch(_NUMBER, text):
        return f"{text} has no unit" + (f" ({_ANGULAR[unit]})" if unit in _ANGULAR else "")
    if re.match(r"[+-]?[0-9]+([.,'_\s][0-9]+)+", text) and not re.match(rf"{_NUMBER}\s*[A-Za-z]", text):
        return "write one number, with a decimal point and no thousands separators, and one unit"
    if re.search(r"[A-Za-z][2-9]", text):
        return "write powers as in m^2"
    if re.search(r"/.*\*", text):
        return "put the product below a / in parentheses, as in N/(m*s)"
    return "write one finite number and one unit, with * and / between the unit's parts"


@lru_cache(maxsize=1024)
def _factor(text: str, unit: str, wanted: str) -> float:
    """SI units `unit` in one of the unit `text`."""
    registry, known = _registry()
    for name in re.findall("[A-Za-z]+", text):
        if name not in known:
            close = _close(name, known)
            raise Refused(f"{wanted}; {name!r} is no unit here" + (f": {close}?" if close else ""))
    found = registry.parse_units(f"1{text}" if text.startswith("/") else text)
    target = registry.parse_units(unit)
    if found.dimensionality != target.dimensionality:
        why = f" ({_ANGULAR[unit]})" if unit in _ANGULAR else ""
        raise Refused(f"{wanted}; found the dimension of {text}{why}")
    return float(registry.convert(1.0, found, target))


def _close(name: str, known: frozenset[str]) -> str:
    """Units of almost that name, for a message."""
    same = [k for k in known if k.lower() == name.lower() or k == name.removesuffix("s")]
    return " or ".join(sorted(same)[:3])


@cache
def _registry() -> tuple[Any, frozenset[str]]:
    """The units above and how they may be spelled: only SI units take prefixes, only names in full take a plural."""
    import pint

    registry: Any = pint.UnitRegistry(None, cache_folder=None)
    registry.load_definitions(
        [f"{name}- = {value!r} = {symbol}-" for name, (symbol, value) in _PREFIXES.items()]
        + _DEFINITIONS.strip().splitlines()
    )
    symbols = [s for s, _ in _PREFIXES.values()]
    names = [*_NAMES, *_NAMES_WITH_PREFIX, *(p + n for p in _PREFIXES for n in _NAMES_WITH_PREFIX)]
    spelled = [*_SYMBOLS, *_SYMBOLS_WITH_PREFIX, *(p + s for p in symbols for s in _SYMBOLS_WITH_PREFIX)]
    return registry, frozenset([*spelled, *names, *(n + "s" for n in names), "inch", "inches", "foot", "feet"])


def _quantity(unit: str) -> Any:
    def convert(value: Any) -> float:
        return to_si(value, unit)

    schema = {"type": "string", "description": f"quantity in {unit}", "x-unit": unit, "x-largest": _UNITS[unit][2]}
    return Annotated[float, BeforeValidator(convert), WithJsonSchema(schema)]


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

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A number without unit: no text and no true or false. Its key states bounds."""
Integer = Annotated[int, Field(strict=True)]
Switch = Annotated[bool, Field(strict=True)]


def key(default: Any = ..., description: str = "", **constraints: Any) -> Any:
    """A scene key: default (a quantity as a string with units), one line of description, pydantic constraints.

    Typed Any, so that a field declared as a float may be given its default as ``"65 GPa"``.
    """
    return Field(default, description=description, **constraints)


def law_key(law: str, name: str, default: Any, description: str) -> Any:
    """A scene key that is a parameter of a law of the package: its bounds are the declared ones."""
    p = parameter(law, name)
    assert p is not None and p.form == "number"
    return key(default, description, ge=p.lower, le=p.upper)


def knob_key(kind: str, name: str, description: str, **constraints: Any) -> Any:
    """A scene key that is a knob of accuracy: its default is the declared one, and None where fidelity turns it."""
    found = knob(kind, name)
    if not found.steady:
        return key(None, f"{description}; left out: {found}", **constraints)
    value = found.standard
    bare = value is None or found.unit == "1"
    return key(value if bare else f"{value:g} {found.unit}", description, **constraints)
