"""The stock: small sound inputs of every kind, made once by the commands themselves."""

from __future__ import annotations

import json
import shutil
from contextlib import chdir, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from graben.schemas.provenance import Record
from tests.conftest import PIPELINES, ROOT, SMALL_BED, SMALL_BLOCKS
from tests.fuzz.call import call

QUICK = ["fidelity=draft", "swarm.starts=2", "swarm.particles=6", "swarm.generations=4", "refine.best=1",
         "refine.iterations=3"]  # fmt: skip


def make_stock(stock: Path) -> None:
    """Scenes, artifacts, checkpoints, curves, a map and meshes, small enough that each try takes milliseconds.

    The same bytes each time: a try can be made again by its seed and number.
    """
    from graben.schemas.kinds import SCENES
    from graben.schemas.template import template

    for name in ("scenes", "artifacts", "restart", "straight", "map", "mesh", "meshes"):
        (stock / name).mkdir(parents=True)
    for kind in SCENES:
        (stock / "scenes" / f"{kind}.template.toml").write_text(template(kind), encoding="utf-8")
    udec = PIPELINES / "upscaling/reference/udec"
    small = {
        "blocks": small_text(PIPELINES / "upscaling/voronoi-granite.toml", SMALL_BLOCKS),
        "particles": small_text(PIPELINES / "wear/bed.toml", SMALL_BED),
        "fem": small_text(PIPELINES / "upscaling/slope.toml", ["fidelity=draft"]),
        "scratch": small_text(PIPELINES / "wear/scratch.toml", ["fidelity=draft"]),
        "wear": (PIPELINES / "wear/astm-g65-mixtures.toml").read_text(encoding="utf-8"),
        "calibrate": small_text(PIPELINES / "upscaling/calibrate-udec.toml", QUICK).replace(
            "reference/udec", str(udec)
        ),
        "rev-study": 'kind = "rev-study"\n[samples]\nradii = ["0.6 m", "0.9 m"]\ngrid = 2\n',
    }  # fmt: skip
    for kind, text in small.items():
        (stock / "scenes" / f"{kind}.toml").write_text(text, encoding="utf-8")
    shutil.copy(PIPELINES / "upscaling/reference/udec_voronoi_granite_fit.csv", stock / "curves.csv")
    _make_map(stock / "map")
    _make_meshes(stock)
    # Clocks and folders would get into the artifacts.
    with patch.object(Record, "closed_cost", lambda self: dict(self.cost)), chdir(stock):
        make_artifacts(Path("artifacts"), Path("scenes"))
        _make_restart(Path("restart"), Path("straight"), Path("scenes"))


def make_artifacts(art: Path, scenes: Path) -> None:
    """A small artifact of each stage that is done in a second."""
    _made("dem-run", scenes / "blocks.toml", "-o", art / "blocks.nc", "-q")
    _made("dem-run", scenes / "particles.toml", "-o", art / "bed.nc", "-q")
    _made("homogenize", art / "blocks.nc", "--radius", "1 m", "-o", art / "curves.nc", "-q")
    _made("wear-estimate", scenes / "wear.toml", "-o", art / "wear.nc", "-q")
    _made("calibrate", scenes / "calibrate.toml", "-o", art / "calibration.nc", "-q")
    for path in [p for p in art.iterdir() if p.suffix != ".nc"]:
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def _made(*arguments: Any) -> None:
    answer = call(*arguments, seconds=600)
    if answer.code:
        raise RuntimeError(f"{arguments}: {answer.said}")


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


def _make_restart(folder: Path, straight: Path, scenes: Path) -> None:
    """What runs of blocks, of grains and of calibrate leave when they are interrupted halfway, and straight ones."""
    from graben.stages.calibrate import stage as calibrate
    from graben.stages.dem_run import stage as dem_run

    for kind, stage, end in (
        ("blocks", dem_run, "checkpoint"), ("particles", dem_run, "checkpoint"), ("calibrate", calibrate, "state"),
    ):  # fmt: skip
        scene, kept = folder / f"{kind}.toml", folder / f"{kind}.{end}.npz"
        shutil.copy(scenes / f"{kind}.toml", scene)
        stage.run(scene, straight / f"{kind}.nc")
        with suppress(KeyboardInterrupt):
            stage.run(scene, folder / f"{kind}.nc", progress=_Until(0.5 if end == "checkpoint" else 0.0, kept))
        if not kept.is_file():
            raise RuntimeError(f"an interrupted run left no {kept}")


