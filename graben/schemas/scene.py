"""Scenes: TOML files, checked against pydantic models; every fault is reported at once."""

from __future__ import annotations

import copy
import hashlib
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, PrivateAttr, ValidationError, ValidationInfo

from graben.declared.knobs import Fidelity
from graben.errors import BadInput, Fault, Refused
from graben.schemas.old_keys import advice_on
from graben.schemas.quantities import Integer, key
from graben.schemas.reading import parse_toml, read_toml
from graben.schemas.toml_text import toml_text, toml_value

_SETTING = "# graben set: "
"""Begins each line on top of a scene's text that notes an override."""


class Model(BaseModel):
    """A table of a scene: unknown keys are faults, values do not change, defaults are checked too."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        validate_default=True,
        arbitrary_types_allowed=True,
        allow_inf_nan=False,
    )


@dataclass(frozen=True)
class Source:
    """Where a scene came from: its file, its text as run (overrides noted on top), and that text's SHA-256."""

    path: Path
    text: str
    overrides: tuple[str, ...] = field(default=())

    @property
    def effective_text(self) -> str:
        """The scene's text with the overrides of the call noted as comments on top."""
        return "".join(f"{_SETTING}{o}\n" for o in self.overrides) + self.text

    @property
    def sha256(self) -> str:
        return hashlib.sha256(self.effective_text.encode()).hexdigest()


def _name(text: str) -> str:
    if len(text) > 200 or _CONTROL.search(text):
        raise Refused("a name of at most 200 characters, in one line")
    return text


_CONTROL = re.compile("[\\x00-\\x1f\\x7f]")
Name = Annotated[str, AfterValidator(_name)]
"""A word or a few that tables, files and messages repeat."""


class Scene(Model):
    """The keys that every scene has. Each kind derives from this and declares ``kind: Literal["..."]``."""

    title: str = key("", "one line that says what this scene is")
    seed: Integer = key(
        0, "seed of everything random: the same scene and seed give bitwise the same arrays", ge=0, lt=2**32
    )
    fidelity: Fidelity = key("standard", "a measured point between speed and accuracy: draft, standard or reference")
    _source: Source | None = PrivateAttr(default=None)

    @property
    def source(self) -> Source:
        if self._source is None:
            raise RuntimeError("this scene was not made by load_scene")
        return self._source


def _existing_file(path: Path, info: ValidationInfo) -> Path:
    folder = (info.context or {}).get("folder", Path())
    resolved = path if path.is_absolute() else folder / path
    if (info.context or {}).get("check_files", True) and not os.path.isfile(resolved):
        raise Refused(f"an existing file (looked for {resolved})")
    return resolved


InputFile = Annotated[Path, AfterValidator(_existing_file)]
"""A path in a scene, relative to the scene's own folder; it must exist when the scene is loaded."""


Given = str | Path | Mapping[str, Any] | Scene
"""A scene as a caller gives it: a TOML file, tables with the same keys, or one that is checked already."""

Overrides = Iterable[str] | Mapping[str, Any]
"""Settings ``"table.key=value"``, or values by dotted key."""

UNNAMED = Path("(scene)")
"""What messages call a scene that lies in no file."""


