"""How long misfits last along a curve, judged from residuals of a fit that has already taken some of it away.

Within a group (one quantity along one curve) residuals are taken as a first-order autoregressive sequence: deviation
s_g, correlation rho^d between points d apart, one rho for all groups. A fit with k parameters makes residuals smaller
and less correlated than the errors are, by what it can follow of them: with Q an orthonormal basis of the Jacobian's
columns and M = I - Q Q^T, residuals of errors with covariance R have covariance M R M. So rho is the one for which
the expected lag-one product over the expected square, tr(L M R M) / tr(M R M), is what the residuals show, plus one
standard error of it, since too small a rho makes every interval too narrow. All by products with Q: no matrix of
points by points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LARGEST = 0.98
_PASSES = 4


def _filtered(columns: Array, rho: float) -> Array:
    """R columns for one group, R_ij = rho^|i - j|."""
    from scipy.signal import lfilter  # slow to import, and used at the end of a fit only

    ahead = lfilter([1.0], [1.0, -rho], columns, axis=0)
    behind = lfilter([1.0], [1.0, -rho], columns[::-1], axis=0)[::-1]
    return np.asarray(ahead + behind - columns, dtype=np.float64)


def _expected(parts: list[Array], rho: float) -> tuple[float, Array]:
    """tr(L M R M), and tr(M R M) over each group, for unit deviations; parts: the rows of Q of each group."""
    filtered = [_filtered(q, rho) for q in parts]
    qrq = sum((q.T @ f for q, f in zip(parts, filtered)), np.zeros((parts[0].shape[1],) * 2))
    lagged, squares = 0.0, np.empty(len(parts))
    for i, (q, f) in enumerate(zip(parts, filtered)):
        lagged += (
            (len(q) - 1) * rho - np.sum(f[1:] * q[:-1]) - np.sum(f[:-1] * q[1:]) + np.sum((q[1:] @ qrq) * q[:-1])
        )
        squares[i] = len(q) - 2.0 * np.sum(q * f) + np.sum((q @ qrq) * q)
    return float(lagged), squares


def _basis(columns: Array) -> Array:
    """Orthonormal basis of what columns (m, k) span; those that are rounding only, or nil, span nothing."""
    u, size, _vt = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    return np.asarray(u[:, size > 1e-6])


def lasting_meat(j: Array, r: Array, groups: NDArray[np.int64], beside: Array | None = None) -> tuple[Array, float]:
    """J^T S J (k, k) with S the covariance of errors estimated from residuals r (m,) with Jacobian j (m, k), and rho.

    groups (m,), beside (m, b) as in `identify`; groups of less than three points have no scatter of their own and are
    left out.
    """
    k = j.shape[1]
    members = [np.flatnonzero(groups == g) for g in np.unique(groups)]
    members = [b for b in members if len(b) > 2]
    if not members or not np.any(r):
        return np.zeros((k, k)), 0.0
    taken = j if beside is None else np.concatenate([j, beside], axis=1)
    square = np.array([max(float(r[b] @ r[b]), 1e-300) for b in members])
    counts = np.array([len(b) for b in members])
    variance, rho = square / counts, 0.0
    for _pass in range(_PASSES):  # deviations want rho, and rho wants deviations
        size = np.ones(len(r))
        for b, v in zip(members, variance):
            size[b] = np.sqrt(v)
        basis = _basis(taken / size[:, None])
        parts = [basis[b] for b in members]
        shown = sum(float(r[b][1:] @ r[b][:-1]) / v for b, v in zip(members, variance)) / np.sum(square / variance)
        low, high = 0.0, _LARGEST
        for _ in range(20):
            rho = 0.5 * (low + high)
            lagged, squares = _expected(parts, rho)
            low, high = (rho, high) if lagged < shown * squares.sum() else (low, rho)
        variance = square / np.maximum(_expected(parts, low)[1], 0.1)
    rho = min(_LARGEST, low + float(np.sqrt((1.0 - low * low) / counts.sum())))
    variance = square / np.maximum(_expected(parts, rho)[1], 0.1)
    total = np.zeros((k, k))
    for b, v in zip(members, variance):
        total += v * j[b].T @ _filtered(j[b], rho)
    return total, rho