@dataclass
class _Until:
    """Interrupts a run once it has come so far, and once there is a file where one is named."""

    share: float
    kept: Path | None = None

    def __call__(self, fraction: float, message: str) -> None:
        if fraction > self.share and (self.share or self.kept is None or self.kept.is_file()):
            raise KeyboardInterrupt


def warm(stock: Path, folder: Path) -> None:
    """Compile, or load, every kernel: an interrupt within that leaves half a kernel for later tries."""
    from graben.stages.scratch import stage as scratch

    (folder / "artifacts").mkdir()
    make_artifacts(folder / "artifacts", stock / "scenes")
    _made("fem-run", stock / "mesh/body.toml", "-o", folder / "body.nc", "-q")
    _made("dem-run", stock / "map/map.toml", "-o", folder / "map.nc", "-q")
    _made("show", stock / "artifacts/blocks.nc", "-o", folder / "blocks.png", "-q")
    with suppress(KeyboardInterrupt):
        scratch.run(stock / "scenes/scratch.toml", folder / "scratch.nc", progress=_Until(0.02))
    shutil.rmtree(folder)


def _make_map(folder: Path) -> None:
    """Three by three rectangles of 1 m, and a scene that loads them for a moment."""
    corners = [(float(i), float(j)) for i in range(3) for j in range(3)]
    squares = [[[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1], [x, y]] for x, y in corners]
    features = [
        {"type": "Feature", "properties": {"id": k}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
        for k, ring in enumerate(squares)
    ]
    (folder / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    text = small_text(ROOT / "pipelines/upscaling/voronoi-granite.toml", [
        "fidelity=draft", 'domain.width="3 m"', 'domain.height="3 m"', 'loading.duration="1 s"', "loading.states=3",
    ])  # fmt: skip
    head, _, rest = text.partition("[tessellation]")
    rest = rest[rest.index("\n[") :]
    table = '[tessellation]\nmethod = "file"\nfile = "map.geojson"\nrounding = "0.05 m"\n'
    (folder / "map.toml").write_text(head + table + rest, encoding="utf-8")


def _make_meshes(stock: Path) -> None:
    """A square of 4 by 4 quads in three formats, and a scene that loads it."""
    import meshio
    import numpy as np

    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    first = (np.arange(4)[:, None] * 5 + np.arange(4)).ravel()
    quads = np.column_stack([first, first + 1, first + 6, first + 5])
    mesh = meshio.Mesh(points, [("quad", quads)])
    mesh.write(stock / "meshes" / "m22.msh", file_format="gmsh22", binary=False)
    mesh.write(stock / "meshes" / "m41.msh", file_format="gmsh", binary=False)
    mesh.write(stock / "meshes" / "m.vtu", binary=False)
    mesh.write(stock / "meshes" / "m.inp")
    shutil.copy(stock / "meshes/m.vtu", stock / "mesh/m.vtu")
    (stock / "mesh/body.toml").write_text(
        'kind = "fem"\n[mesh]\nmethod = "file"\nfile = "m.vtu"\n'
        '[material]\nlaw = "elastic"\n[material.parameters]\nyoung_modulus = "1 GPa"\npoisson_ratio = 0.2\n'
        '[[supports]]\nname = "base"\nstart = ["0 m", "0 m"]\nend = ["1 m", "0 m"]\nfix = "both"\n'
        '[[loads]]\nname = "top"\nstart = ["0 m", "1 m"]\nend = ["1 m", "1 m"]\nrate = "1 MPa/s"\n'
        '[stepping]\ngoal = "end"\nend = "1 s"\nfirst = "1 s"\nlargest = "1 s"\n'
        'smallest = "0.1 s"\nsave_every = "1 s"\n'
    )
