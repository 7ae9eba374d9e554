"""Hardening and damage curves of the quasi-brittle law, Y 2.7.2: from equivalent plastic strain to yield
stress and damage.

The curves are given over inelastic strain x in compression and cracking strain x in tension, x = e - s/E; the law
carries plastic strain, e_pl = e - s/((1 - D) E). So

    e_pl = x - D/(1 - D) s(x)/E,   D = m x in compression, D = 1 - (1 + x)^-n in tension,

with the stress s(x) of the moment ("current"). Y (2.81)-(2.82) print the first yield stress in its place ("printed"),
and so the limits (2.85)-(2.90): the same with s constant. The conversion is invertible only while damage grows slowly
enough, Y (2.83)-(2.93): the damage rates m and n are therefore given as fractions d_c, d_t of their limits over the
strains to be met. With d e_pl/dx > 0 the limits are

    m: (E + s') x^2 m^2 - (2 E x + s + x s') m + E = 0, its smaller positive root;
    n: n (1 + x)^(n-1) + s'/s ((1 + x)^n - 1) = E/s, which Lambert's W solves for s = s0 exp(-lambda x).
"""

from __future__ import annotations

import math

import numpy as np

from graben.mechanics.compiled import kernel
from graben.mechanics.materials.hardening import BARCELONA, harden

CURRENT, PRINTED = 0, 1  # the order of the declared choices
_NONE = np.empty(0)
_SAMPLES = 64  # of the strains over which a limit is sought


@kernel(error_model="numpy")
def lambert_w(x):
    """W(x) of x = W exp(W), Y (2.91), principal branch, by Halley's iteration; -1 below -1/e."""
    if x <= -0.36787944117144233:
        return -1.0
    if x == 0.0:
        return 0.0
    if x < -0.3:  # about the branch point
        w = -1.0 + math.sqrt(2.0 * (1.0 + math.e * x))
    elif x > 3.0:
        w = math.log(x) - math.log(math.log(x))
    else:
        w = math.log(1.0 + x)
    for _iteration in range(30):
        e = math.exp(w)
        f = w * e - x
        step = f / (e * (w + 1.0) - (w + 2.0) * f / (2.0 * w + 2.0))
        w -= step
        if abs(step) <= 1e-15 * (1.0 + abs(w)):
            break
    return w


@kernel(error_model="numpy")
def compression_stress(form, x, first, alpha, beta):
    """Stress (Pa) of the conversion at inelastic strain x, and its slope: Barcelona's curve, or the first yield."""
    if form == PRINTED:
        return first, 0.0
    return harden(BARCELONA, x, first, alpha, beta, _NONE, 0)


@kernel(error_model="numpy")
def compression_rate(form, fraction, young, first, alpha, beta, at_peak, largest):
    """m = d_c times the smallest limit over inelastic strains up to the largest, (2.86), (2.87)."""
    lowest = young / first
    for i in range(1, 2 * _SAMPLES + 1):
        x = largest * i / _SAMPLES if i <= _SAMPLES else 4.0 * at_peak * (i - _SAMPLES) / _SAMPLES
        if x > largest:
            break
        s, slope = compression_stress(form, x, first, alpha, beta)
        # the smaller root of (E + s') x^2 m^2 - (2 E x + s + x s') m + E, written so that nothing cancels
        part = s + x * slope
        lowest = min(lowest, 2.0 * young / (2.0 * young * x + part + math.sqrt(part * part + 4.0 * young * x * s)))
    return fraction * lowest


@kernel(error_model="numpy")
def tension_rate(form, fraction, young, stress, decay, largest):
    """n = d_t times the smallest limit over cracking strains up to the largest, (2.90), (2.92)."""
    decay = decay if form == CURRENT else 0.0
    lowest = young / stress
    for i in range(1, _SAMPLES + 1):
        x = largest * i / _SAMPLES
        w = 1.0 + x
        log = math.log(w)
        # n (1 + x)^(n-1) - decay ((1 + x)^n - 1) = E / s as y exp(y) = right, y = log (n - decay w)
        stiff = young / stress * math.exp(min(decay * x - decay * w * log, 0.0)) - decay * math.exp(-decay * w * log)
        right = log * w * stiff
        lowest = min(lowest, decay * w + lambert_w(right) / log)
    return fraction * lowest


@kernel(error_model="numpy")
def plastic_compression(form, x, rate, young, first, alpha, beta):
    """Plastic strain at inelastic strain x."""
    s, _slope = compression_stress(form, x, first, alpha, beta)
    return x - rate * x / (1.0 - rate * x) * s / young


@kernel(error_model="numpy")
def plastic_tension(form, x, rate, young, stress, decay):
    """Plastic strain at cracking strain x."""
    decay = decay if form == CURRENT else 0.0
    log = rate * math.log1p(x)
    return x - (math.exp(min(log - decay * x, 700.0)) - math.exp(-decay * x)) * stress / young


@kernel(error_model="numpy")
def inelastic_strain(form, plastic, rate, young, first, alpha, beta, largest):
    """x of `plastic_compression`; at most `largest`."""
    if rate <= 0.0:
        return min(plastic, largest)
    if plastic_compression(form, largest, rate, young, first, alpha, beta) <= plastic:
        return largest
    low, high = 0.0, largest
    x = min(plastic, largest)
    for _iteration in range(80):
        keep = 1.0 - rate * x
        s, slope = compression_stress(form, x, first, alpha, beta)
        f = x - rate * x / keep * s / young - plastic
        if f > 0.0:
            high = x
        else:
            low = x
        if f == 0.0 or high - low <= 1e-16 * high:
            break
        rise = 1.0 - (rate / (keep * keep) * s + rate * x / keep * slope) / young
        new = x - f / rise if rise > 0.0 else -1.0
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15 * (1e-12 + x):
            return new
        x = new
    return x


@kernel(error_model="numpy")
def cracking_strain(form, plastic, rate, young, stress, decay, largest):
    """x of `plastic_tension`; at most `largest`."""
    if plastic_tension(form, largest, rate, young, stress, decay) <= plastic:
        return largest
    decay = decay if form == CURRENT else 0.0
    low, high = 0.0, largest
    x = min(plastic, largest)
    for _iteration in range(80):
        f = plastic_tension(form, x, rate, young, stress, decay) - plastic
        if f > 0.0:
            high = x
        else:
            low = x
        if f == 0.0 or high - low <= 1e-16 * high:
            break
        grown = math.exp(min(rate * math.log1p(x) - decay * x, 700.0))
        slope = 1.0 - (rate * grown / (1.0 + x) - decay * (grown - math.exp(-decay * x))) * stress / young
        new = x - f / slope if slope > 0.0 else -1.0
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15 * (1e-12 + x):
            return new
        x = new
    return x
