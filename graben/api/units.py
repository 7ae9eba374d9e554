"""Numbers of Python callers, in SI, as the text with units that scenes take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from graben.declared import laws
from graben.errors import BadInput, Fault, Refused
from graben.schemas.kinds import scene_model
from graben.schemas.quantities import to_si


def si(value: float | str, unit: str, argument: str) -> float:
    """A number in the SI unit `unit`, from a number or from text with a unit; BadInput names the argument."""
    try:
        return to_si(value, unit) if isinstance(value, str) else float(value)
    except (Refused, TypeError, ValueError) as error:
        raise BadInput(Fault("", argument, repr(value), f"a number in {unit}, or text ({error})", True)) from None


def in_units(kind: str, tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of a scene of that kind, where numbers without unit get the SI unit of their key."""
    schema = scene_model(kind).model_json_schema()
    out: dict[str, Any] = _with_units(schema, dict(tables), schema.get("$defs", {}))
    return out


def _with_units(schema: dict[str, Any], value: Any, defs: dict[str, Any]) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if "$ref" in schema:
        return _with_units(defs[schema["$ref"].rpartition("/")[2]], value, defs)
    for choice in schema.get("anyOf", schema.get("allOf", ())):
        changed = _with_units(choice, value, defs)
        if changed is not value and changed != value:
            return changed
    if "x-unit" in schema and isinstance(value, int | float) and not isinstance(value, bool):
        return f"{float(value)!r} {schema['x-unit']}"
    if isinstance(value, Mapping):
        parts = schema.get("properties", {})
        return {k: _with_units(parts.get(k, {}), v, defs) for k, v in value.items()}
    if isinstance(value, list | tuple):
        several = schema.get("prefixItems", [])
        rest = schema.get("items") or {}
        return [_with_units(several[k] if k < len(several) else rest, v, defs) for k, v in enumerate(value)]
    return value


def known(law: str, argument: str) -> None:
    """Find the law of that name, in the module that it names where it does; BadInput where there is none."""
    try:
        laws.parameters_of(law)
    except Refused as error:
        raise BadInput(Fault("", argument, repr(law), str(error), True)) from error


def parameter(law: str, name: str, value: Any) -> Any:
    """A law's parameter as scenes take it: numbers get their unit, tables row by row."""
    p = laws.parameter(law, name)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, int | float) and p is not None and p.form == "number" and p.unit != "1":
        return f"{float(value)!r} {p.unit}"
    if isinstance(value, list | tuple):
        return [[x, y if isinstance(y, str) else f"{float(y)!r} Pa"] for x, y in value]
    return value
