"""graben report: one self-contained HTML page for all artifacts of a folder."""

from __future__ import annotations

import base64
import html
import json
from pathlib import Path
from typing import Any

from graben.errors import BadInput, Fault
from graben.schemas.artifact import read_artifact
from graben.schemas.files import whole_file
from graben.schemas.kinds import LAYOUTS
from graben.schemas.outputs import Outputs
from graben.stages.shared.record import Progress, silent
from graben.stages.tools import picture

_STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:62em;margin:2em auto;padding:0 1em;color:#222}"
    "img{max-width:100%;border:1px solid #ddd}table{border-collapse:collapse;margin:.7em 0}"
    "td{padding:.15em .9em .15em 0;vertical-align:top;font-size:90%}td:first-child{color:#666}"
    "pre{background:#f6f6f4;padding:.7em;overflow:auto;font-size:85%}h2{margin-top:2em}"
)


def run(folder: Path, output: Path, *, overwrite: bool = False, progress: Progress = silent) -> dict[str, Any]:
    """Draw every artifact (*.nc) of `folder` and write the page.

    Raises
    ------
    BadInput : no artifact there, one with faults, or the page exists
    """
    if output.suffix not in (".html", ".htm"):
        raise BadInput(Fault(str(output), "", "", "a page name ending in .html"))
    artifacts = sorted(folder.glob("*.nc"))
    Outputs(output, kept=()).claim(artifacts, overwrite=overwrite)
    if not artifacts:
        raise BadInput(Fault(str(folder), "", "", "a folder with artifacts (*.nc)"))
    sections = []
    for number, artifact in enumerate(artifacts):
        progress(number / len(artifacts), artifact.name)
        sections.append(_section(artifact, picture.drawn(artifact, ".png")))
    title = f"graben: {folder.name}"
    body = "\n".join(sections)
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{html.escape(title)}</h1>\n{body}\n</body></html>\n"
    )
    with whole_file(output, ends_run=True) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return {"report": str(output), "artifacts": len(artifacts)}


def _section(artifact: Path, png: bytes) -> str:
    attributes = read_artifact(artifact, LAYOUTS, partial=True).attrs
    cost = json.loads(attributes["cost"])
    inputs = json.loads(attributes["inputs"])
    facts = {
        "kind": f"{attributes['schema_kind']} (layout {attributes['schema_version']})",
        "made by": f"{attributes['software']} {attributes['software_version']} on {attributes['machine']}",
        **{f"input {Path(name).name}": f"SHA-256 {digest[:16]}..." for name, digest in inputs.items()},
        **{key: f"{value:.6g}" if isinstance(value, float) else value for key, value in cost.items()},
    }
    doubts = "".join(f"<p>Warning: {html.escape(t)}</p>" for t in attributes.get("warnings", "").splitlines())
    rows = "".join(f"<tr><td>{html.escape(k)}</td><td>{html.escape(str(v))}</td></tr>" for k, v in facts.items())
    scene = attributes["scene"]
    text = f"<details><summary>scene</summary><pre>{html.escape(scene)}</pre></details>" if scene else ""
    image = base64.b64encode(png).decode()
    return (
        f"<h2>{html.escape(artifact.stem)}</h2><p>{html.escape(attributes['title'])}</p>{doubts}"
        f'<img alt="{html.escape(artifact.stem)}" src="data:image/png;base64,{image}"><table>{rows}</table>{text}'
    )
