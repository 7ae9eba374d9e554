"""A batch of contacts side by side: columns of numbers, one lane a contact, for vector instructions.

No lane looks at another, and all memory is one array with columns at fixed places: so the compiler sees that lanes do
not disturb one another, and works on several at once. Each lane still gets bitwise what it would get alone.
"""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.joints import (
    BROKEN,
    FACING_FULL,
    FACING_NONE,
    OPEN,
    SLIP,
    STICK,
    bearing,
    closure_stress,
)
from graben.mechanics.compiled import kernel

# Rows of a batch, and where the columns of its work space begin. Read: edge e from its node on (position, velocity,
# tangent, length), both rims, edge f, its end, velocity of the end of e, stress and slip of both ends of the contact,
# whether these are whole, their seats, and whether the pair may end early when it is apart.
LANES = 32
EX, EY, EVX, EVY, ETX, ETY, EL, RIM = (LANES * k for k in range(8))
FX, FY, FVX, FVY, FTX, FTY = (LANES * k for k in range(8, 14))
GX, GY, GVX, GVY, DVX, DVY = (LANES * k for k in range(14, 20))
TAU0, TAU1, SLIP0, SLIP1, WHOLE0, WHOLE1, SEAT0, SEAT1, PLAIN = (LANES * k for k in range(20, 29))
# Written: forces on the start and the end of e and f; what became of the pair, overlap, both gaps, work lost, and
# what became of both ends.
PX, PY, QX, QY, RX, RY, SX, SY = (LANES * k for k in range(8))
FATE, OVERLAP, GAP0, GAP1, WORK, END0, END1 = (LANES * k for k in range(29, 36))
# Sums over all batches: friction work and largest overlap.
LOST, DEEPEST = 36 * LANES, 36 * LANES + 1
WORK_SPACE = 36 * LANES + 2

# Fates of a pair: no contact, in front of each other with a gap, overlap.
AWAY, APART, TOUCHES = 0.0, 1.0, 2.0


@kernel(error_model="numpy", forceinline=True)
def _end_law(tau, slip, whole, gap, gain, kn, compliance, strengths, tensile, dilation, limit, closure):
    """One end of a contact: new shear stress, slip, normal stress, work lost (per area), and what it does: STICK,
    SLIP, OPEN, or BROKEN if it breaks now.

    gap [m]; gain : what sliding in this step adds to the shear stress [Pa]; whole : intact and not broken
    strengths : friction, cohesion; and residual ones, friction below 0 if the joint does not weaken
    """
    friction, cohesion, residual_friction, residual_cohesion = strengths
    weakens = residual_friction >= 0.0
    opened = dilation * min(abs(slip), limit)
    closed = opened - gap
    sigma = kn * closed
    if closure > 0.0 and closed > 0.0:
        sigma = closure_stress(closed, kn, closure)[0]
    tension = tensile if whole else 0.0
    if sigma <= -tension:
        # What the joint stored is lost with it.
        lost = tau * tau * compliance
        if tension > 0.0:
            lost += sigma * sigma / kn
        return 0.0, slip, 0.0, 0.5 * lost, 1.0 * OPEN
    if weakens and not whole:
        friction = residual_friction
        cohesion = residual_cohesion
    tau += gain
    strength = max(cohesion + sigma * friction, 0.0)
    work = 0.0
    breaks = weakens and whole and abs(tau) > strength
    if breaks:
        # It breaks: strength falls at once, and with it what it stored.
        strength = max(residual_cohesion + sigma * residual_friction, 0.0)
        work = 0.5 * compliance * (abs(tau) - strength) ** 2
    limited = min(max(tau, -strength), strength)
    slid = (tau - limited) * compliance
    slip += slid
    work += limited * slid - sigma * (dilation * min(abs(slip), limit) - opened)
    state = 1.0 * BROKEN if breaks else (1.0 * STICK if tau == limited else 1.0 * SLIP)
    return limited, slip, sigma, work, state


@kernel(error_model="numpy")
def press_batch(w, table, joint, dt):
    """Stress update and forces of all lanes. Lanes without contact hold anything but for their fate."""
    kn, ks, friction, cohesion = table[joint, 0], table[joint, 1], table[joint, 2], table[joint, 3]
    tensile, dilation, limit, closure = table[joint, 4], table[joint, 5], table[joint, 6], table[joint, 9]
    face = table[joint, 10]
    if tensile == 0.0 and closure == 0.0 and table[joint, 7] < 0.0 and face == 0.0:
        # The same with what these features cost left out by the compiler.
        _press_lanes(w, kn, ks, (friction, cohesion, -1.0, -1.0), 0.0, dilation, limit, 0.0, 0.0, dt)
    else:
        strengths = (friction, cohesion, table[joint, 7], table[joint, 8])
        _press_lanes(w, kn, ks, strengths, tensile, dilation, limit, closure, face, dt)


