"""Geometry of a groove: sections of a worn surface, their areas, degree of wear and of penetration, and volumes.

A section is the outline of the material in a plane across the scratch: height z over the distance y from the
middle. The groove area Ag lies below the first surface z = 0, the shoulder area As above it (H figure 8.7). The
degree of wear is ``f_ab = (Ag - As) / Ag``, H (8.5); the degree of penetration ``D_p = 2 d / w``, H (8.6), with the
depth d and the width w of the groove where it crosses z = 0.

Without loss of material f_ab is a transient: what the shoulders of a section lack lies in the bow wave ahead of the
tip. So every measure here is a function of the position along the scratch, and `volume_ledger` says where the
displaced volume is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Section:
    """Measures of one section. Areas [m2] and width [m] of the whole groove (both halves); depth [m] positive down.

    degree_of_wear and degree_of_penetration are nan where there is no groove.
    """

    groove_area: float
    shoulder_area: float
    width: float
    depth: float
    shoulder_height: float
    degree_of_wear: float
    degree_of_penetration: float


def measure(y: Floats, z: Floats, symmetric: bool) -> Section:
    """Measure a section with heights z (n,) [m] over rising y (n,) [m]; exact for the polyline.

    symmetric: y starts at the middle and the other half mirrors it.

    Raises
    ------
    ValueError : shapes differ, fewer than two points, y falling, or values not finite
    """
    y, z = np.asarray(y, dtype=np.float64), np.asarray(z, dtype=np.float64)
    if y.shape != z.shape or y.ndim != 1 or len(y) < 2:
        raise ValueError(f"section: y and z of one shape (n,), n >= 2; found {y.shape} and {z.shape}")
    if not (np.isfinite(y).all() and np.isfinite(z).all()) or np.any(np.diff(y) < 0.0):
        raise ValueError("section: finite values and rising y")
    below, above = signed_areas(y, z)
    sides = 2.0 if symmetric else 1.0
    ag, shoulder = sides * below, sides * above
    depth = max(0.0, float(-z.min()))
    width = sides * _width(y, z, symmetric)
    return Section(
        groove_area=ag,
        shoulder_area=shoulder,
        width=width,
        depth=depth,
        shoulder_height=max(0.0, float(z.max())),
        degree_of_wear=(ag - shoulder) / ag if ag > 0.0 else np.nan,
        degree_of_penetration=2.0 * depth / width if width > 0.0 else np.nan,
    )


def signed_areas(y: Floats, z: Floats) -> tuple[float, float]:
    """Areas [m2] between a polyline and z = 0: below it and above it, both positive."""
    width = np.diff(y)
    a, b = z[:-1], z[1:]
    crossing = a * b < 0.0
    span = np.where(crossing, b - a, 1.0)
    share = np.where(crossing, -a / span, 1.0)  # where the segment meets z = 0
    first = 0.5 * a * share * width
    second = np.where(crossing, 0.5 * b * (1.0 - share) * width, 0.5 * b * width)
    parts = np.concatenate([first, second])
    return float(-parts[parts < 0.0].sum()), float(parts[parts > 0.0].sum())


def _width(y: Floats, z: Floats, symmetric: bool) -> float:
    """Width at z = 0 of the stretch around the deepest point (half of it where symmetric)."""
    low = int(np.argmin(z))
    if z[low] >= 0.0:
        return 0.0

    def outward(step: int) -> float:
        i = low
        while 0 <= i + step < len(z) and z[i + step] < 0.0:
            i += step
        j = i + step
        if not 0 <= j < len(z):
            return float(y[i])
        return float(y[i] + (y[j] - y[i]) * z[i] / (z[i] - z[j]))

    return outward(1) - (float(y[0]) if symmetric else outward(-1))


def cut(points: Floats, faces: NDArray[np.int64], x: float, y: Floats) -> Floats:
    """Upper outline z (m,) [m] over y (m,) where the plane at `x` cuts a surface of quadrilaterals.

    points (n, 3), faces (f, 4). Each quadrilateral is four triangles around its centre. Where the surface lies
    over itself the highest sheet counts; nan where the plane meets no surface.
    """
    y = np.asarray(y, dtype=np.float64)
    z = np.full(len(y), -np.inf)
    corners = points[faces]
    near = (corners[:, :, 0].min(axis=1) <= x) & (corners[:, :, 0].max(axis=1) >= x)
    for a, b in _segments(_triangles(corners[near]), x):
        lo, hi = (a, b) if a[0] <= b[0] else (b, a)
        i, j = np.searchsorted(y, lo[0], side="left"), np.searchsorted(y, hi[0], side="right")
        if i == j:
            continue
        length = hi[0] - lo[0]
        share = (y[i:j] - lo[0]) / length if length > 0.0 else np.zeros(j - i)
        level = lo[1] + share * (hi[1] - lo[1]) if length > 0.0 else np.full(j - i, max(lo[1], hi[1]))
        z[i:j] = np.maximum(z[i:j], level)
    return np.where(np.isfinite(z), z, np.nan)


def _triangles(corners: Floats) -> Floats:
    """Quadrilaterals (f, 4, 3) as triangles (4 f, 3, 3) around their centres."""
    centre = corners.mean(axis=1)
    return np.concatenate([np.stack([corners[:, k], corners[:, (k + 1) % 4], centre], axis=1) for k in range(4)])


def _segments(triangles: Floats, x: float) -> list[tuple[Floats, Floats]]:
    """Segments ((y, z), (y, z)) in which the plane at x cuts triangles (t, 3, 3)."""
    segments = []
    side = triangles[:, :, 0] - x
    for t, d in zip(triangles, side, strict=True):
        ends = []
        for k in range(3):
            p, q, dp, dq = t[k], t[(k + 1) % 3], d[k], d[(k + 1) % 3]
            if dp == 0.0:
                ends.append(p[1:])
            if dp * dq < 0.0:
                ends.append(p[1:] + (q[1:] - p[1:]) * (dp / (dp - dq)))
        if len(ends) >= 2:
            segments.append((ends[0], ends[-1]))
    return segments


@dataclass(frozen=True)
class VolumeLedger:
    """Where the displaced volume is [m3], whole specimen.

    groove: below the first surface; shoulders: above it beside the track, behind the front of the tip; bow: above it
    ahead of the tip; compressed: volume that the remaining elements lost; removed: volume of removed elements in
    their last shape; closure: (groove - shoulders - bow - compressed - removed) / groove.
    """

    groove: float
    shoulders: float
    bow: float
    compressed: float
    removed: float
    closure: float


def volume_ledger(
    points: Floats,
    faces: NDArray[np.int64],
    front: float,
    first_volume: float,
    volume: float,
    removed: float,
    sides: float = 2.0,
) -> VolumeLedger:
    """Volumes between the surface of quadrilaterals and z = 0, and what the elements say.

    points (n, 3) [m]; faces (f, 4) outward; `front` [m] is the x that parts shoulders from bow wave; first_volume
    and volume [m3] are those of the remaining elements (first and present shape), removed [m3] that of removed ones
    in their first shape; all of the modelled part, which counts `sides` times.
    """
    t = _triangles(points[faces])
    flat = 0.5 * (
        (t[:, 1, 0] - t[:, 0, 0]) * (t[:, 2, 1] - t[:, 0, 1]) - (t[:, 2, 0] - t[:, 0, 0]) * (t[:, 1, 1] - t[:, 0, 1])
    )
    below, above = _split_prisms(t[:, :, 2], flat)
    ahead = t[:, :, 0].mean(axis=1) > front
    groove = -sides * float(below.sum())
    bow = sides * float(above[ahead].sum())
    shoulders = sides * float(above[~ahead].sum())
    compressed = sides * (first_volume - volume)
    gone = sides * removed
    closure = (groove - shoulders - bow - compressed - gone) / groove if groove > 0.0 else 0.0
    return VolumeLedger(groove, shoulders, bow, compressed, gone, closure)


def _split_prisms(z: Floats, flat: Floats) -> tuple[Floats, Floats]:
    """Volumes under linear heights z (t, 3) over projected areas flat (t,): (negative part, positive part), exact."""
    total = flat * z.mean(axis=1)
    s = np.sort(z, axis=1)
    lo, mid, hi = s[:, 0], s[:, 1], s[:, 2]
    positive = np.where(lo >= 0.0, total, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        one_up = flat * hi**3 / (3.0 * (hi - lo) * (hi - mid))  # only the highest corner above
        one_down = total - flat * lo**3 / (3.0 * (lo - mid) * (lo - hi))  # only the lowest corner below
    positive = np.where((hi > 0.0) & (mid <= 0.0), one_up, positive)
    positive = np.where((mid > 0.0) & (lo < 0.0), one_down, positive)
    return total - positive, positive
