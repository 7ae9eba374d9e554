"""Hardening and damage curves of the quasi-brittle law, Y 2.7.2: from equivalent plastic strain to yield
stress and damage.

The curves are given over inelastic strain x in compression and cracking strain x in tension; the law carries
plastic strain. The conversion, Y (2.81)-(2.82), is invertible only while damage grows slowly enough, Y
(2.83)-(2.93): the damage rates m and n are therefore given as fractions d_c, d_t of their limits over the
strains to be met.
"""

from __future__ import annotations

import math

from graben.mechanics.compiled import kernel


@kernel(error_model="numpy")
def lambert_w(x):
    """W(x) of x = W exp(W), Y (2.91), principal branch, x >= 0, by Halley's iteration."""
    if x <= 0.0:
        return 0.0
    w = math.log(1.0 + x)
    if x > 3.0:
        w = math.log(x) - math.log(math.log(x))
    for _iteration in range(30):
        e = math.exp(w)
        f = w * e - x
        step = f / (e * (w + 1.0) - (w + 2.0) * f / (2.0 * w + 2.0))
        w -= step
        if abs(step) <= 1e-15 * (1.0 + abs(w)):
            break
    return w


@kernel(error_model="numpy")
def compression_rate(fraction, young, stress, largest):
    """m = d_c times the limit of Y (2.86) at the largest inelastic strain, where it is smallest (2.87)."""
    product = 2.0 * young * largest
    return fraction * (stress + product - math.sqrt(stress * (stress + 2.0 * product))) / (product * largest)


@kernel(error_model="numpy")
def tension_rate(fraction, young, stress, largest):
    """n = d_t times the smallest limit of Y (2.90) over cracking strains up to the largest, (2.92)."""
    lowest = 1e300
    for i in range(1, 65):
        x = largest * i / 64.0
        log = math.log1p(x)
        lowest = min(lowest, lambert_w(young * (x + 1.0) / stress * log) / log)
    return fraction * lowest


@kernel(error_model="numpy")
def inelastic_strain(plastic, rate, ratio, largest):
    """x of plastic = x - m x / (1 - m x) ratio, Y (2.79), (2.81), ratio = initial yield / E; at most
    `largest`."""
    b = 1.0 - rate * ratio + rate * plastic
    root = b * b - 4.0 * rate * plastic
    if rate <= 0.0:
        return min(plastic, largest)
    if root <= 0.0:
        return largest
    # the small root of m x^2 - b x + plastic = 0, written so that nothing cancels
    return min(2.0 * plastic / (b + math.sqrt(root)), largest)


@kernel(error_model="numpy")
def cracking_strain(plastic, rate, ratio, largest):
    """x of plastic = x - ((1 + x)^n - 1) ratio, Y (2.80), (2.82), ratio = tensile yield / E; at most
    `largest`."""
    low, high = 0.0, largest
    if plastic >= largest - (math.pow(1.0 + largest, rate) - 1.0) * ratio:
        return largest
    x = min(plastic, largest)
    for _iteration in range(80):
        power = math.pow(1.0 + x, rate)
        f = x - (power - 1.0) * ratio - plastic
        if f > 0.0:
            high = x
        else:
            low = x
        if f == 0.0 or high - low <= 1e-16 * high:
            break
        slope = 1.0 - rate * power / (1.0 + x) * ratio
        new = x - f / slope if slope > 0.0 else -1.0
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15 * (1e-12 + x):
            return new
        x = new
    return x
