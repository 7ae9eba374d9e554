"""Unsigned ranges, and operations side by side: the same numbers as without."""

import numba
import numpy as np

from graben.mechanics.compiled import _with_pairing
from graben.mechanics.unsigned import span


@numba.njit
def _listed(begin, end):
    out = np.zeros(10, dtype=np.int64)
    for k in span(begin, end):
        out[k] = k
    return out


def _turned(x, c, s, out):
    for i in range(x.shape[0]):
        a, b = x[i, 0], x[i, 1]
        out[i, 0] = c * a - s * b
        out[i, 1] = s * a + c * b


def test_span_counts_like_range():
    assert _listed(2, 5).tolist() == [0, 0, 2, 3, 4, 0, 0, 0, 0, 0]
    assert not _listed(5, 5).any()


def test_pairing_changes_no_bit():
    x = np.random.default_rng(1).normal(size=(100, 2))
    out = np.zeros((2, 100, 2))
    for k, pairing in enumerate((False, True)):
        turned = numba.njit(_turned)
        if pairing:
            turned._compiler.compile = _with_pairing(turned._compiler.compile)
        turned(x, 0.8, 0.6, out[k])
    assert numba.config.SLP_VECTORIZE == 0
    assert out[0].tobytes() == out[1].tobytes() and out.any()
