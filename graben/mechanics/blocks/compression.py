"""Biaxial compression of a block assembly: consolidate under confinement, then move the top wall down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from graben.mechanics.blocks import relaxation as rx
from graben.mechanics.blocks.model import BlockModel, Damping
from graben.mechanics.failure import NumericsFailed

# Rest comes soonest with more damping than a moving wall should feel.
_CONSOLIDATION_DAMPING = 1.0


@dataclass(frozen=True)
class Sides:
    """Sides of the outline by their direction: indices of bottom, right, top and left."""

    bottom: int
    right: int
    top: int
    left: int


def rectangle_sides(outline: np.ndarray) -> Sides:
    """Sides of an upright rectangle (4, 2), counter-clockwise; ValueError for anything else."""
    d = np.roll(outline, -1, axis=0) - outline
    if len(outline) != 4 or np.any(np.abs(d[:, 0] * d[:, 1]) > 1e-9 * np.abs(d).max() ** 2):
        raise ValueError("biaxial compression needs an upright rectangle as domain")
    return Sides(int(np.argmax(d[:, 0])), int(np.argmax(d[:, 1])), int(np.argmin(d[:, 0])), int(np.argmin(d[:, 1])))


def consolidate(
    model: BlockModel,
    lateral: float,
    vertical: float,
    *,
    tolerance: float = 1e-3,
    chunk: int = 250,
    limit: int = 20000,
) -> float:
    """Press left and right with `lateral`, the top with `vertical` [Pa, tension positive]; bottom on rollers.

    Steps until the unbalanced force falls below `tolerance`; returns the ratio reached. Raises NumericsFailed when
    it does not within `limit` steps.
    """
    b = model.bodies
    sides = rectangle_sides(b.outline)
    model.hold(b.vertex_side[:, sides.bottom], 1)
    for side in (sides.left, sides.right):
        model.press(b.edge_side == side, lateral)
    model.press(b.edge_side == sides.top, vertical)
    ratio = np.inf
    damping, model.damping = model.damping, Damping(ratio=_CONSOLIDATION_DAMPING)
    for _ in range(0, limit, chunk):
        model.advance(chunk)
        ratio = model.unbalanced_ratio()
        if ratio < tolerance:
            model.damping = damping
            return ratio
    raise NumericsFailed(
        f"unbalanced force ratio {ratio:.3g} (limit {tolerance:.3g})",
        where="consolidation",
        step=model.steps_done,
        advice="strengthen the joints or lower the confining stress",
    )


def compress(
    model: BlockModel,
    speed: float,
    steps: int,
    states: int,
    save: Callable[[int, BlockModel], None],
    *,
    ramp_share: float = 0.01,
    saved: int = 0,
) -> None:
    """Move the top at `speed` [m/s, negative: down] for `steps` steps; call save(k, model) at `states` states.

    State 0 is the start. The speed rises over the first `ramp_share` of the steps. The pressure on the top is
    dropped: the wall now carries it. saved : states that a model brought back from a snapshot has behind it.
    """
    b = model.bodies
    top = b.vertex_side[:, rectangle_sides(b.outline).top]
    if saved == 0:
        model.motion.tally[:] = 0.0
        model.motion.sums[rx.FRICTION] = 0.0
        save(0, model)
        saved = 1
    if saved == 1:
        model.skeleton.steady[top, 1] = model.weight[top, 1]
        model.hold(top, 1, speed)
        d = model.motion.drive
        d[rx.SPEED], d[rx.SPEED_STEP] = 0.0, 1.0 / max(1.0, ramp_share * steps)
    for k in range(saved, states):
        model.advance(round(steps * k / (states - 1)) - round(steps * (k - 1) / (states - 1)))
        save(k, model)
