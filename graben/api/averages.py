"""Averages of a run over one region, in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from graben.api.stages import File, path_of
from graben.api.units import si

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Average:
    """Stress and strain of one region at every saved state.

    Attributes
    ----------
    time : (steps,) s
    stress, strain : (steps, 4) xx, yy, zz, xy, Pa, tension positive, tensor shear. Beds stand on end in z, which is
        yy here
    confining_stress : Pa, of the run
    measures : all arrays of the layout "curves" by name, such as porosity and fabric, for this region
    warnings : what a person should know before trusting the averages
    """

    time: Array
    stress: Array
    strain: Array
    confining_stress: float
    measures: dict[str, Any] = field(repr=False)
    warnings: list[str]


def average(
    run: File,
    *,
    radius: float | str | None = None,
    centre: Sequence[float | str] | None = None,
    polygon: Sequence[Sequence[float | str]] | None = None,
    deformed: bool = False,
    chosen_at: int = 0,
) -> Average:
    """Average stress and strain of a run of blocks over a circle or polygon, or of a bed of spheres over a ball.

    Lengths are numbers in m, or text with a unit.

    Parameters
    ----------
    run : a result of `graben.run`, or its artifact
    radius, centre, polygon, deformed, chosen_at : as in `graben.homogenize`, for one region

    Raises
    ------
    BadInput : faults of the run, or a region outside the model
    """
    from graben.stages.homogenize.stage import curves_of

    found = curves_of(
        [path_of(run)],
        radii=[] if radius is None else [si(radius, "m", "radius")],
        centre=None if centre is None else [si(c, "m", "centre") for c in centre],
        polygon=[(si(x, "m", "polygon"), si(y, "m", "polygon")) for x, y in polygon or ()],
        deformed=deformed,
        chosen_at=chosen_at,
    )
    own = {name: np.asarray(values)[0] for name, values in found.arrays.items()}
    time, stress, strain = (np.asarray(own.pop(name), dtype=np.float64) for name in ("time", "stress", "strain"))
    return Average(time, stress, strain, float(own["confining_stress"]), own, list(found.headline["warnings"]))