def load_scene(given: Given, kind: str | Iterable[str], overrides: Overrides = (), name: Path = UNNAMED) -> Any:
    """Read and check a scene.

    Parameters
    ----------
    given : a TOML file, or tables; paths in tables are relative to the working directory
    kind : the kind, or kinds, of scene that the caller takes
    overrides : ``"table.key=value"`` settings, or values by dotted key, that replace keys of the scene
    name : what messages call tables

    Returns
    -------
    the scene model of that kind, with ``.source``

    Raises
    ------
    BadInput : every fault of the scene at once
    """
    from graben.schemas.kinds import SCENES, scene_model

    kinds = [kind] if isinstance(kind, str) else list(kind)
    settings = _settings(overrides)
    if isinstance(given, Scene):
        if not settings and getattr(given, "kind", None) in kinds:
            return given
        path, text, settings = given.source.path, given.source.text, (*given.source.overrides, *settings)
        tables = parse_toml(text)
    elif isinstance(given, Mapping):
        tables = parse_toml(_text_of(given, name))
        for setting in settings:
            _override(tables, setting)
        path, text, settings = name, _text_of(tables, name), ()
    else:
        path = Path(given)
        text, tables = read_toml(path, "scene file")
    for setting in settings:
        _override(tables, setting)
    found = tables.get("kind")
    if not isinstance(found, str) or found not in SCENES or found not in kinds:
        shown = "(absent)" if found is None else _shown(found)
        raise BadInput(Fault(str(path), "kind", shown, " or ".join(map(repr, kinds))))
    model = scene_model(found)
    try:
        scene = model.model_validate(tables, context={"folder": path.resolve().parent})
    except ValidationError as error:
        raise BadInput(_faults(str(path), found, error)) from None
    scene._source = Source(path, text, settings)
    return scene


def effective_tables(effective_text: str) -> dict[str, Any]:
    """The tables of a scene's text as run, with its overrides in place."""
    tables = parse_toml(effective_text)
    for line in effective_text.splitlines():
        if not line.startswith(_SETTING):
            break
        _override(tables, line.removeprefix(_SETTING))
    return tables


def _settings(overrides: Overrides) -> tuple[str, ...]:
    if not isinstance(overrides, Mapping):
        return tuple(overrides)
    try:
        return tuple(f"{name}={toml_value(value)}" for name, value in overrides.items())
    except Refused as error:
        raise BadInput(Fault("", "set", "", str(error), True)) from None


def _text_of(tables: Mapping[str, Any], name: Path) -> str:
    try:
        return toml_text(tables)
    except Refused as error:
        raise BadInput(Fault(str(name), "", "", str(error))) from None


_NO_SETTING = re.compile("[\\x00-\\x08\\x0a-\\x1f\\x7f\\ud800-\\udfff]")
"""Line breaks, other control characters and bytes that are no UTF-8."""


def _override(tables: dict[str, Any], setting: str) -> None:
    name, equals, raw = setting.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts) or len(parts) > 16 or _NO_SETTING.search(setting):
        expected = "KEY=VALUE with a dotted key, such as seed=3, in one line of text"
        raise BadInput(Fault("", "set", _shown(setting), expected, True))
    try:
        value = parse_toml(f"v = {raw}")["v"]
    except ValueError:
        value = raw.strip()  # an unquoted string, as shells like to leave it
    table = tables
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise BadInput(Fault("", "set", _shown(setting), f"a table at {part}", True))
    table[parts[-1]] = copy.deepcopy(value)


def _faults(file: str, kind: str, error: ValidationError) -> list[Fault]:
    faults, errors = [], error.errors(include_url=False)
    inner = {e["loc"][:depth] for e in errors for depth in range(len(e["loc"]))}
    for e in errors:
        # A list whose values have faults of their own counts as empty.
        if e["type"] == "too_short" and e["loc"] in inner:
            continue
        where = ".".join(str(part) for part in e["loc"])
        value = e.get("input")
        if e["type"] == "missing":
            found, expected = "(absent)", "a value"
        elif e["type"] == "extra_forbidden":
            found, expected = _shown(value), advice_on(kind, e["loc"])
        elif e["type"] in ("too_short", "too_long"):
            least, most = e["ctx"].get("min_length"), e["ctx"].get("max_length")
            found, expected = _shown(value), f"at most {most} values" if least is None else f"at least {least} values"
        else:
            found = _shown(value) if not isinstance(value, dict | BaseModel) else ""
            expected = e["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
        faults.append(Fault(file, where if len(where) < 200 else where[:200] + "...", found, expected))
    return faults


def _shown(value: Any) -> str:
    """A value for a message, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "a huge integer"
    return text if len(text) < 200 else text[:200] + "..."
