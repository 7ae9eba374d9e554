"""graben show: one picture of one artifact, by the drawer of its kind."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from graben.errors import BadInput, Fault
from graben.schemas.artifact import PARTIAL, read_artifact
from graben.schemas.files import whole_file
from graben.schemas.kinds import LAYOUTS, layout
from graben.schemas.outputs import Outputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".pdf", ".svg")
DPI = 130


def run(artifact: Path, output: Path, *, overwrite: bool = False) -> None:
    """Draw `artifact` into `output`.

    Raises
    ------
    BadInput : the artifact has faults, the picture exists, or its format is not one of FORMATS
    """
    if output.suffix not in FORMATS:
        raise BadInput(Fault(str(output), "", "", "a picture name ending in " + ", ".join(FORMATS)))
    Outputs(output, kept=()).claim([artifact], overwrite=overwrite)
    figure = figure_of(artifact)
    with whole_file(output, ends_run=True) as temporary:
        figure.savefig(temporary, dpi=DPI)


def figure_of(artifact: Path) -> Figure:
    """The picture of an artifact; BadInput where it has faults."""
    dataset = read_artifact(artifact, LAYOUTS, partial=True)
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    drawer = import_module("graben.stages.show." + dataset.attrs["schema_kind"].replace("-", "_"))
    figure = Figure(figsize=(10, 7), layout="constrained")
    stopped = dataset.attrs.get(PARTIAL)
    if stopped is not None:
        allowed = layout(dataset.attrs["schema_kind"]).variables
        floats = [n for n, v in dataset.data_vars.items() if v.dtype.kind == "f" and not allowed[n].may_be_nan]
        dataset = dataset.assign({name: dataset[name].fillna(0.0) for name in floats})
        words = f"kept by a run that failed; numbers that are not finite are drawn as 0: {stopped}"
        figure.text(0.01, 0.005, words[:160], fontsize=7, color="firebrick")
    drawer.draw(dataset, figure)
    return figure
