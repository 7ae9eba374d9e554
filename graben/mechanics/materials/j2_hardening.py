"""Hardening of the von Mises laws: the three forms, their parameters, and the radial return to each.

Slots from `start` on: kind, initial yield s0, modulus H, gain Q, rate b, then the table (count, pairs).

    table        piecewise linear in the equivalent plastic strain p, constant beyond its last row
    linear       s0 + H p
    exponential  s0 + Q (1 - exp(-b p))

None softens, so the return ``q_trial - 3 G dp = scale * sigma_y(p + dp)`` has exactly one solution. Along a table it
is found by walking the segments; for the curve, which is concave, Newton from a lower bound of dp climbs to it and
cannot overshoot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from graben.mechanics.compiled import kernel

TABLE, LINEAR, EXPONENTIAL = 0, 1, 2  # the order of the declared choices
SLOTS = 5  # before the table


@kernel(error_model="numpy")
def yield_stress(p, par, start):
    """Yield stress [Pa] at equivalent plastic strain p by the table at par[start:]."""
    count = int(par[start])
    i = start + 1
    for k in range(count - 1):
        right = par[i + 2 * (k + 1)]
        if p <= right:
            left, low = par[i + 2 * k], par[i + 2 * k + 1]
            return low + (par[i + 2 * (k + 1) + 1] - low) * (p - left) / (right - left)
    return par[i + 2 * (count - 1) + 1]


@kernel(error_model="numpy")
def return_to_table(q_trial, p, three_g, par, start, scale):
    """Increment dp >= 0 that solves ``q_trial - three_g dp = scale * sigma_y(p + dp)``, and the slope there.

    Returns (dp, hardening): hardening is ``scale * d sigma_y / dp`` [Pa] on the segment of the solution.
    (0, 0) if ``q_trial`` lies inside the yield surface. The table must not soften.
    """
    now = scale * yield_stress(p, par, start)
    if q_trial <= now:
        return 0.0, 0.0
    count = int(par[start])
    i = start + 1
    left, low = p, now
    for k in range(1, count):
        right = par[i + 2 * k]
        if right <= p:
            continue
        high = scale * par[i + 2 * k + 1]
        if q_trial - three_g * (right - p) <= high:
            slope = (high - low) / (right - left)
            return (q_trial - low + slope * (left - p)) / (three_g + slope), slope
        left, low = right, high
    return (q_trial - low) / three_g, 0.0


@kernel(error_model="numpy")
def return_to_strength(q_trial, p, three_g, par, start, scale):
    """As `return_to_table`, for any of the three forms: (dp, slope, strength), both of these times scale [Pa].

    The strength is that at p + dp: the von Mises stress to scale the deviator to where dp > 0.
    """
    kind = int(par[start])
    if kind == TABLE:
        dp, slope = return_to_table(q_trial, p, three_g, par, start + SLOTS, scale)
        return dp, slope, scale * yield_stress(p + dp, par, start + SLOTS)
    initial = scale * par[start + 1]
    if kind == LINEAR:
        slope = scale * par[start + 2]
        now = initial + slope * p
        if q_trial <= now:
            return 0.0, slope, now
        dp = (q_trial - now) / (three_g + slope)
        return dp, slope, now + slope * dp
    gain, rate = scale * par[start + 3], par[start + 4]
    left = gain * math.exp(-rate * p)
    now = initial + gain - left
    if q_trial <= now:
        return 0.0, rate * left, now
    dp = max(0.0, (q_trial - initial - gain) / three_g)
    strength, slope = now, rate * left
    for _iteration in range(200):
        decay = left * math.exp(-rate * dp)
        strength, slope = initial + gain - decay, rate * decay
        step = (q_trial - three_g * dp - strength) / (three_g + slope)
        if not step > 1e-16 * dp:
            break
        dp += step
    return dp, slope, strength


def hardening_faults(values: Mapping[str, Any]) -> list[str]:
    """What is wrong with a hardening table beyond its shape; empty when it can be used."""
    rows = values.get("hardening_table", values.get("hardening"))
    if rows is None or isinstance(rows, str):
        return []
    rows = np.asarray(rows, dtype=np.float64)
    found = []
    if rows[0, 0] != 0.0:
        found.append("hardening: the first plastic strain must be 0")
    if np.any(rows[:, 1] <= 0.0):
        found.append("hardening: yield stresses must be positive")
    if np.any(np.diff(rows[:, 1]) < 0.0):
        found.append("hardening: yield stresses must not fall (softening belongs to damage)")
    return found
