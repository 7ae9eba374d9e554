"""Families of tries: each takes random numbers, the stock of sound inputs and an empty folder; may raise Fault."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from tests.fuzz.call import CHECK_S, STAGE_S, Answer, Fault, call, judge_output, run_scene, same_numbers
from tests.fuzz.damage import damage_dataset, damage_map, damage_saved, damaged_bytes, damaged_text


def scenes(rng: random.Random, stock: Path, folder: Path) -> None:
    source = rng.choice(sorted((stock / "scenes").glob("*.toml")))
    scene = folder / "scene.toml"
    scene.write_text(damaged_text(rng, source.read_text(encoding="utf-8")), encoding="utf-8")
    kind = source.name.split(".")[0]
    # A stage takes a hundred times longer than the check: few of those that are sound are started.
    run_scene(scene, kind, [stock / "artifacts/blocks.nc"], sound=rng.random() < 0.5)


def artifacts(rng: random.Random, stock: Path, folder: Path) -> None:
    """Bytes that a disk damaged, which the seal shows, or numbers and attributes that a program edited."""
    source = rng.choice(sorted((stock / "artifacts").glob("*.nc")))
    damaged = folder / source.name
    if rng.random() < 0.4:
        damaged.write_bytes(damaged_bytes(rng, source.read_bytes()))
    else:
        damage_dataset(rng, source, damaged)
    checked = call("check", damaged, seconds=CHECK_S)
    takes = {
        "blocks": [
            ("homogenize", "--radius", "1 m"),
            ("rev-study", "--radius", "0.6 m", "--radius", "0.9 m", "--processes", "1"),
        ],
        "bed": [("homogenize", "--radius", "0.1 mm"), ("wear-estimate", stock / "scenes/wear.toml", "--bed")],
        "curves": [("calibrate", stock / "restart/calibrate.toml")],
        "calibration": [("fem-run", stock / "mesh/body.toml", "--material")],
    }.get(source.stem, [])
    command, *options = rng.choice([("show",), ("report",), *takes])
    output = folder / {"show": "o.png", "report": "o.html"}.get(command, "o.nc")
    ran = call(command, *options, folder if command == "report" else damaged, "-o", output, "--json", "-q",
               seconds=STAGE_S)  # fmt: skip
    if checked.code == 2 and ran.code == 0 and command not in ("show", "report"):
        raise Fault(f"check refuses, {command} does not: {checked.said[-500:]}")
    if output.suffix == ".nc":
        judge_output(ran, output)


def checkpoints(rng: random.Random, stock: Path, folder: Path) -> None:
    """What an interrupted run left, damaged: gone on with to the result of a straight run, or refused."""
    shutil.copytree(stock / "restart", folder, dirs_exist_ok=True)
    kept = rng.choice(sorted(folder.glob("*.npz")))
    edited = rng.random() < 0.5
    if edited:
        damage_saved(rng, kept)
    else:
        kept.write_bytes(damaged_bytes(rng, kept.read_bytes()))
    kind, output = kept.name.split(".")[0], folder / (kept.name.split(".")[0] + ".nc")
    command = {"blocks": "dem-run", "particles": "dem-run", "calibrate": "calibrate"}[kind]
    ran = call(command, folder / f"{kind}.toml", "-o", output, "--restart", "--json", "-q", seconds=5.0)
    # A digest that fits vouches for the numbers: only shapes and ranges can be seen.
    if not edited:
        judge_output(ran, output)
    if ran.code == 0 and not edited and not same_numbers(output, stock / "straight" / output.name):
        raise Fault("the restart ends elsewhere than the straight run")


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
    shutil.copy(stock / "map/map.toml", folder / "map.toml")
    tree = json.loads((stock / "map/map.geojson").read_text())
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
    text = (stock / "mesh/body.toml").read_text().replace("m.vtu", source.name)
    (folder / "body.toml").write_text(text)
    (folder / source.name).write_bytes(damaged_bytes(rng, source.read_bytes()))
    run_scene(folder / "body.toml", "fem")


ENDS = [
    ".nc", "", ".vtu", ".pvd", ".partial.nc", ".last-good.nc", ".last-good.vtu", ".material.toml", ".toml", ".png",
    ".state.npz", ".checkpoint.npz", ".NC", "-joints.pvd", ".vtu/0000.vtu", ".vtu/x.txt", "/a.nc", ".nc/a.nc",
]  # fmt: skip
ODD = ["~", "ü.nc", ".nc", "..", ".", "-a", " ", "a\\b", "new/deep/a.nc", "a#b:c?.nc", "x" * 250 + ".nc"]


def outputs(rng: random.Random, stock: Path, folder: Path) -> None:
    """Names of outputs among files of the user and outputs of an earlier run: what is the user's stays as it is."""
    shutil.copytree(stock / "mesh", folder, dirs_exist_ok=True)
    shutil.copy(stock / "artifacts/blocks.nc", folder / "in.nc")
    shutil.copy(stock / "scenes/wear.toml", folder / "wear.toml")
    names = [name + end for name in ("a", "b", "a.b") for end in ENDS] + [*ODD, "wear.toml", "m.vtu"]

    def run(*options: str) -> Answer:
        command = rng.choice([
            ("fem-run", folder / "body.toml"), ("wear-estimate", folder / "wear.toml"), ("show", folder / "in.nc"),
            ("homogenize", folder / "in.nc", "--radius", "1 m", "--vtk"),
        ])  # fmt: skip
        return call(*command, *options, "-o", folder / rng.choice(names), "--json", "-q", seconds=STAGE_S)

    before = users(folder)
    if rng.random() < 0.5:
        run()
    for name in rng.sample(names, 3):
        with suppress(OSError):  # a name that is taken, or below a file
            put(rng, folder / name)
    before |= users(folder)
    ran = run(*rng.choice([(), ("--overwrite",)]))
    now = users(folder)
    lost = [path.name for path in before if now.get(path) != before[path]]
    half = [path.name for path in folder.rglob(".*.part*")]
    if lost or half:
        raise Fault(f"exit code {ran.code}: lost {lost}, half made {half}")


PRECIOUS = b"precious"
INPUTS = ("in.nc", "wear.toml", "body.toml", "m.vtu")


def put(rng: random.Random, path: Path) -> None:
    """Something of the user's at a free name."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(path):
        return
    match rng.randrange(5):
        case 0:
            path.symlink_to(rng.choice(["in.nc", "nowhere"]))
        case 1:
            os.mkfifo(path)
        case _:
            path.write_bytes(PRECIOUS)


def users(folder: Path) -> dict[Path, Any]:
    """What must outlive a run: inputs, files with PRECIOUS, links and pipes."""
    found: dict[Path, Any] = {}
    for path in folder.rglob("*"):
        if path.is_symlink():
            found[path] = os.readlink(path)
        elif path.is_fifo():
            found[path] = "pipe"
        elif path.is_file() and (path.relative_to(folder).as_posix() in INPUTS or path.read_bytes() == PRECIOUS):
            found[path] = path.read_bytes()
    return found


Family = Callable[[random.Random, Path, Path], None]
FAMILIES: dict[str, tuple[Family, float]] = {
    "scenes": (scenes, 0.45),
    "artifacts": (artifacts, 0.25),
    "checkpoints": (checkpoints, 0.1),
    "outputs": (outputs, 0.05),
    "curves": (curves, 0.05),
    "maps": (maps, 0.05),
    "meshes": (meshes, 0.05),
}
