"""A constitutive law and its parameters, as scenes and `NAME.material.toml` files give them.

law = "drucker-prager"
[parameters]
young_modulus = "1.8 GPa"       # a quantity with its unit
poisson_ratio = 0.2             # dimensionless: a bare number
hardening = "exponential"       # a word
# a table: [[0.0, "50 kPa"], [0.01, "2 MPa"]]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import model_validator

from graben.errors import BadInput, Fault, Refused
from graben.schemas.files import whole_file
from graben.schemas.quantities import KNOWN, key, plain_number, to_si
from graben.schemas.reading import parse_toml, read_toml
from graben.schemas.scene import InputFile, Model

_LARGEST = 1e12
"""Largest magnitude of a dimensionless parameter."""

_ELASTIC = {"young_modulus": "Pa", "poisson_ratio": "1"}
_DUCTILE = {
    "damage": "word",
    "initiation_strain_050": "1",
    "initiation_strain_060": "1",
    "failure_displacement": "m",
    "max_damage": "1",
}
_HARDENING = {
    "hardening": "word",
    "initial_yield": "Pa",
    "hardening_gain": "Pa",
    "hardening_rate": "1",
    "peak_yield": "Pa",
    "strain_at_peak": "1",
    "hardening_modulus": "Pa",
    "hardening_table": "table",
}
_METAL = {
    "hardening": "word",
    "initial_yield": "Pa",
    "hardening_modulus": "Pa",
    "hardening_gain": "Pa",
    "hardening_rate": "1",
    "hardening_table": "table",
}

UNITS: dict[str, dict[str, str]] = {
    "elastic": {**_ELASTIC},
    "transverse-elastic": {
        "young_modulus": "Pa",
        "young_modulus_across": "Pa",
        "poisson_ratio": "1",
        "poisson_ratio_across": "1",
        "shear_modulus_across": "Pa",
        "axis_angle": "rad",
    },
    "j2": {**_ELASTIC, **_METAL},
    "mohr-coulomb": {
        **_ELASTIC,
        "friction_angle": "rad",
        "dilation_angle": "rad",
        "cohesion": "Pa",
        "tensile_strength": "Pa",
    },
    "drucker-prager": {
        **_ELASTIC,
        "friction_angle": "rad",
        "dilation_angle": "rad",
        "flow_stress_ratio": "1",
        **_HARDENING,
        **_DUCTILE,
    },
    "lubliner": {
        **_ELASTIC,
        "dilation_angle": "rad",
        "flow_eccentricity": "1",
        "stress_invariant_ratio": "1",
        "biaxial_ratio": "1",
        "initial_yield": "Pa",
        "peak_yield": "Pa",
        "strain_at_peak": "1",
        "compressive_damage": "1",
        "tensile_yield": "Pa",
        "tensile_decay": "1",
        "tensile_damage": "1",
        "tension_recovery": "1",
        "compression_recovery": "1",
        "largest_inelastic_strain": "1",
        "largest_cracking_strain": "1",
        "max_damage": "1",
        "crack_strain": "word",
    },
    "erve": {
        **_ELASTIC,
        "damage_threshold": "Pa",
        "subdomains": "1",
        "max_damage_step": "1",
        "split": "word",
        "hardening": "table",
    },
    "energy-damage": {**_ELASTIC, "damage_threshold": "Pa", "split": "word", "max_damage": "1", **_METAL},
}
"""law -> parameter -> SI unit, "word" or "table" (plastic strain, stress in Pa). A test holds it to the laws."""

_OURS = frozenset(UNITS)


def declare(law: str, units: Mapping[str, str]) -> None:
    """Let scenes of this process name a law from outside.

    Refused for the name of a law of the package, and for a unit that scenes do not know.
    """
    if law in _OURS:
        raise Refused(f"another name: {law!r} is a law of the package")
    for name, unit in units.items():
        if unit != "1" and unit not in KNOWN:
            raise Refused(f"{name} in one of the units 1, {', '.join(KNOWN)}, not {unit!r}")
    UNITS[law] = dict(units)


def parameter_to_si(law: str, name: str, value: Any) -> Any:
    """One value as files give it -> a float in SI, a word, or rows of floats. Refused says what was expected."""
    unit = UNITS[law].get(name)
    if unit is None:
        raise Refused(f"a parameter of {law}: {', '.join(UNITS[law])}")
    if unit == "word" and isinstance(value, list | tuple) and f"{name}_table" in UNITS[law]:
        unit = "table"  # rows instead of the word "table" with rows elsewhere
    if unit == "word":
        if not isinstance(value, str):
            raise Refused("a word")
        return value
    if unit == "table":
        if not isinstance(value, list | tuple) or not all(isinstance(r, list | tuple) and len(r) == 2 for r in value):
            raise Refused('rows of plastic strain and stress, such as [[0.0, "60 MPa"], [0.1, "90 MPa"]]')
        return [[_number(x), to_si(y, "Pa", tiny=True)] for x, y in value]
    if unit == "1":
        return _number(value)
    return to_si(value, unit, tiny=True)  # a fit may end at 1e-17


def _number(value: Any) -> float:
    """A bare number, or a dimensionless quantity such as "5 %"."""
    if isinstance(value, str) and value.strip().endswith("%"):
        number = 0.01 * plain_number(value.strip()[:-1])
    elif isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if abs(value) <= _LARGEST else math.inf
    else:
        raise Refused("a bare number (dimensionless)")
    if not abs(number) <= _LARGEST:
        raise Refused(f"a finite number of at most {_LARGEST:g}")
    return number


def _convert(law: Any, parameters: Any) -> tuple[dict[str, Any], list[tuple[str, Any, str]]]:
    """Values in SI, and every fault as (key, value, expected)."""
    if law not in UNITS:
        return {}, [("law", law, "one of " + ", ".join(UNITS))]
    if not isinstance(parameters, Mapping):
        return {}, [("parameters", parameters, "a table of parameters")]
    values: dict[str, Any] = {}
    faults = []
    for name, value in parameters.items():
        try:
            values[name] = parameter_to_si(law, name, value)
        except Refused as error:
            faults.append((f"parameters.{name}", value, str(error)))
    return values, faults


class MaterialTable(Model):
    """Either `file`, or `law` and `parameters`."""

    file: InputFile | None = key(None, "a NAME.material.toml, or calibrate's artifact, instead of law and parameters")
    law: str | None = key(None, "name of the law: " + ", ".join(UNITS))
    parameters: dict[str, Any] = key({}, "the law's parameters: quantities with units, bare numbers, words, tables")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.file is None) == (self.law is None):
            raise ValueError("either file, or law with parameters")
        if self.law is not None:
            faults = _convert(self.law, self.parameters)[1]
            if faults:
                raise ValueError("; ".join(f"{k} = {v!r}: expected {e}" for k, v, e in faults))
        return self

    def resolve(self) -> tuple[str, dict[str, Any]]:
        """(law, values in SI), from the file where one is named. BadInput when that file has faults."""
        if self.file is not None:
            return read_material(self.file)
        assert self.law is not None
        return self.law, _convert(self.law, self.parameters)[0]


def read_material(path: str | Path) -> tuple[str, dict[str, Any]]:
    """Law and values in SI from a NAME.material.toml or from an artifact of kind "calibration".

    Raises
    ------
    BadInput : every fault of the file at once
    """
    path = Path(path)
    if path.suffix == ".nc":
        from graben.schemas.artifact import read_artifact

        try:
            tables = parse_toml(str(read_artifact(path, "calibration").attrs["material"]))
        except ValueError as error:
            if isinstance(error, BadInput):
                raise
            raise BadInput(Fault(str(path), "material", "", f"valid TOML ({error})")) from None
    else:
        _, tables = read_toml(path, "material file")
    extra = [
        Fault(str(path), k, "", "no such key (law, parameters)") for k in tables if k not in ("law", "parameters")
    ]
    values, faults = _convert(tables.get("law"), tables.get("parameters", {}))
    found = extra + [Fault(str(path), k, repr(v), e) for k, v, e in faults]
    if found:
        raise BadInput(found)
    return str(tables["law"]), values


_READABLE = {"Pa": (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)), "rad": (("deg", 0.017453292519943295),), "m": ()}


def material_text(law: str, values: Mapping[str, Any], note: str = "") -> str:
    """A NAME.material.toml that reads back to the same bits; readable units follow as comments."""
    lines = [f"# {line}" for line in note.splitlines()] + [f'law = "{law}"', "", "[parameters]"]
    for name, value in values.items():
        unit = UNITS[law][name]
        if unit == "word" and not isinstance(value, str):
            unit = "table"
        if unit == "word":
            lines.append(f'{name} = "{value}"')
        elif unit == "table":
            rows = ", ".join(f'[{float(x)!r}, "{float(y)!r} Pa"]' for x, y in value)
            lines.append(f"{name} = [{rows}]")
        elif unit == "1":
            lines.append(f"{name} = {float(value)!r}")
        else:
            number = float(value)
            human = next((f"  # {number / s:.4g} {u}" for u, s in _READABLE.get(unit, ()) if abs(number) >= s), "")
            lines.append(f'{name} = "{number!r} {unit}"{human}')
    return "\n".join(lines) + "\n"


def material_table(law: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The table of a scene that holds a law and its values in SI, with quantities as text."""
    return parse_toml(material_text(law, values))


def write_material(path: str | Path, law: str, values: Mapping[str, Any], note: str = "") -> None:
    """Write `material_text` as a whole file or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(material_text(law, values, note), encoding="utf-8")
