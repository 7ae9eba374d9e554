"""The state of a run of blocks as arrays, and back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.protocol import Loading
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History
from graben.mechanics.stored import Arrays, named, part_of


def state_of(model: BlockModel, test: Loading) -> Arrays:
    """The state that was just saved, and all that the loading needs to go on."""
    own = {name: np.array(values) for name, values in test.state().items()}
    return named("model", snapshot.take(model)) | named("test", own)


def states_of(history: History) -> Callable[[], Arrays]:
    """What gives the states that are saved up to now; they may be many, and are not copied before."""
    states = len(history.time)
    return lambda: named("history", history.stored(states))


def bring_back(stored: Arrays, model: BlockModel, test: Loading, history: History) -> None:
    """Take up what `state_of` and `states_of` gave. Refused where it is none of such a run."""
    snapshot.bring_back(model, part_of(stored, "model"))
    test.bring_back(part_of(stored, "test"))
    history.bring_back(part_of(stored, "history"))
