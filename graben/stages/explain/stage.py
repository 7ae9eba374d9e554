"""explain: what a run of a scene will model, leave out, take and be worth. Nothing is run."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from graben.declared.knobs import FIDELITIES, Fidelity, Promise, stage_of
from graben.errors import BadInput
from graben.schemas.kinds import SCENES
from graben.schemas.scene import Given, Overrides, load_scene
from graben.stages.explain.features import features_of
from graben.stages.explain.machine import slowness
from graben.stages.explain.size import Size, size_of

# A key that makes a run dearer by less is not named.
_DEARER = 1.05

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)


def run(given: Given, inputs: Sequence[Path] = (), *, overrides: Overrides = ()) -> dict[str, Any]:
    """Read a scene, and estimate its run.

    Parameters
    ----------
    inputs : files that the stage's command takes beside the scene

    Returns
    -------
    kind, fidelity, models and leaves_out (sentences), sizes, steps, memory_bytes, cpu_s (on this machine),
    error and error_of (what the fidelity promises of which number; None where nothing was measured),
    fidelities (cpu_s and error of each), keys (what makes a run dearer: cost of half or twice the value, over
    its cost now), warnings

    Raises
    ------
    BadInput : faults of the scene, or a run that is too large
    """
    scene = load_scene(given, tuple(SCENES), overrides)
    slow = slowness()
    size = size_of(scene, inputs)
    with _quiet():
        fidelities = {f: _at(scene, inputs, f, slow) for f in FIDELITIES} if stage_of(scene.kind) else {}
        dearest = _dearest(scene, inputs, size) if size.complete else []
    held, left = features_of(scene)
    stage = stage_of(scene.kind)
    promise = promise_at(scene.kind, scene.fidelity)
    warnings = [] if size.complete else ["inputs are missing that decide the rest: sizes and times are not known"]
    return {
        "kind": scene.kind,
        "fidelity": scene.fidelity,
        "models": held,
        "leaves_out": left,
        "sizes": {e.name: e.count for e in size.estimates},
        "steps": size.steps or None,
        "memory_bytes": size.memory,
        "cpu_s": slow * size.cpu if size.complete else None,
        "error": promise.error,
        "error_of": stage.headline if stage is not None else None,
        "fidelities": fidelities,
        "keys": dearest,
        "warnings": warnings,
    }


@contextmanager
def _quiet() -> Iterator[None]:
    """What was said of the inputs once is not said again."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(before)


def promise_at(kind: str, fidelity: Fidelity) -> Promise:
    """What a kind's stage promises at a fidelity; a promise of nothing where it has none."""
    stage = stage_of(kind)
    if stage is None or not stage.promises:
        return Promise()
    return stage.promises[FIDELITIES.index(fidelity)]


def _at(scene: Any, inputs: Sequence[Path], fidelity: Fidelity, slow: float) -> dict[str, Any]:
    try:
        size = size_of(load_scene(scene, scene.kind, {"fidelity": fidelity}), inputs)
    except BadInput:  # too large for any machine
        return {"cpu_s": None, "error": None}
    return {"cpu_s": slow * size.cpu if size.complete else None, "error": promise_at(scene.kind, fidelity).error}


def _dearest(scene: Any, inputs: Sequence[Path], size: Size) -> list[dict[str, Any]]:
    """Keys that decide the sizes, the dearest first: cost with half or twice the value, whichever costs more."""
    found = []
    for key, value in {e.key: e.value for e in size.estimates}.items():
        match = _NUMBER.fullmatch(value)
        costs = {}
        for text in _changed(match) if match else ():
            try:
                costs[text] = size_of(load_scene(scene, scene.kind, [f"{key}={text}"]), inputs).cpu / size.cpu
            except BadInput:  # out of bounds, or too large
                continue
        if max(costs.values(), default=0.0) > _DEARER:
            text = max(costs, key=lambda t: costs[t])
            found.append({"key": key, "value": value, "to": text, "cost": costs[text]})
    return sorted(found, key=lambda row: -row["cost"])


def _changed(match: re.Match[str]) -> list[str]:
    """Half and twice a number, with its unit; whole numbers stay whole."""
    both = (0.5 * float(match[1]), 2.0 * float(match[1]))
    return [f"{round(x) if match[1].isdigit() else x}{match[2]}" for x in both]
