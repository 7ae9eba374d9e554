"""Slow and obvious versions of the contact kernels, to judge the compiled ones by."""

import numpy as np

from graben.mechanics.blocks.contact.joints import FACING_FULL, FACING_NONE


def pair_force(points_e, points_f, velocity_e, velocity_f, shear, slip, joint, dt):
    """Forces on the nodes of edges e and f (2, 2 each), new shear and slip (2,), by the words of the docstring.

    points, velocity : (2, 2) start and end of an edge, blocks on the left.
    """
    fe, ff = np.zeros((2, 2)), np.zeros((2, 2))
    shear, slip = np.array(shear, float), np.array(slip, float)
    te = (points_e[1] - points_e[0]) / np.linalg.norm(points_e[1] - points_e[0])
    tf = (points_f[1] - points_f[0]) / np.linalg.norm(points_f[1] - points_f[0])
    facing = -te @ tf
    if facing <= FACING_NONE:
        return fe, ff, np.zeros(2), slip
    t = (te, -tf)[joint.face - 1] if joint.face else (te - tf) / np.linalg.norm(te - tf)
    n = np.array([t[1], -t[0]])
    low = max(points_e[0] @ t, points_f[1] @ t)
    high = min(points_e[1] @ t, points_f[0] @ t)
    if high <= low:
        return fe, ff, np.zeros(2), slip
    weight = min(1.0, (facing - FACING_NONE) / (FACING_FULL - FACING_NONE))
    for k, s in enumerate((low, high)):
        a = (s - points_e[0] @ t) / ((points_e[1] - points_e[0]) @ t)
        b = (s - points_f[0] @ t) / ((points_f[1] - points_f[0]) @ t)
        pe = (1 - a) * points_e[0] + a * points_e[1]
        pf = (1 - b) * points_f[0] + b * points_f[1]
        opened = joint.dilation * min(abs(slip[k]), joint.dilation_limit)
        sigma = joint.normal_stiffness * (opened - (pf - pe) @ n)
        if sigma <= 0.0:
            shear[k] = 0.0
            continue
        ve = (1 - a) * velocity_e[0] + a * velocity_e[1]
        vf = (1 - b) * velocity_f[0] + b * velocity_f[1]
        trial = shear[k] + joint.shear_stiffness * dt * ((vf - ve) @ t)
        strength = joint.cohesion + sigma * joint.friction
        shear[k] = np.clip(trial, -strength, strength)
        slip[k] += (trial - shear[k]) / joint.shear_stiffness
        force = (shear[k] * t - sigma * n) * 0.5 * (high - low) * weight
        # Acting midway: find end forces with the same sum and moment as `force` at the middle, whose shear part
        # splits like a point load on a beam.
        middle = 0.5 * (pe + pf)
        for out, points, share, sign in ((fe, points_e, a, 1.0), (ff, points_f, b, -1.0)):
            ends = np.array([(1 - share) * sign * force, share * sign * force])
            arm = points - middle
            short = -(arm[:, 0] * ends[:, 1] - arm[:, 1] * ends[:, 0]).sum()
            lever = (points[1] - points[0]) @ t
            ends[0] += n * short / lever
            ends[1] -= n * short / lever
            out += ends
    return fe, ff, shear, slip


def shared_interval(points_e, points_f, face=0):
    """Length that two edges share along their common tangent, 0 if turned away, and the smaller gap at its ends.

    face : 1, 2: along edge e or f instead
    """
    te = (points_e[1] - points_e[0]) / np.linalg.norm(points_e[1] - points_e[0])
    tf = (points_f[1] - points_f[0]) / np.linalg.norm(points_f[1] - points_f[0])
    if -te @ tf <= FACING_NONE:
        return 0.0, np.inf
    t = (te, -tf)[face - 1] if face else (te - tf) / np.linalg.norm(te - tf)
    n = np.array([t[1], -t[0]])
    low = max(points_e[0] @ t, points_f[1] @ t)
    high = min(points_e[1] @ t, points_f[0] @ t)
    line = [
        np.interp([low, high], *zip(*sorted((p @ t, p @ n) for p in points), strict=True))
        for points in (points_e, points_f)
    ]
    return high - low, (line[1] - line[0]).min()


def boxes_meet(points, follow, block, reach):
    """All pairs (e, f), e < f, of edges of different blocks whose boxes, grown by reach / 2, meet."""
    ends = np.stack([points, points[follow]])
    low, high = ends.min(axis=0) - reach / 2, ends.max(axis=0) + reach / 2
    found = []
    for e in range(len(points)):
        for f in range(e + 1, len(points)):
            if block[e] != block[f] and np.all(low[e] <= high[f]) and np.all(low[f] <= high[e]):
                found.append((e, f))
    return found
