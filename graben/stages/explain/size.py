"""How large a run of any scene will be, by the estimates of its stage: work, steps, memory, CPU time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graben.declared.costs import COSTS
from graben.errors import Fault, Incomplete
from graben.stages.shared.estimate import Estimate, refuse_too_large

# Python and the libraries, before a scene is read.
_LIBRARIES_BYTES = 2.5e8


@dataclass(frozen=True)
class Size:
    """A run before it is made.

    estimates : as the stage gives them; complete : False where inputs are missing that decide the rest
    work : things times steps; steps : 0 where there are none; memory : bytes
    cpu : s on the machine of the costs
    """

    estimates: list[Estimate]
    complete: bool
    work: float
    steps: float
    memory: float
    cpu: float


def size_of(scene: Any, inputs: Sequence[Path] = ()) -> Size:
    """Size of a scene's run. inputs : files that its command takes beside it

    Raises
    ------
    BadInput : what the stage refuses before its work
    """
    try:
        estimates, complete = _STAGES[scene.kind](scene, list(inputs)), True
    except Incomplete:
        estimates, complete = [], False
    # A stage without steps does as much as it has samples.
    work = sum(e.count for e in estimates if e.steps) or max((e.count for e in estimates), default=0.0)
    return Size(
        estimates, complete, work, sum(e.steps for e in estimates),
        _LIBRARIES_BYTES + sum(e.bytes for e in estimates), COSTS[scene.kind].at(work),
    )  # fmt: skip


def _bearable(scene: Any, estimates: list[Estimate]) -> list[Estimate]:
    refuse_too_large(scene.source.path, estimates)
    return estimates


def _blocks(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.blocks.extent import extent_of, map_of
    from graben.stages.blocks.sizes import sizes_of

    return _bearable(scene, sizes_of(scene, extent_of(scene, map_of(scene))))


def _particles(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.particles.stage import prepare

    return prepare(scene)[2]


def _rev_study(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.rev_study.stage import prepare

    estimates = prepare(scene, max(1, len(inputs)))[1][:1]
    if scene.calibration is not None:
        # What its fits take depends on the law and on the curves of the runs.
        raise Incomplete([Fault(str(scene.source.path), "calibration", "", "a study without fits, to know its time")])
    return estimates


def _calibrate(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.calibrate.stage import prepare

    return prepare(scene, curves=inputs).sizes


def _fem(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.fem_run.mesh import mesh_of
    from graben.stages.fem_run.sizes import sizes_of

    if scene.mesh.method == "file":
        return _bearable(scene, sizes_of(scene, len(mesh_of(scene)[0].quads)))
    return _bearable(scene, sizes_of(scene))


def _scratch(scene: Any, inputs: list[Path]) -> list[Estimate]:
    from graben.stages.scratch.stage import prepare

    return prepare(scene, inputs[0] if inputs else None)[3]


def _wear(scene: Any, inputs: list[Path]) -> list[Estimate]:
    return []


_STAGES: dict[str, Callable[[Any, list[Path]], list[Estimate]]] = {
    "blocks": _blocks, "particles": _particles, "rev-study": _rev_study, "calibrate": _calibrate, "fem": _fem,
    "scratch": _scratch, "wear": _wear,
}  # fmt: skip
