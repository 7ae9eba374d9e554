"""Stages in Python: run a scene, average a run; the artifact is a file, temporary unless a name is given."""

from __future__ import annotations

import builtins
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graben.api.artifacts import open as open_artifact
from graben.api.scenes import scene as checked
from graben.api.units import si
from graben.errors import BadInput, Fault
from graben.schemas.scene import Given

if TYPE_CHECKING:
    import xarray

    from graben.api.materials import Material

Progress = Callable[[float, str], None]

# Kind of scene -> its stage, and what that takes beside the scene.
_STAGES: dict[str, tuple[str, tuple[str, ...]]] = {
    "blocks": ("dem_run", ("restart",)),
    "particles": ("dem_run", ("restart",)),
    "rev-study": ("rev_study", ("inputs", "cluster", "restart")),
    "calibrate": ("calibrate", ("curves", "validate", "compare", "cluster", "restart")),
    "fem": ("fem_run", ("material", "restart")),
    "scratch": ("scratch", ("material", "restart")),
    "wear": ("wear_estimate", ("bed", "scratch")),
}


class Result(Mapping[str, Any]):
    """The headline numbers of a run, by name in SI; names end in their unit, such as ``failure_load_pa``.

    A number that does not exist is None. Without a name for its output the artifact lies in a temporary folder that
    lives as long as this object.

    Attributes
    ----------
    output : the artifact
    warnings : what a person should know before trusting the result
    """

    def __init__(self, headline: Mapping[str, Any], output: Path, folder: Any = None) -> None:
        self._headline = {k: v for k, v in headline.items() if k not in ("warnings", "output")}
        self.warnings: list[str] = list(headline.get("warnings", []))
        self.output = output
        self._folder = folder

    def open(self) -> xarray.Dataset:
        """The artifact as a dataset, see `graben.open`."""
        return open_artifact(self.output)

    def __getitem__(self, name: str) -> Any:
        return self._headline[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._headline)

    def __len__(self) -> int:
        return len(self._headline)

    def __repr__(self) -> str:
        lines = [f"{name}: {value!r}" for name, value in self.items()]
        lines += [f"warning: {text}" for text in self.warnings]
        return "\n".join([f"Result of {self.output}", *("  " + line for line in lines)])


File = str | Path | Result
"""A file by name, or the artifact of a result."""


