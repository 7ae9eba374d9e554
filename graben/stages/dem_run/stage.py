"""dem-run: hand a scene to the stage of its kind, blocks or particles."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from graben.schemas.outputs import files_of
from graben.schemas.scene import Given, Overrides, load_scene
from graben.stages.shared.record import Progress, silent


def run(
    given: Given,
    output: Path,
    *,
    overrides: Overrides = (),
    overwrite: bool = False,
    restart: bool = False,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run the scene and write its artifact; returns the headline numbers of the stage of its kind.

    restart : go on from the checkpoint that a stopped run left beside the output

    Raises
    ------
    BadInput : the scene has faults, or the output exists
    NumericsFailed : the run had to stop; the last good state is kept beside the output
    """
    scene = load_scene(given, ("blocks", "particles"), overrides)
    stage = import_module(f"graben.stages.{scene.kind}.stage")
    stage.outputs_of(scene, output).claim(files_of(scene), overwrite=overwrite, restart=restart)
    return stage.run(scene, output, restart=restart, progress=progress)
