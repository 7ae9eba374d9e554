"""Settings that fit a budget of time: the finest fidelity whose predicted time does.

What a scene costs beyond its estimate is seen from a run of it at draft, made first where the budget is ample.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from graben.declared.costs import COSTS
from graben.declared.knobs import FIDELITIES, Fidelity, stage_of
from graben.errors import BadInput, Fault
from graben.schemas.kinds import SCENES
from graben.schemas.scene import Given, load_scene
from graben.stages.explain.machine import slowness
from graben.stages.explain.size import size_of
from graben.stages.explain.stage import promise_at
from graben.stages.shared.run_apart import measured

# A run at draft is made first where it takes at most this share of the budget.
_PILOT = 0.2


@dataclass(frozen=True)
class Choice:
    """fidelity : that fits; error : that it promises, None where none is known

    predicted : time until the run is done, what a run at draft took included; budget, begun : by the clock [s]
    tried : whether the prediction rests on a run at draft
    """

    fidelity: Fidelity
    predicted: float
    error: float | None
    tried: bool
    budget: float
    begun: float

    @property
    def words(self) -> str:
        """For a person, before the run starts."""
        worth = "its error is not known" if self.error is None else f"its error is {100 * self.error:.2g} %"
        after = ", after a run at draft" if self.tried else ""
        return f"within {self.budget:.4g} s: fidelity {self.fidelity}, about {self.predicted:.3g} s{after}; {worth}"

    def told(self, headline: dict[str, Any]) -> dict[str, Any]:
        """The headline numbers of the run, with what the budget was and what it took."""
        wall = time.monotonic() - self.begun
        more = {"budget_s": self.budget, "predicted_s": self.predicted, "wall_s": wall}
        return headline | more | {"chosen": {"fidelity": self.fidelity}, "expected_error": self.error}


def choose(
    scene: Given, command: Sequence[str], inputs: Sequence[Path], overrides: Sequence[str], budget: float
) -> Choice:  # fmt: skip
    """The finest fidelity whose run fits the budget, on this machine.

    Parameters
    ----------
    command : arguments of `graben` that run the scene as it is, without output
    inputs : files among them; budget : s

    Raises
    ------
    BadInput : faults of the scene, a kind without fidelities, or a budget in which not even a draft fits
    """
    begun = time.monotonic()
    read = load_scene(scene, tuple(SCENES), overrides)
    if stage_of(read.kind) is None:
        expected = f"no budget: a run of kind {read.kind!r} has no knob of accuracy, and takes seconds"
        raise BadInput(Fault("", "budget", f"{budget:g} s", expected, True))
    slow = slowness()
    times = {f: slow * _cpu(read, inputs, f) for f in FIDELITIES}
    ratio = None
    if times["draft"] <= _PILOT * budget:
        start = slow * COSTS[read.kind].start
        ratio = _pilot(command, start, times["draft"], 0.5 * budget)
        if ratio is not None:
            times = {f: start + ratio * (t - start) for f, t in times.items()}
    tried, spent = ratio is not None, time.monotonic() - begun
    fits = [f for f in FIDELITIES if spent + times[f] <= budget]
    if not fits:
        expected = f"at least {spent + times['draft']:.3g} s, in which this scene runs at draft"
        raise BadInput(Fault("", "budget", f"{budget:g} s", expected, True))
    best = fits[-1]
    return Choice(best, spent + times[best], promise_at(read.kind, best).error, tried, budget, begun)


def _cpu(scene: Any, inputs: Sequence[Path], fidelity: Fidelity) -> float:
    """CPU time at a fidelity [s], on the machine of the costs; infinite where no machine bears it."""
    try:
        size = size_of(load_scene(scene, scene.kind, {"fidelity": fidelity}), inputs)
    except BadInput:
        if fidelity == "draft":
            raise
        return math.inf
    if not size.complete:
        expected = "no budget: what this run takes is not known before it is made (see graben explain)"
        raise BadInput(Fault("", "budget", "", expected, True))
    return size.cpu


def _pilot(command: Sequence[str], start: float, predicted: float, limit: float) -> float | None:
    """Time of a run at draft over the one predicted, both without the start; None where it fails.

    limit : by the clock [s]; a run that takes longer counts with that time
    """
    with tempfile.TemporaryDirectory(prefix="graben-") as folder:
        found = measured([*command, "--set", "fidelity=draft"], Path(folder), limit)
    if (found.code != 0 and found.wall_s < limit) or predicted <= start:
        return None
    return max(0.1, (found.wall_s - start) / (predicted - start))
