"""Loops over indices that are known not to be negative."""

from __future__ import annotations

import numpy as np

from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def span(begin, end):
    """range(begin, end) of unsigned numbers, for begin and end from 0 on.

    An index that may be negative is compared with zero at every look-up, since it may count from the end of an
    array. In short loops that is a third of the time. Tables of indices are unsigned for the same reason.
    """
    return range(np.uint64(begin), np.uint64(end))
