"""graben show: one picture of one artifact, by the drawer of its kind."""

from __future__ import annotations

import io
from importlib import import_module
from pathlib import Path

from graben.errors import BadInput, Fault
from graben.schemas.artifact import PARTIAL, read_artifact
from graben.schemas.artifact_marks import DIGEST
from graben.schemas.files import whole_file
from graben.schemas.kinds import LAYOUTS, layout
from graben.schemas.outputs import PICTURES, Outputs, picture_mark

_DPI = 130


def run(artifact: Path, output: Path, *, overwrite: bool = False) -> None:
    """Draw `artifact` into `output`.

    Raises
    ------
    BadInput : the artifact has faults, the picture exists, or its format is not one of PICTURES
    """
    if output.suffix not in PICTURES:
        raise BadInput(Fault(str(output), "", "", "a picture name ending in " + ", ".join(PICTURES)))
    Outputs(output, kept=()).claim([artifact], overwrite=overwrite)
    picture = drawn(artifact, output.suffix)
    with whole_file(output, ends_run=True) as temporary:
        temporary.write_bytes(picture)


def drawn(artifact: Path, form: str) -> bytes:
    """The picture of an artifact, as a file of one of PICTURES.

    Raises
    ------
    BadInput : the artifact has faults, or another program wrote numbers into it that cannot be drawn
    """
    dataset = read_artifact(artifact, LAYOUTS, partial=True)
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    drawer = import_module("graben.stages.tools.show." + dataset.attrs["schema_kind"].replace("-", "_"))
    figure = Figure(figsize=(10, 7), layout="constrained")
    stopped = dataset.attrs.get(PARTIAL)
    if stopped is not None:
        allowed = layout(dataset.attrs["schema_kind"]).variables
        floats = [n for n, v in dataset.data_vars.items() if v.dtype.kind == "f" and not allowed[n].may_be_nan]
        dataset = dataset.assign({name: dataset[name].fillna(0.0) for name in floats})
        words = f"kept by a run that failed; numbers that are not finite are drawn as 0: {stopped}"
        figure.text(0.01, 0.005, words[:160], fontsize=7, color="firebrick")
    warnings = str(dataset.attrs.get("warnings", "")).splitlines()
    if warnings and stopped is None:
        more = f" (and {len(warnings) - 1} more)" if len(warnings) > 1 else ""
        figure.text(0.01, 0.005, f"warning: {warnings[0][:150]}{more}", fontsize=7, color="firebrick")
    if stopped is not None or warnings:
        figure.get_layout_engine().set(rect=(0.0, 0.03, 1.0, 0.97))  # type: ignore[union-attr, call-arg]
    picture = io.BytesIO()
    try:
        drawer.draw(dataset, figure)
        figure.savefig(picture, format=form[1:], dpi=_DPI, metadata=picture_mark(form))
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        if DIGEST in dataset.attrs:
            raise
        expected = f"numbers that can be drawn ({error}); another program has written or edited this file"
        raise BadInput(Fault(str(artifact), "", "", expected)) from error
    return picture.getvalue()
