"""The stock: small sound inputs of every kind, made once by the commands themselves."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from tests.conftest import PIPELINES, ROOT, SMALL_BED, SMALL_BLOCKS, settings
from tests.fuzz.call import call


def make_stock(stock: Path) -> None:
    """Scenes, artifacts, checkpoints, curves, a map and meshes, small enough that each try takes milliseconds."""
    from graben.schemas.kinds import SCENES
    from graben.schemas.template import template

    (stock / "scenes").mkdir(parents=True)
    (stock / "artifacts").mkdir()
    for kind in SCENES:
        (stock / "scenes" / f"{kind}.template.toml").write_text(template(kind), encoding="utf-8")
    small = {
        "blocks": small_text(PIPELINES / "upscaling/voronoi-granite.toml", SMALL_BLOCKS),
        "particles": small_text(PIPELINES / "wear/bed.toml", SMALL_BED),
        "fem": small_text(PIPELINES / "upscaling/slope.toml", ["fidelity=draft"]),
        "scratch": small_text(PIPELINES / "wear/scratch.toml", ["fidelity=draft"]),
        "wear": (PIPELINES / "wear/astm-g65-mixtures.toml").read_text(encoding="utf-8"),
        "calibrate": small_text(PIPELINES / "upscaling/calibrate-udec.toml", ["fidelity=draft"]).replace(
            "reference/udec", str(PIPELINES / "upscaling/reference/udec")
        ),
    }
    for kind, text in small.items():
        (stock / "scenes" / f"{kind}.toml").write_text(text, encoding="utf-8")

    make_artifacts(stock / "artifacts", stock / "scenes")
    shutil.copy(PIPELINES / "upscaling/reference/udec_voronoi_granite_fit.csv", stock / "curves.csv")
    _make_restart(stock)
    _make_map(stock)
    _make_meshes(stock)


def make_artifacts(art: Path, scenes: Path) -> None:
    """A small artifact of each stage that is done in a second."""

    def made(*arguments: Any) -> None:
        answer = call(*arguments, seconds=600)
        if answer.code:
            raise RuntimeError(f"{arguments}: {answer.said}")

    made("dem-run", scenes / "blocks.toml", "-o", art / "blocks.nc", "-q")
    made("dem-run", scenes / "particles.toml", "-o", art / "bed.nc", "-q")
    made("homogenize", art / "blocks.nc", "--radius", "1 m", "-o", art / "curves.nc", "-q")
    made("wear-estimate", scenes / "wear.toml", "-o", art / "wear.nc", "-q")
    quick = ["swarm.starts=1", "swarm.particles=6", "swarm.generations=4", "refine.best=1", "refine.iterations=3"]
    made("calibrate", scenes / "calibrate.toml", *settings(quick), "-o", art / "calibration.nc", "-q")
    for path in [p for p in art.iterdir() if p.suffix != ".nc"]:
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def small_text(scene: Path, overrides: list[str]) -> str:
    """The scene's text with overrides put in, so that damage may hit them too."""
    import tomllib

    text = scene.read_text(encoding="utf-8")
    for setting in overrides:
        name, _, value = setting.partition("=")
        *tables, last = name.split(".")
        value = json.dumps(value) if name == "fidelity" else value
        head = f"[{'.'.join(tables)}]" if tables else ""
        lines, inside = [], not tables
        for line in text.splitlines():
            if line.startswith("["):
                inside = line.strip() == head
            if not (inside and line.partition("=")[0].strip() == last):
                lines.append(line)
            if head and line.strip() == head:
                lines.append(f"{last} = {value}")
        if not tables:
            lines.insert(0, f"{last} = {value}")
        elif head not in lines:
            lines += [head, f"{last} = {value}"]
        text = "\n".join(lines) + "\n"
    tomllib.loads(text)
    return text


def _make_restart(stock: Path) -> None:
    """What runs of blocks and of calibrate leave when they are interrupted."""
    folder = stock / "restart"
    folder.mkdir()
    for kind, command in (("blocks", "dem-run"), ("calibrate", "calibrate")):
        text = (stock / "scenes" / f"{kind}.toml").read_text(encoding="utf-8")
        (folder / f"{kind}.toml").write_text(text.replace('"draft"', '"standard"'), encoding="utf-8")
        for seconds in (1.0, 2.0, 3.0, 5.0, 8.0, 13.0):
            call(command, folder / f"{kind}.toml", "-o", folder / f"{kind}.nc", "-q", seconds=seconds)
            if any(p.suffix == ".npz" and p.name.startswith(kind) for p in folder.iterdir()):
                break
            for path in folder.glob(f"{kind}.*"):
                if path.suffix not in (".toml", ".npz"):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


def _make_map(stock: Path) -> None:
    """Three by three rectangles of 1 m, and a scene that loads them for a moment."""
    corners = [(float(i), float(j)) for i in range(3) for j in range(3)]
    squares = [[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]] for x, y in corners]
    features = [
        {"type": "Feature", "properties": {"id": k}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for k, ring in enumerate(squares)
    ]
    (stock / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    text = small_text(ROOT / "pipelines/upscaling/voronoi-granite.toml", [
        "fidelity=draft", 'domain.width="3 m"', 'domain.height="3 m"', 'loading.duration="1 s"', "loading.states=3",
    ])  # fmt: skip
    head, _, rest = text.partition("[tessellation]")
    rest = rest[rest.index("\n[") :]
    table = '[tessellation]\nmethod = "file"\nfile = "map.geojson"\nrounding = "0.05 m"\n'
    (stock / "map.toml").write_text(head + table + rest, encoding="utf-8")


def _make_meshes(stock: Path) -> None:
    """A square of 4 by 4 quads in three formats, and a scene that loads it."""
    import meshio
    import numpy as np

    (stock / "meshes").mkdir()
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    first = (np.arange(4)[:, None] * 5 + np.arange(4)).ravel()
    quads = np.column_stack([first, first + 1, first + 6, first + 5])
    mesh = meshio.Mesh(points, [("quad", quads)])
    mesh.write(stock / "meshes" / "m22.msh", file_format="gmsh22", binary=False)
    mesh.write(stock / "meshes" / "m41.msh", file_format="gmsh", binary=False)
    mesh.write(stock / "meshes" / "m.vtu", binary=False)
    mesh.write(stock / "meshes" / "m.inp")
    (stock / "mesh.toml").write_text(
        'kind = "fem"\n[mesh]\nmethod = "file"\nfile = "MESH"\n'
        '[material]\nlaw = "elastic"\n[material.parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.2\n'
        '[[supports]]\nname = "base"\nstart = ["0 m", "0 m"]\nend = ["1 m", "0 m"]\nfix = "both"\n'
        '[[loads]]\nname = "top"\nstart = ["0 m", "1 m"]\nend = ["1 m", "1 m"]\nrate = "1 MPa/s"\n'
        '[stepping]\ngoal = "end"\nend = "1 s"\nfirst = "1 s"\nlargest = "1 s"\n'
        'smallest = "0.1 s"\nsave_every = "1 s"\n'
    )