@kernel(error_model="numpy", forceinline=True)
def _press_lanes(w, kn, ks, strengths, tensile, dilation, limit, closure, face, dt):
    compliance = 1.0 / ks
    ksdt = ks * dt
    shortest = 1.7 if face == 0.0 else 1.0
    for j in range(LANES):
        # Difference of the unit tangents: along the common tangent, of length sqrt(2 + 2 facing). All lengths
        # along it, and heights above it, are stretched by that.
        tx = w[ETX + j] - w[FTX + j]
        ty = w[ETY + j] - w[FTY + j]
        square = tx * tx + ty * ty
        facing = 0.5 * square - 1.0
        if face == 1.0:
            tx, ty, square = w[ETX + j], w[ETY + j], 1.0
        elif face == 2.0:
            tx, ty, square = -w[FTX + j], -w[FTY + j], 1.0
        ox, oy = w[EX + j], w[EY + j]
        # Along the tangent: edge e runs from 0 to se, edge f from s1 (its end) to s0 (its start).
        se = w[EL + j] * (w[ETX + j] * tx + w[ETY + j] * ty)
        s0 = (w[FX + j] - ox) * tx + (w[FY + j] - oy) * ty
        s1 = (w[GX + j] - ox) * tx + (w[GY + j] - oy) * ty
        low = max(0.0, s1)
        high = min(se, s0)
        rim = w[RIM + j]
        # Heights along the normal n = (ty, -tx), which points out of edge e.
        he = w[EL + j] * (w[ETX + j] * ty - w[ETY + j] * tx)
        h0 = (w[FX + j] - ox) * ty - (w[FY + j] - oy) * tx
        h1 = (w[GX + j] - ox) * ty - (w[GY + j] - oy) * tx
        slip0, slip1 = w[SLIP0 + j], w[SLIP1 + j]
        fate = TOUCHES
        # Pairs apart that never slid.
        if min(h0, h1) > max(0.0, he) and w[PLAIN + j] != 0.0 and slip0 == 0.0 and slip1 == 0.0:
            fate = APART
        # They are stretched by at least sqrt(3), or not at all.
        if facing <= FACING_NONE or high - low <= shortest * rim:
            fate = AWAY
        # One division serves all three inverse lengths.
        sf = s0 - s1
        stretch = np.sqrt(square)
        share = 1.0 / (se * sf * square)
        de = sf * square * share
        df = se * square * share
        scale = se * sf * share * stretch
        alpha0 = low * de
        alpha1 = high * de
        beta0 = (s0 - low) * df
        beta1 = (s0 - high) * df
        gap0 = scale * (h0 + (h1 - h0) * beta0 - he * alpha0)
        gap1 = scale * (h0 + (h1 - h0) * beta1 - he * alpha1)
        area = 0.5 * bearing(scale * (high - low), gap0, gap1, rim)
        if facing < FACING_FULL:
            area *= (facing - FACING_NONE) / (FACING_FULL - FACING_NONE)
        tx *= scale
        ty *= scale
        de *= stretch
        df *= stretch
        # Sliding speeds along the tangent, at both ends.
        ve = w[EVX + j] * tx + w[EVY + j] * ty
        ve2 = w[DVX + j] * tx + w[DVY + j] * ty
        vf = w[FVX + j] * tx + w[FVY + j] * ty
        vf2 = w[GVX + j] * tx + w[GVY + j] * ty
        gain0 = ksdt * (vf + beta0 * (vf2 - vf) - ve - alpha0 * (ve2 - ve))
        gain1 = ksdt * (vf + beta1 * (vf2 - vf) - ve - alpha1 * (ve2 - ve))
        tau0, slip0, sigma0, work0, end0 = _end_law(
            w[TAU0 + j], slip0, w[WHOLE0 + j] != 0.0, gap0 - w[SEAT0 + j], gain0,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        tau1, slip1, sigma1, work1, end1 = _end_law(
            w[TAU1 + j], slip1, w[WHOLE1 + j] != 0.0, gap1 - w[SEAT1 + j], gain1,
            kn, compliance, strengths, tensile, dilation, limit, closure,
        )  # fmt: skip
        w[TAU0 + j] = tau0
        w[TAU1 + j] = tau1
        w[SLIP0 + j] = slip0
        w[SLIP1 + j] = slip1
        # Traction on edge e: -sigma n + tau t, at a point midway between the edges. Seen from a point of
        # edge e this adds a couple, carried by opposite normal forces at the ends of that edge.
        tau0 *= area
        tau1 *= area
        sigma0 *= area
        sigma1 *= area
        couple = 0.5 * (gap0 * tau0 + gap1 * tau1)
        tau = tau0 + tau1
        sigma = sigma0 + sigma1
        # Along t and along n: at the end of edge e, at its start, at the end of edge f, at its start.
        at = alpha0 * tau0 + alpha1 * tau1
        an = -alpha0 * sigma0 - alpha1 * sigma1 - couple * de
        bt = tau - at
        bn = -sigma - an
        ct = -beta0 * tau0 - beta1 * tau1
        cn = beta0 * sigma0 + beta1 * sigma1 + couple * df
        gt = -tau - ct
        gn = sigma - cn
        w[PX + j] = bt * tx + bn * ty
        w[PY + j] = bt * ty - bn * tx
        w[QX + j] = at * tx + an * ty
        w[QY + j] = at * ty - an * tx
        w[RX + j] = gt * tx + gn * ty
        w[RY + j] = gt * ty - gn * tx
        w[SX + j] = ct * tx + cn * ty
        w[SY + j] = ct * ty - cn * tx
        w[FATE + j] = fate
        w[OVERLAP + j] = -0.5 * (gap0 + gap1)
        w[GAP0 + j] = gap0
        w[GAP1 + j] = gap1
        w[WORK + j] = (work0 + work1) * area
        w[END0 + j] = end0
        w[END1 + j] = end1
