"""The fit of a law to stress-strain curves that lie in arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graben.api.materials import Material
from graben.api.materials import material as material_of
from graben.api.scenes import scene
from graben.api.units import known, parameter
from graben.errors import BadInput, Fault

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fit:
    """Parameters of a law found from curves, and how well the curves tell them.

    Attributes
    ----------
    material : the law with all its parameters, fixed and found
    parameters, standard_errors : of the free ones, in SI; an error is None where the curves do not tell
    rmse : root mean square of the misfit of axial stress, Pa
    stress, strain : (steps, 4) of the fitted law, by name of curve
    headline : all numbers that the command calibrate prints
    warnings : what a person should know before trusting the parameters
    """

    material: Material
    parameters: dict[str, float]
    standard_errors: dict[str, float | None]
    rmse: float
    stress: dict[str, Array] = field(repr=False)
    strain: dict[str, Array] = field(repr=False)
    headline: dict[str, Any] = field(repr=False)
    warnings: list[str]


def fit(
    curves: Mapping[str, Any] | Sequence[Any],
    law: str,
    free: Mapping[str, Any],
    fixed: Mapping[str, Any] | None = None,
    *,
    test: str = "plane-strain",
    length: float | str | None = None,
    fidelity: str = "standard",
    seed: int = 0,
    progress: Callable[[float, str], None] | None = None,
    **settings: Any,
) -> Fit:
    """Find the parameters with which a law follows stress-strain curves.

    Parameters
    ----------
    curves : by name, or a sequence: pairs of stress and strain, (steps, 4) each, components xx, yy, zz, xy, in Pa and
        with tensor shear, tension positive; or anything with such ``stress`` and ``strain``, as `follow` and
        `average` give. Axial is yy, lateral xx
    law : name of a law, "module:law" for one of one's own that a module defines
    free : bounds of each parameter to find, (lower, upper), or a table of lower, upper, initial, scale ("linear" or
        "log") and prior, as in a scene. Numbers in SI, or text with a unit
    fixed : the other parameters
    test : "plane-strain" or "triaxial"
    length : characteristic length that the curves stand for, in m, for laws with damage; 10 m unless given
    fidelity : "draft", "standard" or "reference"
    seed : of the search; the same seed gives the same numbers
    progress : called with the fraction done, 0 to 1, and a few words
    settings : further keys of a scene of kind "calibrate", such as ``swarm={"particles": 12}``

    Raises
    ------
    BadInput : every fault of curves, bounds and parameters
    """
    from graben.stages.calibrate.measured import curve_of
    from graben.stages.calibrate.stage import fit_curves, prepare_curves, reading_of
    from graben.stages.calibrate.state import State
    from graben.stages.calibrate.workers import workers_of
    from graben.stages.shared.record import silent

    known(law, "law")
    bounds = {name: _bounds(law, name, given) for name, given in free.items()}
    tables: dict[str, Any] = {
        "kind": "calibrate", "law": law, "free": bounds, "test": test, "fidelity": fidelity, "seed": seed,
        "fixed": {name: parameter(law, name, value) for name, value in (fixed or {}).items()},
        **settings,
    }  # fmt: skip
    if length is not None:
        tables["length"] = length if isinstance(length, str) else f"{float(length)!r} m"
    model = scene(tables)
    named = curves if isinstance(curves, Mapping) else {f"curve {k + 1}": c for k, c in enumerate(curves)}
    if not named:
        raise BadInput(Fault("", "curves", "", "at least one curve", True))
    measured = [curve_of(str(name), *_arrays(str(name), c), reading_of(model)) for name, c in named.items()]
    prepared = prepare_curves(model, measured)
    with workers_of(model.search, model.workers, prepared.problem.plan.particles, None) as workers:
        found = fit_curves(prepared, State(None, workers), progress or silent)
    rows = {c.name: len(c.stress) for c in measured}
    headline = {k: v for k, v in found.headline.items() if k != "warnings"}
    stress, strain = (
        {name: found.arrays[part][k, :n] for k, (name, n) in enumerate(rows.items())} for part in ("stress", "strain")
    )
    return Fit(
        material_of(law, **found.material), headline["parameters"], headline["standard_errors"], headline["rmse_pa"],
        stress, strain, headline, found.headline["warnings"],
    )  # fmt: skip


def curve(
    axial_strain: ArrayLike, axial_stress: ArrayLike, lateral_strain: ArrayLike, lateral_stress: ArrayLike = 0.0
) -> tuple[Array, Array]:
    """A curve for `fit` from the columns of a test, tension positive.

    Parameters
    ----------
    axial_strain, axial_stress : (steps,), Pa
    lateral_strain : (steps,); lateral_stress : (steps,) or one number, Pa

    Returns
    -------
    stress and strain, (steps, 4) each, with nan in zz: `fit` takes what the kind of test says

    Raises
    ------
    BadInput : columns of different lengths
    """
    columns = [np.asarray(c, dtype=np.float64) for c in (axial_strain, axial_stress, lateral_strain, lateral_stress)]
    steps = columns[0].shape
    if len(steps) != 1 or any(c.shape not in (steps, ()) for c in columns):
        expected = f"columns of one length, not {[c.shape for c in columns]}"
        raise BadInput(Fault("", "axial_strain", "", expected, True))
    stress, strain = np.zeros((*steps, 4)), np.zeros((*steps, 4))
    strain[:, 1], stress[:, 1] = columns[0], columns[1]
    strain[:, 0], stress[:, 0] = columns[2], columns[3]
    strain[:, 2], stress[:, 2] = np.nan, np.nan
    return stress, strain


def _bounds(law: str, name: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, Mapping):
        if isinstance(given, str) or len(given) != 2:
            raise BadInput(Fault("", f"free.{name}", repr(given), "(lower, upper), or a table", True))
        given = {"lower": given[0], "upper": given[1]}
    out = {k: v if k in ("scale", "prior") else parameter(law, name, v) for k, v in given.items()}
    if isinstance(given.get("prior"), Mapping):
        out["prior"] = {k: parameter(law, name, v) for k, v in given["prior"].items()}
    return out


def _arrays(name: str, given: Any) -> tuple[Array, Array]:
    pair = (given.stress, given.strain) if hasattr(given, "stress") else given
    try:
        stress, strain = (np.array(part, dtype=np.float64) for part in pair)
    except (TypeError, ValueError):
        raise BadInput(Fault("", "curves", name, "a pair of stress and strain, (steps, 4) each", True)) from None
    if stress.ndim != 2 or stress.shape != strain.shape or stress.shape[1] != 4:
        expected = f"stress and strain of one shape (steps, 4), not {stress.shape} and {strain.shape}"
        raise BadInput(Fault("", "curves", name, expected, True))
    return stress, strain