def run(
    scene: Given,
    output: str | Path | None = None,
    *,
    set: Mapping[str, Any] | None = None,
    material: File | Material | None = None,
    inputs: Sequence[File] | None = None,
    curves: Sequence[File] | None = None,
    validate: Sequence[File] | None = None,
    compare: Sequence[str | Path] | None = None,
    bed: File | None = None,
    scratch: Mapping[str, Sequence[File]] | None = None,
    cluster: str | None = None,
    restart: bool | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Run the stage of a scene's kind, and write its artifact.

    Parameters
    ----------
    scene : a TOML file, tables, a scene, or a kind for its defaults; see `graben.scene`
    output : name of the artifact; a temporary one unless given
    set : values that replace keys of the scene, by dotted name
    material : kinds "fem" and "scratch": a material, its file, or the result of a calibration, instead of the scene's
    inputs : kind "rev-study": runs of blocks
    curves, validate, compare : kind "calibrate": files of curves to fit instead of the scene's, files to predict
        only, scenes of rival laws
    bed, scratch : kind "wear": a run of grains; runs of scratches by class of grain
    cluster : kinds "rev-study" and "calibrate": address of a Dask scheduler
    restart : all kinds but "wear": go on where a stopped run with the same output left off
    overwrite : replace what an earlier run wrote under the same name
    progress : called with the fraction done, 0 to 1, and a few words

    Raises
    ------
    BadInput : every fault of scene and inputs at once; nothing is written
    NumericsFailed : the numerics failed; a note of the error names the last good state
    """
    model = checked(scene, set)
    stage, takes = _STAGES[model.kind]
    if isinstance(material, Mapping) and not isinstance(material, Result):
        model, material = checked(model, {"material": dict(material)}), None
    given = {
        "material": material, "inputs": inputs, "curves": curves, "validate": validate, "compare": compare,
        "bed": bed, "scratch": scratch, "cluster": cluster, "restart": restart,
    }  # fmt: skip
    extra = {name: value for name, value in given.items() if value is not None}
    strange = [
        Fault(str(model.source.path), name, "", f"no such input of a scene of kind {model.kind!r}", True)
        for name in extra
        if name not in takes
    ]
    if strange:
        raise BadInput(strange)
    extra = {name: _files(value) if name not in ("cluster", "restart") else value for name, value in extra.items()}
    module = import_module(f"graben.stages.{stage}.stage")
    first = [model]
    if model.kind == "rev-study":
        first = [extra.pop("inputs", []), model]
        if not first[0]:
            raise BadInput(Fault(str(model.source.path), "inputs", "", "at least one run of blocks", True))
    extra["overwrite"] = overwrite
    return _written(output, model.kind, progress, lambda path, options: module.run(*first, path, **extra, **options))


def homogenize(
    inputs: File | Sequence[File],
    output: str | Path | None = None,
    *,
    radius: float | str | Sequence[float | str] | None = None,
    centre: Sequence[float | str] | None = None,
    polygon: Sequence[Sequence[float | str]] | None = None,
    deformed: bool = False,
    chosen_at: int = 0,
    steps: str | Path | None = None,
    vtk: bool = False,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Average stress and strain of runs of blocks over regions, or of beds of spheres over balls, as curves.

    Lengths are numbers in m, or text with a unit.

    Parameters
    ----------
    inputs : one or more runs of blocks, or of grains
    output : name of the artifact of curves; a temporary one unless given
    radius : of circles or balls, one or several
    centre : (x, y), of spheres (x, y, z); the middle of each model unless given
    polygon : (n, 2) corners, instead of a radius
    deformed : measure area and strain in the current shape of the outline
    chosen_at : saved state at which blocks are said to meet the region (0: the first)
    steps : also draw how the outline was found (.png, .pdf, .svg)
    vtk : also write the outlines as they move
    overwrite, progress : as in `run`

    Raises
    ------
    BadInput : faults of the inputs, or a region outside the model
    """
    from graben.stages.homogenize import stage

    several = inputs if isinstance(inputs, Sequence) and not isinstance(inputs, str) else [inputs]
    radii = radius if isinstance(radius, Sequence) and not isinstance(radius, str) else [radius]
    runs = [path_of(p) for p in several]
    asked: dict[str, Any] = {
        "radii": [si(r, "m", "radius") for r in radii if r is not None],
        "centre": None if centre is None else [si(c, "m", "centre") for c in centre],
        "polygon": [(si(x, "m", "polygon"), si(y, "m", "polygon")) for x, y in polygon or ()],
        "deformed": deformed,
        "chosen_at": chosen_at,
        "steps_picture": None if steps is None else Path(steps),
        "vtk": vtk,
        "overwrite": overwrite,
    }
    return _written(output, "curves", progress, lambda path, options: stage.run(runs, path, **asked, **options))


def path_of(given: File) -> Path:
    """The file of a result, or the one that is named."""
    return given.output if isinstance(given, Result) else Path(given)


def _files(given: Any) -> Any:
    if isinstance(given, Mapping) and not isinstance(given, Result):
        return {name: _files(value) for name, value in given.items()}
    if isinstance(given, builtins.list | tuple):
        return [path_of(value) for value in given]
    return path_of(given)


def _written(
    output: str | Path | None, name: str, progress: Progress | None, stage: Callable[[Path, dict[str, Any]], Any]
) -> Result:
    options = {} if progress is None else {"progress": progress}
    if output is not None:
        return Result(stage(Path(output), options), Path(output))
    folder = tempfile.TemporaryDirectory(prefix="graben-")
    path = Path(folder.name) / f"{name}.nc"
    try:
        return Result(stage(path, options), path, folder)
    except Exception as error:
        error.__dict__["folder"] = folder  # what a failed run kept lives as long as its error
        raise
