"""The state of a run of blocks as arrays, and back."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.protocol import Loading
from graben.mechanics.blocks.record import snapshot
from graben.mechanics.blocks.record.history import History
from graben.mechanics.stored import Arrays, named, part_of


def state_of(model: BlockModel, test: Loading, history: History) -> Arrays:
    """The state that was just saved, and all that the loading needs to go on."""
    rows = history.stored(len(history.time))
    own = {name: np.array(values) for name, values in test.state().items()}
    return named("model", snapshot.take(model)) | named("test", own) | named("history", rows)


def bring_back(stored: Arrays, model: BlockModel, test: Loading, history: History) -> None:
    """Take up a state of `state_of`. Refused where it is none of such a run."""
    snapshot.bring_back(model, part_of(stored, "model"))
    test.bring_back(part_of(stored, "test"))
    history.bring_back(part_of(stored, "history"))
