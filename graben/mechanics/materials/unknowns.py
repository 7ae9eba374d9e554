"""The strains that a point under stress control does not know, and the linear equations for them.

Axes under one and the same stress share one strain where the law is isotropic and nothing shears them. On an edge
of a yield surface (Mohr-Coulomb with s1 = s2) every split of the flow among them satisfies the stresses; the
symmetry of the test picks the one that happens. Axes under different stresses have strains of their own.
"""

from __future__ import annotations

from graben.mechanics.compiled import kernel
from graben.mechanics.materials.laws import isotropic


@kernel(error_model="numpy")
def solve_small(a, b, m):
    """Solve a[:m, :m] x = b[:m] by elimination with pivoting, x into b. False when singular."""
    if m == 1:  # a test under one constant lateral stress, which most paths are
        if a[0, 0] == 0.0:
            return False
        b[0] /= a[0, 0]
        return abs(b[0]) < 1e100
    for i in range(m):
        pivot = i
        for r in range(i + 1, m):
            if abs(a[r, i]) > abs(a[pivot, i]):
                pivot = r
        if not abs(a[pivot, i]) > 0.0:
            return False
        if pivot != i:
            for c in range(i, m):
                a[i, c], a[pivot, c] = a[pivot, c], a[i, c]
            b[i], b[pivot] = b[pivot], b[i]
        for r in range(i + 1, m):
            ratio = a[r, i] / a[i, i]
            if ratio != 0.0:
                for c in range(i, m):
                    a[r, c] -= ratio * a[i, c]
                b[r] -= ratio * b[i]
    for i in range(m - 1, -1, -1):
        for c in range(i + 1, m):
            b[i] -= a[i, c] * b[c]
        b[i] /= a[i, i]
        if not abs(b[i]) < 1e100:
            return False
    return True


@kernel(error_model="numpy")
def number_unknowns(law_id, control, targets, sig, tolerance, share):
    """Number the unknown strains of a path; returns how many there are.

    share (n,) gets the number of each component's strain, -1 under strain control. Normal components of an isotropic
    law share one where their stresses agree, now and in every row of targets (rows, n), and all shears are nil.
    """
    rows, n = targets.shape
    alike = isotropic(law_id)
    for k in range(3, n):
        alike = alike and sig[k] == 0.0
        for row in range(rows):
            alike = alike and targets[row, k] == (0.0 if control[k] == 1 else targets[0, k])
    m = 0 * n  # not the literal 0, which would compile `increment` twice
    for i in range(n):
        share[i] = -1
        if control[i] == 0:
            continue
        for j in range(min(i, 3)):
            if i < 3 and control[j] == 1 and share[i] < 0 and alike:
                apart, size = abs(sig[i] - sig[j]), abs(sig[i]) + abs(sig[j])
                for row in range(rows):
                    apart = max(apart, abs(targets[row, i] - targets[row, j]))
                    size = max(size, abs(targets[row, i]) + abs(targets[row, j]))
                if apart <= tolerance * size:
                    share[i] = share[j]
        if share[i] < 0:
            share[i] = m
            m += 1
    return m


@kernel(error_model="numpy")
def equations(share, m, miss, tangent, a, b):
    """a[:m, :m] x = b[:m]: the unknown strains x that add the stresses miss (n,), as means over each share."""
    n = share.shape[0]
    for i in range(m):
        b[i] = 0.0
        for j in range(m):
            a[i, j] = 0.0
        count = 0
        for r in range(n):
            if share[r] == i:
                count += 1
                b[i] += miss[r]
                for q in range(n):
                    if share[q] >= 0:
                        a[i, share[q]] += tangent[r, q]
        b[i] /= count
        for j in range(m):
            a[i, j] /= count


@kernel(error_model="numpy")
def level(share, m, sig):
    """Components that share a strain get the mean of their stresses: they differ by rounding, which must not grow."""
    n = share.shape[0]
    for i in range(m):
        total, count = 0.0, 0
        for r in range(n):
            if share[r] == i:
                total += sig[r]
                count += 1
        if count > 1:
            for r in range(n):
                if share[r] == i:
                    sig[r] = total / count
