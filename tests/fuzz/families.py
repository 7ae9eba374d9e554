"""Families of tries: each takes random numbers, the stock of sound inputs and an empty folder; may raise Fault."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

from tests.fuzz.call import CHECK_S, HUNG_S, STAGE_S, call, run_scene
from tests.fuzz.damage import damage_map, damaged_bytes, damaged_text


def scenes(rng: random.Random, stock: Path, folder: Path) -> None:
    source = rng.choice(sorted((stock / "scenes").glob("*.toml")))
    scene = folder / "scene.toml"
    scene.write_text(damaged_text(rng, source.read_text(encoding="utf-8")), encoding="utf-8")
    kind = source.name.split(".")[0]
    # Most tries are of the check alone, which is a hundred times faster than the start of a stage.
    run_scene(scene, kind if rng.random() < 0.15 else "")


def artifacts(rng: random.Random, stock: Path, folder: Path) -> None:
    source = rng.choice(sorted((stock / "artifacts").glob("*.nc")))
    damaged = folder / source.name
    damaged.write_bytes(damaged_bytes(rng, source.read_bytes()))
    call("check", damaged, seconds=CHECK_S)
    command = rng.choice(["show", "report", "homogenize", "rev-study", "none", "none", "none"])
    output = folder / {"show": "o.png", "report": "o.html"}.get(command, "o.nc")
    if command == "report":
        call("report", folder, "-o", output, seconds=HUNG_S)
    elif command != "none":
        call(
            command, damaged, *(["--radius", "1 m"] if command == "homogenize" else []), "-o", output, seconds=STAGE_S
        )


def checkpoints(rng: random.Random, stock: Path, folder: Path) -> None:
    """The checkpoint of an interrupted run, damaged: gone on with as it was, or refused."""
    shutil.copytree(stock / "restart", folder, dirs_exist_ok=True)
    kept = rng.choice([p for p in sorted(folder.iterdir()) if p.suffix == ".npz"])
    kept.write_bytes(damaged_bytes(rng, kept.read_bytes()))
    scene = folder / "blocks.toml" if "checkpoint" in kept.name else folder / "calibrate.toml"
    command = "dem-run" if "checkpoint" in kept.name else "calibrate"
    output = folder / (kept.name.split(".")[0] + ".nc")
    call(command, scene, "-o", output, "--restart", "--json", "-q", seconds=3.0)


SPELT = [
    (",", ";"), (",", "\t"), (".", ","), ("\n", "\r\n"), ("\n", "\n\n"), ("e-", "E-"), ("0", ""), (",", ", "),
    ("-", "−"), ("\n", ",\n"), (",", ",,"), ("1", "nan"), ("2", "x"),
]  # fmt: skip


def curves(rng: random.Random, stock: Path, folder: Path) -> None:
    shutil.copy(stock / "scenes" / "calibrate.toml", folder / "calibrate.toml")
    data = (stock / "curves.csv").read_bytes()
    if rng.random() < 0.6:
        text = data.decode()
        for _ in range(rng.choice([1, 2, 3])):
            old, new = rng.choice(SPELT)
            text = text.replace(old, new, rng.choice([-1, -1, 1, 5]))
        data = text.encode(rng.choice(["utf-8", "utf-8-sig", "utf-16", "cp1252", "utf-16-le"]), errors="replace")
    else:
        data = damaged_bytes(rng, data)
    (folder / "curves.csv").write_bytes(data)
    call("calibrate", folder / "calibrate.toml", folder / "curves.csv", "-o", folder / "o.nc", "-q", seconds=STAGE_S)


def maps(rng: random.Random, stock: Path, folder: Path) -> None:
    shutil.copy(stock / "map.toml", folder / "map.toml")
    tree = json.loads((stock / "map.geojson").read_text())
    if rng.random() < 0.8:
        for _ in range(rng.choice([1, 1, 2])):
            damage_map(rng, tree)
        data = json.dumps(tree).encode()
    else:
        data = damaged_bytes(rng, json.dumps(tree).encode())
    (folder / "map.geojson").write_bytes(data)
    run_scene(folder / "map.toml", "blocks")


def meshes(rng: random.Random, stock: Path, folder: Path) -> None:
    source = rng.choice(sorted((stock / "meshes").iterdir()))
    text = (stock / "mesh.toml").read_text().replace("MESH", source.name)
    (folder / "body.toml").write_text(text)
    (folder / source.name).write_bytes(damaged_bytes(rng, source.read_bytes()))
    run_scene(folder / "body.toml", "fem")


Family = Callable[[random.Random, Path, Path], None]
FAMILIES: dict[str, tuple[Family, float]] = {
    "scenes": (scenes, 0.55),
    "artifacts": (artifacts, 0.25),
    "checkpoints": (checkpoints, 0.05),
    "curves": (curves, 0.05),
    "maps": (maps, 0.05),
    "meshes": (meshes, 0.05),
}
