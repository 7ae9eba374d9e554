"""Rotation of an element and the strain increment seen in its rotated frame.

Stress lives in the frame that turns with R of the polar decomposition F = R U (a Green-Naghdi rate): a law sees
small strain increments and never has to turn a tensor of its own, whatever it stores. R follows F from step to
step by one Newton step on the symmetry of R^T F; its error is of second order in the increment and does not
pile up, since each step starts from F itself. The Cayley transform keeps R orthogonal to round-off.
"""

from __future__ import annotations

from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def inverse3(m, out):
    """Inverse of m (3, 3) into out; returns the determinant."""
    c0 = m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1]
    c1 = m[1, 2] * m[2, 0] - m[1, 0] * m[2, 2]
    c2 = m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0]
    det = m[0, 0] * c0 + m[0, 1] * c1 + m[0, 2] * c2
    out[0, 0], out[1, 0], out[2, 0] = c0 / det, c1 / det, c2 / det
    out[0, 1] = (m[0, 2] * m[2, 1] - m[0, 1] * m[2, 2]) / det
    out[1, 1] = (m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]) / det
    out[2, 1] = (m[0, 1] * m[2, 0] - m[0, 0] * m[2, 1]) / det
    out[0, 2] = (m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]) / det
    out[1, 2] = (m[0, 2] * m[1, 0] - m[0, 0] * m[1, 2]) / det
    out[2, 2] = (m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]) / det
    return det


@kernel(error_model="numpy")
def follow_rotation(f, r, m, k):
    """Bring the rotation r (3, 3) up to the deformation gradient f (3, 3), in place; m, k (3, 3) are scratch.

    Solves ``(tr(M) I - M) w = axial(M - M^T)`` for M = R^T F, then R <- R cayley(w).
    """
    for i in range(3):
        for j in range(3):
            m[i, j] = r[0, i] * f[0, j] + r[1, i] * f[1, j] + r[2, i] * f[2, j]
    # axial vector of the skew part: M = exp(w) U gives M - M^T ~ W U + U W
    a0, a1, a2 = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    s01, s12, s02 = 0.5 * (m[0, 1] + m[1, 0]), 0.5 * (m[1, 2] + m[2, 1]), 0.5 * (m[0, 2] + m[2, 0])
    m[0, 0], m[1, 1], m[2, 2] = trace - m[0, 0], trace - m[1, 1], trace - m[2, 2]
    m[0, 1] = m[1, 0] = -s01
    m[1, 2] = m[2, 1] = -s12
    m[0, 2] = m[2, 0] = -s02
    inverse3(m, k)
    # half of the rotation vector, for the Cayley transform
    h0 = 0.5 * (k[0, 0] * a0 + k[0, 1] * a1 + k[0, 2] * a2)
    h1 = 0.5 * (k[1, 0] * a0 + k[1, 1] * a1 + k[1, 2] * a2)
    h2 = 0.5 * (k[2, 0] * a0 + k[2, 1] * a1 + k[2, 2] * a2)
    square = h0 * h0 + h1 * h1 + h2 * h2
    scale = 2.0 / (1.0 + square)
    m[0, 0] = 1.0 + scale * (h0 * h0 - square)
    m[1, 1] = 1.0 + scale * (h1 * h1 - square)
    m[2, 2] = 1.0 + scale * (h2 * h2 - square)
    m[0, 1], m[1, 0] = scale * (h0 * h1 - h2), scale * (h0 * h1 + h2)
    m[1, 2], m[2, 1] = scale * (h1 * h2 - h0), scale * (h1 * h2 + h0)
    m[0, 2], m[2, 0] = scale * (h0 * h2 + h1), scale * (h0 * h2 - h1)
    for i in range(3):
        b0, b1, b2 = r[i, 0], r[i, 1], r[i, 2]
        for j in range(3):
            r[i, j] = b0 * m[0, j] + b1 * m[1, j] + b2 * m[2, j]


@kernel(error_model="numpy")
def midstep_increment(a, r, deps, m, k):
    """Strain increment deps (6,) (engineering shears, frame of r) from a (3, 3) = d(step)/d(end position).

    With the step's own gradient Fr, a = I - Fr^-1, and the increment at mid-step is ``a (I - a/2)^-1``: its
    symmetric part vanishes exactly for a rigid rotation of any size (Hughes and Winget 1980).
    """
    for i in range(3):
        for j in range(3):
            m[i, j] = -0.5 * a[i, j]
        m[i, i] += 1.0
    inverse3(m, k)
    for i in range(3):
        for j in range(3):
            m[i, j] = a[i, 0] * k[0, j] + a[i, 1] * k[1, j] + a[i, 2] * k[2, j]
    d00, d11, d22 = m[0, 0], m[1, 1], m[2, 2]
    d01, d12, d02 = 0.5 * (m[0, 1] + m[1, 0]), 0.5 * (m[1, 2] + m[2, 1]), 0.5 * (m[0, 2] + m[2, 0])
    for i in range(3):
        k[0, i] = d00 * r[0, i] + d01 * r[1, i] + d02 * r[2, i]
        k[1, i] = d01 * r[0, i] + d11 * r[1, i] + d12 * r[2, i]
        k[2, i] = d02 * r[0, i] + d12 * r[1, i] + d22 * r[2, i]
    deps[0] = r[0, 0] * k[0, 0] + r[1, 0] * k[1, 0] + r[2, 0] * k[2, 0]
    deps[1] = r[0, 1] * k[0, 1] + r[1, 1] * k[1, 1] + r[2, 1] * k[2, 1]
    deps[2] = r[0, 2] * k[0, 2] + r[1, 2] * k[1, 2] + r[2, 2] * k[2, 2]
    deps[3] = 2.0 * (r[0, 0] * k[0, 1] + r[1, 0] * k[1, 1] + r[2, 0] * k[2, 1])
    deps[4] = 2.0 * (r[0, 1] * k[0, 2] + r[1, 1] * k[1, 2] + r[2, 1] * k[2, 2])
    deps[5] = 2.0 * (r[0, 2] * k[0, 0] + r[1, 2] * k[1, 0] + r[2, 2] * k[2, 0])


@kernel(error_model="numpy")
def rotate_stress(s, r, out, k):
    """Stress s (6,) of the frame r as a full tensor out (3, 3) in space: R s R^T."""
    for i in range(3):
        k[i, 0] = r[i, 0] * s[0] + r[i, 1] * s[3] + r[i, 2] * s[5]
        k[i, 1] = r[i, 0] * s[3] + r[i, 1] * s[1] + r[i, 2] * s[4]
        k[i, 2] = r[i, 0] * s[5] + r[i, 1] * s[4] + r[i, 2] * s[2]
    for i in range(3):
        for j in range(3):
            out[i, j] = k[i, 0] * r[j, 0] + k[i, 1] * r[j, 1] + k[i, 2] * r[j, 2]
