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
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from pydantic import model_validator

from graben.declared.laws import PARAMETERS, parameter, parameters_of
from graben.errors import BadInput, Fault, Refused
from graben.schemas.files import whole_file
from graben.schemas.quantities import key, plain_number, to_si
from graben.schemas.reading import parse_toml, read_toml
from graben.schemas.scene import InputFile, Model
from graben.schemas.toml_text import toml_value

_LARGEST = 1e12
"""Largest magnitude of a dimensionless parameter."""


def parameter_to_si(law: str, name: str, value: Any) -> Any:
    """One value as files give it -> a float in SI, a word, or rows of floats. Refused says what was expected."""
    p = parameter(law, name)
    if p is None:
        raise Refused(f"a parameter of {law}: {', '.join(p.name for p in PARAMETERS[law])}")
    if p.form == "word" and "table" in p.choices and isinstance(value, list | tuple):
        return _rows(value, "Pa")  # rows instead of the word "table" with rows elsewhere
    if p.form == "word":
        if not isinstance(value, str):
            raise Refused("a word")
        return value
    if p.form == "table":
        return _rows(value, p.unit)
    if p.unit == "1":
        return _number(value)
    return to_si(value, p.unit, tiny=True)  # a fit may end at 1e-17


def _rows(value: Any, unit: str) -> list[list[float]]:
    """Rows of a number and a quantity."""
    if not isinstance(value, list | tuple) or not all(isinstance(r, list | tuple) and len(r) == 2 for r in value):
        raise Refused('rows of plastic strain and stress, such as [[0.0, "60 MPa"], [0.1, "90 MPa"]]')
    return [[_number(x), to_si(y, unit, tiny=True)] for x, y in value]


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
    try:
        parameters_of(str(law))
    except Refused as error:
        return {}, [("law", law, str(error))]
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
    law: str | None = key(None, "name of the law: " + ", ".join(PARAMETERS) + ", or module:law")
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
        from graben.schemas.artifact import read_arrays

        try:
            tables = parse_toml(str(read_arrays(path, "calibration").attrs["material"]))
        except ValueError as error:
            if isinstance(error, BadInput):
                raise
            raise BadInput(Fault(str(path), "material", "", f"valid TOML ({error})")) from None
    else:
        _, tables = read_toml(path, "material file")
    extra = [
        Fault(str(path), k, "", "no such key (law, parameters, warnings)")
        for k in tables
        if k not in ("law", "parameters", "warnings")
    ]
    values, faults = _convert(tables.get("law"), tables.get("parameters", {}))
    found = extra + [Fault(str(path), k, repr(v), e) for k, v, e in faults]
    if found:
        raise BadInput(found)
    return str(tables["law"]), values


_READABLE = {"Pa": (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)), "rad": (("deg", 0.017453292519943295),), "m": ()}


def material_text(law: str, values: Mapping[str, Any], note: str = "", warnings: Sequence[str] = ()) -> str:
    """A NAME.material.toml that reads back to the same bits; readable units follow as comments.

    warnings : what a stage that uses the material has to repeat
    """
    told = [f"warnings = {toml_value(list(warnings))}"] if warnings else []
    lines = [f"# {line}" for line in note.splitlines()] + [f'law = "{law}"', *told, "", "[parameters]"]
    for name, value in values.items():
        p = parameter(law, name)
        assert p is not None  # values are of a law that took them
        unit = p.unit
        if isinstance(value, str):
            lines.append(f'{name} = "{value}"')
        elif p.form != "number":  # rows may stand for the word "table"
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


def write_material(
    path: str | Path, law: str, values: Mapping[str, Any], note: str = "", warnings: Sequence[str] = ()
) -> None:
    """Write `material_text` as a whole file or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(material_text(law, values, note, warnings), encoding="utf-8")
