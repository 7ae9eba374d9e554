"""Hardening curves: yield stress and slope as functions of the equivalent plastic strain.

Each is a compiled function of plain numbers, so that every law can offer the same choices.
"""

from __future__ import annotations

import math

from graben.mechanics.compiled import kernel

EXPONENTIAL, BARCELONA, LINEAR, TABLE = 0, 1, 2, 3  # the order of the declared choices


@kernel(error_model="numpy")
def barcelona_coefficients(initial, peak, strain_at_peak):
    """alpha and beta of the Barcelona curve from its peak, Y (2.69)-(2.70).

    A peak at or below the initial stress gives alpha 1, beta 0: a constant yield stress.
    """
    if peak <= initial or initial <= 0.0 or strain_at_peak <= 0.0:
        return 1.0, 0.0
    alpha = (2.0 * peak - initial + 2.0 * math.sqrt(peak * (peak - initial))) / initial
    return alpha, math.log(2.0 * alpha / (1.0 + alpha)) / strain_at_peak


@kernel(error_model="numpy")
def read_table(table, start, x):
    """Value and slope at x of the piecewise linear table at par[start:] (count, then pairs); flat outside."""
    n = int(table[start])
    first = start + 1
    if x <= table[first]:
        if n > 1 and x == table[first]:
            return table[first + 1], (table[first + 3] - table[first + 1]) / (table[first + 2] - table[first])
        return table[first + 1], 0.0
    low, high = 0, n - 1
    if x >= table[first + 2 * high]:
        return table[first + 2 * high + 1], 0.0
    while high - low > 1:
        mid = (low + high) // 2
        if table[first + 2 * mid] <= x:
            low = mid
        else:
            high = mid
    a = first + 2 * low
    slope = (table[a + 3] - table[a + 1]) / (table[a + 2] - table[a])
    return table[a + 1] + slope * (x - table[a]), slope


@kernel(error_model="numpy")
def harden(kind, strain, initial, a, b, par, table):
    """Yield stress (Pa) and slope (Pa) at an equivalent plastic strain; never negative.

    kind EXPONENTIAL: initial + a (1 - exp(-b strain)), a the gain in Pa and b the rate.
    kind BARCELONA: initial ((1 + a) exp(-b strain) - a exp(-2 b strain)), Y (2.31).
    kind LINEAR: initial + a strain. kind TABLE: the table at par[table:].
    """
    if kind == EXPONENTIAL:
        gain = a * math.exp(-b * strain)
        value = initial + a - gain
        slope = b * gain
    elif kind == BARCELONA:
        decay = math.exp(-b * strain)
        value = initial * decay * (1.0 + a - a * decay)
        slope = -b * initial * decay * (1.0 + a - 2.0 * a * decay)
    elif kind == LINEAR:
        value = initial + a * strain
        slope = a
    else:
        value, slope = read_table(par, table, strain)
    if value < 0.0:
        return 0.0, 0.0
    return value, slope
