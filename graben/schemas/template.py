"""Scene templates: every key of a kind with its default, its meaning and its choices, as commented TOML."""

from __future__ import annotations

import json
import textwrap
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from graben.schemas.kinds import scene_model
from graben.schemas.toml_text import toml_value


def json_schema(kind: str) -> str:
    """JSON Schema of a scene kind, for editors."""
    return json.dumps(scene_model(kind).model_json_schema(), indent=2) + "\n"


def template(kind: str) -> str:
    """A scene of this kind as TOML: required keys with an example, optional ones with their default."""
    model = scene_model(kind)
    head = [f"# Scene of kind {kind!r}: {(model.__doc__ or '').strip().splitlines()[0]}"]
    return "\n".join([*head, f'kind = "{kind}"', *_table(model, "", skip=("kind",))]) + "\n"


def _table(model: type[BaseModel], prefix: str, skip: tuple[str, ...] = ()) -> list[str]:
    plain: list[str] = []
    tables: list[str] = []
    for name, info in model.model_fields.items():
        if name in skip:
            continue
        inner = _inner_model(info)
        value = _example(info)
        if inner is not None and not isinstance(value, list | dict | BaseModel) and value is None:
            # An optional table that is off by default: shown, but commented out.
            tables += [
                "",
                *_comment(info),
                *(f"# {line}" if line else "#" for line in _named_table(inner, prefix + name)),
            ]
        elif inner is not None and value == []:
            # Rows that are none by default: one is shown, commented out.
            tables += ["", *_comment(info), *(f"# {line}" for line in [f"[[{prefix}{name}]]", *_row(inner)])]
        elif inner is not None and isinstance(value, list):
            for item in value:
                tables += ["", *_comment(info), f"[[{prefix}{name}]]", *_given(item)]
        elif inner is not None and isinstance(value, dict):
            tables += ["", *_comment(info), f"[{prefix}{name}]", *_given(value)]
        elif inner is not None:
            tables += ["", *_comment(info), *_named_table(inner, prefix + name)]
        elif isinstance(value, dict):
            tables += ["", *_comment(info), f"[{prefix}{name}]", *_given(value)]
        elif value is None:
            plain += [*_comment(info), f"# {name} = ..."]
        else:
            plain += [*_comment(info), f"{name} = {toml_value(value)}"]
    return plain + tables


def _row(model: type[BaseModel]) -> list[str]:
    """Keys of one entry of a list; "..." stands for what has no default."""
    lines: list[str] = []
    for name, info in model.model_fields.items():
        known = bool(info.examples) or not info.is_required()
        value = _example(info) if known else None
        plain = value is None or isinstance(value, BaseModel) or value is _Default
        lines += [*_comment(info), f"{name} = ..." if plain else f"{name} = {toml_value(value)}"]
    return lines


def _named_table(model: type[BaseModel], name: str) -> list[str]:
    return [f"[{name}]", *_table(model, name + ".")]


def _given(values: dict[str, Any] | BaseModel) -> list[str]:
    if isinstance(values, BaseModel):
        values = values.model_dump(exclude_defaults=False)
    return [f"{k} = {toml_value(v)}" for k, v in values.items() if v is not None]


def _inner_model(info: FieldInfo) -> type[BaseModel] | None:
    return _find_model(info.annotation)


def _find_model(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) is None:
        return None
    for argument in get_args(annotation):
        found = _find_model(argument)
        if found is not None:
            return found
    return None


def _example(info: FieldInfo) -> Any:
    if info.examples:
        return info.examples[0]
    if info.default is not PydanticUndefined:
        return info.default
    if info.default_factory is not None:
        made = info.default_factory()  # type: ignore[call-arg]
        if not isinstance(made, BaseModel):
            return made
        return made if _find_model(info.annotation) is None else _Default
    if _find_model(info.annotation) is not None:
        return _Default
    raise TypeError(f"a required key without an example: {info}")


class _Default:
    """Marks a table whose own defaults are to be printed."""


def _comment(info: FieldInfo) -> list[str]:
    text = info.description or ""
    choices = _choices(info.annotation)
    if choices:
        text += f" [{' | '.join(map(str, choices))}]"
    return [f"# {line}" for line in textwrap.wrap(text, 108)]


def _choices(annotation: Any) -> tuple[Any, ...]:
    from typing import Literal

    if get_origin(annotation) is Literal:
        return get_args(annotation)
    for argument in get_args(annotation):
        found = _choices(argument)
        if found:
            return found
    return ()
