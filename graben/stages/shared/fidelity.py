"""Values of knobs in a scene: what it says itself, and where it says nothing, what its fidelity means."""

from __future__ import annotations

from functools import reduce
from typing import Any

from graben.declared.knobs import values_at


def setting(scene: Any, key: str) -> Any:
    """Value of a knob, or its rule: that of the scene's key, and of its fidelity where the key is left out."""
    given = _of(scene, key)
    return values_at(scene.kind, scene.fidelity)[key] if given is None else given


def factor_of(scene: Any, key: str) -> float:
    """What the value of a key is multiplied by at the scene's fidelity."""
    rule = values_at(scene.kind, scene.fidelity)[key]
    return float(_of(scene, rule.key) if rule.key else rule.factor)


def _of(scene: Any, key: str) -> Any:
    return reduce(getattr, key.split("."), scene)
