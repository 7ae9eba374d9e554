"""What a test of a block model is to the stage that runs it: moments to save and to tell of, a state to keep."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from graben.errors import Refused

State = dict[str, np.ndarray]


class Moment(NamedTuple):
    """Where a test stands: fraction done (0 to 1), a few words, and whether this state belongs to the history."""

    fraction: float
    words: str
    save: bool = False


class Loading(Protocol):
    """A test of one model.

    The stage iterates: first over `begin`, then over `run`. In between the model stands still, so that states can be
    saved. A run that goes on from a saved state skips `begin`: `bring_back` puts the test, as a snapshot puts the
    model, where it was, and `run` takes it from there. What `run` needs between two moments is in `state`.
    """

    rest: np.ndarray
    """(2,) unbalanced force ratio at which the model came to rest, and the steps that took."""

    @property
    def failed(self) -> bool:
        """Whether the body has failed. A fall may be fast: the energy that it loses is told, and stops nothing."""

    def begin(self) -> Iterator[Moment]:
        """Bring the model to rest under what acts from the start. NumericsFailed where it does not come to rest."""

    def run(self) -> Iterator[Moment]:
        """Load from where the test stands to its end; the first saved state is the model at rest."""

    def state(self) -> State:
        """What a saved state must hold beside the model."""

    def bring_back(self, state: State) -> None:
        """Take up a `state`. Refused where it is not one of such a test."""


def refuse_unlike(state: State, own: State, changing: Iterable[str] = ()) -> None:
    """Refused where a state of the loading is not of the shapes and kinds of its own first one.

    changing : names whose first length changes in a run
    """
    for name, values in own.items():
        found, like = state.get(name), np.asarray(values)
        skip = 1 if name in changing else 0
        alike = found is not None and found.dtype.kind == like.dtype.kind and found.ndim == like.ndim
        if found is None or not alike or found.shape[skip:] != like.shape[skip:]:
            raise Refused(f"test.{name}: shape {like.shape} of {like.dtype}")
        if found.dtype.kind == "f" and np.isnan(found).any():
            raise Refused(f"test.{name}: numbers")
