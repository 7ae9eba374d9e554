"""Coming to rest: steps with more damping under loads that stay, until what is unbalanced is next to nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from graben.errors import NumericsFailed
from graben.mechanics.blocks.engine.model import BlockModel, Damping

# Rest comes soonest with more damping than a wall that moves, or a load that rises, should feel.
REST_DAMPING = Damping(ratio=1.0)


def imbalance(model: BlockModel) -> float:
    """Mean size of unbalanced forces on free vertices over the mean size of zone forces.

    Unlike the largest unbalanced force it does not hang on one small block. Where no force acts it is nothing.
    """
    left = float(np.hypot(*model.unbalanced_force().T).mean())
    scale = float(np.hypot(*model.motion.zone_force.T).mean())
    if max(left, scale) < model.rounding_force:
        return 0.0
    return left / scale if scale > 0.0 else np.inf


def settle(
    model: BlockModel,
    tolerance: float,
    measure: Callable[[BlockModel], float],
    *,
    limit: int,
    where: str,
    advice: str,
    chunk: int = 250,
) -> Iterator[float]:
    """Step until `measure` of the model falls below `tolerance`; gives what it is after every chunk of steps.

    Raises NumericsFailed, in the words given, when it does not within `limit` steps.
    """
    ratio = np.inf
    damping = model.damping
    model.damp(REST_DAMPING)
    for _ in range(0, limit, chunk):
        model.advance(chunk)
        ratio = measure(model)
        if ratio < tolerance:
            model.damp(damping)
            yield ratio
            return
        yield ratio
    raise NumericsFailed(
        f"unbalanced force ratio {ratio:.3g} (limit {tolerance:.3g})",
        where=where,
        step=model.steps_done,
        advice=advice,
    )
