"""Return of the extended Drucker-Prager law to its yield surface in the two unknowns (dlambda, Lode angle); the
equations stand in `drucker_prager.py`."""

from __future__ import annotations

import math

from graben.mechanics.compiled import kernel
from graben.mechanics.materials.drucker_prager_slots import (
    HARD_A,
    HARD_B,
    KIND,
    SIGMA0,
    TABLE,
    TAN_BETA,
    TAN_PSI,
)
from graben.mechanics.materials.hardening import harden

ROOT32 = math.sqrt(1.5)
_SIXTH_TURN = math.pi / 3.0


@kernel(error_model="numpy")
def yield_stress(strain, par):
    """(1 - tan(beta)/3) sigma_c and its slope."""
    value, slope = harden(int(par[KIND]), strain, par[SIGMA0], par[HARD_A], par[HARD_B], par, TABLE)
    factor = 1.0 - par[TAN_BETA] / 3.0
    return factor * value, factor * slope


@kernel(error_model="numpy")
def _shape(theta, k):
    """h(theta) and its first and second derivative."""
    cos3 = math.cos(3.0 * theta)
    return 1.0 + 0.5 * k * (1.0 + cos3), -1.5 * k * math.sin(3.0 * theta), -4.5 * k * cos3


@kernel(error_model="numpy")
def newton(p, rho, c3, s3, strain, d, slope, bulk, flow, k, par):
    """Smooth part of the surface by Newton: (found, dlambda, cos, sin of the turn th - th_tr).

    c3, s3: cos and sin of 3 th_tr; d, slope: yield term at `strain`; flow = sqrt(6) mu. The turn is carried
    as the tangent of its half, which needs no trigonometry.
    """
    tan_b, tan_p = par[TAN_BETA], par[TAN_PSI]
    rate = 1.0 - tan_p / 3.0
    size = ROOT32 * rho + abs(p) * tan_b + d
    half, multiplier = 0.0, 0.0
    for _iteration in range(14):
        scale = 1.0 / (1.0 + half * half)
        c, s = (1.0 - half * half) * scale, 2.0 * half * scale
        triple_c, triple_s = c * (4.0 * c * c - 3.0), s * (3.0 - 4.0 * s * s)
        cos3, sin3 = c3 * triple_c - s3 * triple_s, s3 * triple_c + c3 * triple_s
        h, h1, h2 = 1.0 + 0.5 * k * (1.0 + cos3), -1.5 * k * sin3, -4.5 * k * cos3
        a = flow * multiplier
        radius = rho * c - a * h
        turn = rho * s + a * h1
        excess = ROOT32 * radius * h - tan_b * (p + bulk * tan_p * multiplier) - d
        close = multiplier > 0.0 and abs(turn) <= 1e-8 * rho and abs(excess) <= 1e-8 * size
        tt = rho * c + a * h2
        tm = flow * h1
        et = ROOT32 * (radius * h1 - turn * h)
        em = -ROOT32 * flow * h * h - tan_b * tan_p * bulk - slope * rate
        det = tt * em - tm * et
        if det == 0.0:
            break
        half -= (turn * em - tm * excess) / (2.0 * det * scale)
        multiplier -= (tt * excess - et * turn) / det
        if not (0.0 <= multiplier < 1e30 and abs(half) < 0.6):
            break
        if close:  # the step just taken squares the error: nothing is left to check
            scale = 1.0 / (1.0 + half * half)
            fits = radius >= 0.0 and sin3 >= -1e-9 and half >= -1e-9
            return fits, multiplier, (1.0 - half * half) * scale, 2.0 * half * scale
        d, slope = yield_stress(strain + rate * multiplier, par)
    return False, 0.0, 1.0, 0.0


@kernel(error_model="numpy")
def _turned(rho, theta, a, k):
    """Lode angle after the return with a given a, by safeguarded Newton in [theta, pi/3]."""
    low, high = theta, _SIXTH_TURN
    angle = theta
    for _iteration in range(100):
        _h, h1, h2 = _shape(angle, k)
        turn = rho * math.sin(angle - theta) + a * h1
        if turn > 0.0:
            high = angle
        else:
            low = angle
        if turn == 0.0 or high - low < 1e-16:
            break
        tt = rho * math.cos(angle - theta) + a * h2
        angle = angle - turn / tt if tt > 0.0 else -1.0
        if not low < angle < high:
            angle = 0.5 * (low + high)
    return angle


@kernel(error_model="numpy")
def bisect(p, rho, theta, strain, bulk, flow, k, par):
    """Return by nested bisection: (state, dlambda, theta), state 0 smooth, 1 apex, 2 failed."""
    tan_b, tan_p = par[TAN_BETA], par[TAN_PSI]
    rate = 1.0 - tan_p / 3.0
    low, high = 0.0, rho / flow  # h >= 1, so the deviator is gone at a = rho at the latest
    angle = theta
    smooth = False
    for _iteration in range(200):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        angle = _turned(rho, theta, flow * middle, k)
        h, _h1, _h2 = _shape(angle, k)
        radius = rho * math.cos(angle - theta) - flow * middle * h
        d, _slope = yield_stress(strain + rate * middle, par)
        excess = ROOT32 * radius * h - tan_b * (p + bulk * tan_p * middle) - d
        if radius > 0.0 and excess > 0.0:
            low = middle
        else:
            high = middle
            smooth = radius > 0.0
        if high - low <= 1e-15 * high:
            break
    if smooth:
        return 0, high, _turned(rho, theta, flow * high, k)
    return 1, high, angle


@kernel(error_model="numpy")
def apex_flow(p, strain, bulk, par):
    """Volumetric plastic strain v >= 0 that brings a purely volumetric stress at pressure p to the apex."""
    tan_b = par[TAN_BETA]
    if tan_b <= 0.0:
        return 0.0
    rate = (1.0 - par[TAN_PSI] / 3.0) / tan_b
    low, high = 0.0, max(0.0, -p / bulk)
    flow = 0.0
    for _iteration in range(120):
        d, slope = yield_stress(strain + rate * flow, par)
        excess = -tan_b * (p + bulk * flow) - d
        if excess > 0.0:
            low = flow
        else:
            high = flow
        if high - low <= 1e-16 * high or abs(excess) <= 1e-15 * d:
            break
        step = tan_b * bulk + slope * rate
        flow = flow + excess / step if step > 0.0 else -1.0
        if not low < flow < high:
            flow = 0.5 * (low + high)
    return flow
