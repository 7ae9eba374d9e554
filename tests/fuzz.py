"""Damaged scenes, artifacts, checkpoints, curves, maps and meshes: each is read, or refused by exit code 2 or 3.

    python tests/fuzz.py                            # 20,000 tries, or as many as fit in 20 minutes
    python tests/fuzz.py --tries 500 --seconds 60 --seed 7 scenes artifacts
    python tests/fuzz.py --again scenes:7:123       # one try again, in this process, with its traceback

A try fails by exit code 1, a traceback, a dead process, a hang, a file left half made, a number that JSON does not
know, or a scene that a stage refuses after `graben check` found no fault. Findings lie in results/fuzz/.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import multiprocessing.connection
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
CHECK_S, STAGE_S, HUNG_S = 10.0, 1.0, 90.0


@dataclass(frozen=True)
class Finding:
    family: str
    seed: int
    number: int
    what: str
    file: Path | None = None

    @property
    def name(self) -> str:
        return f"{self.family}:{self.seed}:{self.number}"


class Fault(AssertionError):
    """What a try shows that must not be."""


# --- the call of a command, in this process --------------------------------------------------------------------------


@dataclass(frozen=True)
class Answer:
    code: int
    said: str
    out: str


def call(*arguments: Any, seconds: float) -> Answer:
    """`graben ARGUMENTS...`; interrupted after `seconds`, which must end it with exit code 130."""
    from click.testing import CliRunner

    from graben.cli.main import main

    with interrupted_after(seconds):
        result = CliRunner().invoke(main, [str(a) for a in arguments])
    if result.exit_code not in (0, 2, 3, 130):
        raise Fault(f"exit code {result.exit_code} of {arguments[0]}: {result.output[-2000:]}")
    if "Traceback" in result.output:
        raise Fault(f"a traceback: {result.output[-2000:]}")
    return Answer(result.exit_code, result.stderr, result.stdout)


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


COMMANDS = {"blocks": "dem-run", "particles": "dem-run", "fem": "fem-run", "scratch": "scratch", "calibrate": "calibrate",
            "wear": "wear-estimate"}  # fmt: skip


def run_scene(scene: Path, kind: str) -> Answer:
    """Check the scene, then start its stage for a second: whole files or none, and no refusal that check did not see."""
    checked = call("check", scene, seconds=CHECK_S)
    if checked.code == 130:
        raise Fault(f"graben check took more than {CHECK_S:g} s")
    if kind not in COMMANDS:
        return checked
    output = scene.with_name("out.nc")
    ran = call(COMMANDS[kind], scene, "-o", output, "--json", "-q", seconds=STAGE_S)
    if ran.code == 2 and checked.code == 0:
        raise Fault(f"check found no fault, the stage refuses: {ran.said[-500:]}")
    if ran.code == 0:
        json.loads(ran.out.splitlines()[-1], parse_constant=_no_json)
        if call("check", output, seconds=CHECK_S).code:
            raise Fault("the artifact of a finished run has faults")
    elif output.exists():
        raise Fault(f"exit code {ran.code}, but there is an output")
    left = [p.name for p in scene.parent.iterdir() if ".part" in p.name]
    if left:
        raise Fault(f"half made: {left}")
    return ran


def _no_json(name: str) -> float:
    raise Fault(f"{name} in JSON")


# --- damage ----------------------------------------------------------------------------------------------------------

NUMBERS = ["0", "-1", "1e-300", "-1e-300", "5e-324", "1e300", "1e400", "inf", "-inf", "nan", "2147483648", "9" * 400,
           "1", "3", "0.5", "true", "-0.0", "18446744073709551616", "1e-12", "1e12", "100000000"]  # fmt: skip
SPELLINGS = ["1,5", "1 500", "1.500,0", "1'000", "9**9**9", "1/0", "0x10", "१", "1_0", "−3", "1e", "--1", "1+1", "(1", "1 1"]
UNITS = ["m", "mm", "MPa", "GPa", "Pa/m", "deg", "rad", "kg/m^3", "s", "N", "m/s", "1/s", "Hz", "rpm", "degC", "m m", "m^9^9",
         "", "quux", "dB", "%", "N m", "J", "Pa/m^2", "m²", "µm", "m; import os", "__class__"]  # fmt: skip
VALUES = ['""', "[]", "{}", '"x"', "[[]]", "[1, 2]", "[[1, 2], [3]]", "{ a = 1 }", "1979-05-27", '"\\u0000"', '"/dev/zero"',
          '"."', '"../../etc/passwd"', "[" * 40 + "]" * 40, '"' + "y" * 3000 + '"']  # fmt: skip


def another_value(rng: random.Random, old: str) -> str:
    chance = rng.random()
    if chance < 0.35:
        return rng.choice(NUMBERS)
    if chance < 0.75:
        number = rng.choice([*NUMBERS, *SPELLINGS, f"{rng.uniform(-5, 50):.3g}", f"{10 ** rng.uniform(-12, 12):.3g}"])
        unit = rng.choice(UNITS) if rng.random() < 0.4 or '"' not in old else old.strip('"').partition(" ")[2]
        return json.dumps(f"{number} {unit}", ensure_ascii=False)
    return rng.choice(VALUES)


def damaged_text(rng: random.Random, text: str) -> str:
    """One to three changes of a TOML text: a value, a line dropped, doubled or moved, a character."""
    lines = text.splitlines()
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        k = rng.randrange(len(lines))
        keys = [i for i, line in enumerate(lines) if "=" in line and not line.lstrip().startswith("#")]
        chance = rng.random()
        if chance < 0.7 and keys:
            k = rng.choice(keys)
            name, _, old = lines[k].partition("=")
            lines[k] = f"{name}= {another_value(rng, old.strip())}"
        elif chance < 0.8:
            del lines[k]
        elif chance < 0.87:
            lines.insert(rng.randrange(len(lines)), lines[k])
        elif chance < 0.93 and lines[k]:
            at = rng.randrange(len(lines[k]))
            lines[k] = lines[k][:at] + chr(rng.choice([0, 9, 34, 91, 92, 123, 233, 0x4E00, rng.randrange(32, 127)])) + lines[k][at:]
        else:
            lines.insert(k, f"{rng.choice(['seed', 'extra', 'loads', '[domain', '[[supports]]', 'a.b.c'])} = {rng.choice(NUMBERS)}")
        if not lines:
            return ""
    return "\n".join(lines) + "\n"


def damaged_bytes(rng: random.Random, data: bytes) -> bytes:
    """Cut short, a few bytes changed, a piece overwritten, dropped or repeated."""
    chance, size = rng.random(), len(data)
    if chance < 0.2:
        return data[: rng.randrange(size)]
    out = bytearray(data)
    if chance < 0.7:
        for _ in range(rng.choice([1, 1, 2, 8])):
            out[rng.randrange(size)] = rng.randrange(256)
    else:
        at, long = rng.randrange(size), rng.choice([1, 8, 64, 1000])
        if chance < 0.8:
            out[at : at + long] = bytes(len(out[at : at + long]))
        elif chance < 0.9:
            del out[at : at + long]
        else:
            out[at:at] = out[at : at + long]
    return bytes(out)


# --- families of tries: (generator of random numbers, seeds of this family, empty folder) -> nothing, or Fault --------


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
        call(command, damaged, *(["--radius", "1 m"] if command == "homogenize" else []), "-o", output, seconds=STAGE_S)


def checkpoints(rng: random.Random, stock: Path, folder: Path) -> None:
    """The checkpoint of an interrupted run, damaged: gone on with as it was, or refused."""
    shutil.copytree(stock / "restart", folder, dirs_exist_ok=True)
    kept = rng.choice([p for p in sorted(folder.iterdir()) if p.suffix == ".npz"])
    kept.write_bytes(damaged_bytes(rng, kept.read_bytes()))
    scene = folder / "blocks.toml" if "checkpoint" in kept.name else folder / "calibrate.toml"
    command = "dem-run" if "checkpoint" in kept.name else "calibrate"
    output = folder / (kept.name.split(".")[0] + ".nc")
    call(command, scene, "-o", output, "--restart", "--json", "-q", seconds=3.0)


def curves(rng: random.Random, stock: Path, folder: Path) -> None:
    shutil.copy(stock / "scenes" / "calibrate.toml", folder / "calibrate.toml")
    data = (stock / "curves.csv").read_bytes()
    if rng.random() < 0.6:
        text = data.decode()
        for _ in range(rng.choice([1, 2, 3])):
            old, new = rng.choice([(",", ";"), (",", "\t"), (".", ","), ("\n", "\r\n"), ("\n", "\n\n"), ("e-", "E-"), ("0", ""),
                                   (",", ", "), ("-", "−"), ("\n", ",\n"), (",", ",,"), ("1", "nan"), ("2", "x")])  # fmt: skip
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
            _change_map(rng, tree)
        data = json.dumps(tree).encode()
    else:
        data = damaged_bytes(rng, json.dumps(tree).encode())
    (folder / "map.geojson").write_bytes(data)
    run_scene(folder / "map.toml", "blocks")


def _change_map(rng: random.Random, tree: Any) -> None:
    feature = rng.choice(tree["features"])
    ring = ((feature.get("geometry") or {}).get("coordinates") or [[]])[0]
    other = rng.choice([None, [], {}, "x", 1e300, [[]], [["a", "b"]], True, [1e9, 1e9], [None, 0.0]])
    chance = rng.random()
    if chance < 0.5 and isinstance(ring, list) and len(ring) > 1:
        k, by = rng.randrange(len(ring)), rng.choice([1e-9, 1e-4, 1e-2, 0.3, 5.0])
        match rng.randrange(5):
            case 0 if isinstance(ring[k], list) and len(ring[k]) == 2 and all(isinstance(v, float) for v in ring[k]):
                ring[k] = [ring[k][0] + rng.uniform(-by, by), ring[k][1] + rng.uniform(-by, by)]
            case 1:
                ring.insert(k, ring[k])
            case 2:
                del ring[k]
            case 3:
                ring.reverse()
            case _:
                ring[k] = other
    elif chance < 0.6:
        tree["features"].append(json.loads(json.dumps(feature)))
    elif chance < 0.7:
        tree["features"].remove(feature) if len(tree["features"]) > 1 else None
    elif chance < 0.85:
        feature["geometry"] = other
    else:
        (feature.get("geometry") or feature)[rng.choice(["type", "coordinates", "properties"])] = other


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


# --- what is damaged: small inputs of every kind, made once by the commands themselves --------------------------------


def make_stock(stock: Path) -> None:
    """Scenes, artifacts, checkpoints, curves, a map and meshes, small enough that each try takes milliseconds."""
    import hypothesis  # noqa: F401  (conftest sets its profile)

    from graben.schemas.kinds import SCENES
    from graben.schemas.template import template
    from tests.conftest import PIPELINES, SMALL_BED, SMALL_BLOCKS, settings

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

    def made(*arguments: Any) -> None:
        answer = call(*arguments, seconds=600)
        if answer.code:
            raise RuntimeError(f"{arguments}: {answer.said}")

    art = stock / "artifacts"
    made("dem-run", stock / "scenes/blocks.toml", "-o", art / "blocks.nc", "-q")
    made("dem-run", stock / "scenes/particles.toml", "-o", art / "bed.nc", "-q")
    made("homogenize", art / "blocks.nc", "--radius", "1 m", "-o", art / "curves.nc", "-q")
    made("wear-estimate", stock / "scenes/wear.toml", "-o", art / "wear.nc", "-q")
    quick = settings(["swarm.starts=1", "swarm.particles=6", "swarm.generations=4", "refine.best=1", "refine.iterations=3"])
    made("calibrate", stock / "scenes/calibrate.toml", *quick, "-o", art / "calibration.nc", "-q")
    for path in [p for p in art.iterdir() if p.suffix != ".nc"]:
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    shutil.copy(PIPELINES / "upscaling/reference/udec_voronoi_granite_fit.csv", stock / "curves.csv")
    _make_restart(stock)
    _make_map(stock)
    _make_meshes(stock)


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
    for kind, slow in (("blocks", "speed = \"5 mm/s\""), ("calibrate", "")):
        text = (stock / "scenes" / f"{kind}.toml").read_text(encoding="utf-8")
        (folder / f"{kind}.toml").write_text(text.replace("fidelity = \"draft\"", "fidelity = \"standard\""), encoding="utf-8")
        command = "dem-run" if kind == "blocks" else "calibrate"
        for seconds in (1.0, 2.0, 3.0, 5.0, 8.0, 13.0):
            call(command, folder / f"{kind}.toml", "-o", folder / f"{kind}.nc", "-q", seconds=seconds)
            if any(p.suffix == ".npz" and p.name.startswith(kind) for p in folder.iterdir()):
                break
            for path in folder.glob(f"{kind}.*"):
                if path.suffix not in (".toml", ".npz"):
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


def _make_map(stock: Path) -> None:
    """Three by three rectangles of 1 m, and a scene that loads them for a moment."""
    squares = [
        [[i, j], [i + 1.0, j], [i + 1.0, j + 1.0], [i, j + 1.0], [i, j]] for i in (0.0, 1.0, 2.0) for j in (0.0, 1.0, 2.0)
    ]
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
        '[stepping]\ngoal = "end"\nend = "1 s"\nfirst = "1 s"\nlargest = "1 s"\nsmallest = "0.1 s"\nsave_every = "1 s"\n'
    )


# --- the tries, shared out over processes that may die ----------------------------------------------------------------


def one(family: str, seed: int, number: int, stock: Path, keep: bool = False) -> None:
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        FAMILIES[family][0](random.Random(f"{family}:{seed}:{number}"), stock, folder)
    except BaseException:
        if keep:
            kept = ROOT / "results/fuzz" / f"{family}-{seed}-{number}"
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(folder, kept)
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def worker(pipe: Any, stock: Path) -> None:
    """Take tries from the pipe, and say how each ended."""
    import faulthandler

    faulthandler.enable()
    while (task := pipe.recv()) is not None:
        try:
            one(*task, stock, keep=True)
            pipe.send(None)
        except BaseException as error:
            pipe.send(f"{type(error).__name__}: {error}")


def run(families: list[str], tries: int, seconds: float, seed: int, processes: int) -> tuple[Counter[str], list[Finding]]:
    stock = Path(tempfile.mkdtemp(prefix="fuzz-stock-"))
    context = multiprocessing.get_context("spawn")
    total = sum(FAMILIES[f][1] for f in families)
    tasks = [(f, seed, k) for f in families for k in range(round(tries * FAMILIES[f][1] / total))]
    random.Random(seed).shuffle(tasks)
    counted: Counter[str] = Counter()
    findings: list[Finding] = []
    end = time.monotonic() + seconds
    lanes: list[dict[str, Any]] = [{} for _ in range(processes)]
    try:
        make_stock(stock / "stock")
        while True:
            for lane in lanes:
                _turn(lane, context, stock / "stock", tasks if time.monotonic() < end else [], counted, findings)
            if not any(lane.get("task") for lane in lanes):
                return counted, findings
            multiprocessing.connection.wait([lane["pipe"] for lane in lanes if lane.get("task")], timeout=1.0)
    finally:
        for lane in lanes:
            if lane.get("process"):
                lane["process"].kill()
        shutil.rmtree(stock, ignore_errors=True)


def _turn(lane: dict[str, Any], context: Any, stock: Path, tasks: list[Any], counted: Counter[str],
          findings: list[Finding]) -> None:  # fmt: skip
    """Take the answer of a lane, if there is one, and give it the next try."""
    if lane.get("task"):
        what = ""
        try:
            if lane["pipe"].poll():
                what = lane["pipe"].recv() or "fine"
            elif not lane["process"].is_alive():
                what = f"the process died with code {lane['process'].exitcode}"
            elif time.monotonic() - lane["since"] > HUNG_S:
                what = f"no end after {HUNG_S:g} s"
        except EOFError:
            lane["process"].join()
            what = f"the process died with code {lane['process'].exitcode}"
        if not what:
            return
        counted[lane["task"][0]] += 1
        if what != "fine":
            findings.append(Finding(*lane["task"], what))
            print(f"{findings[-1].name}  {what[:600]}", flush=True)
            if what.startswith(("the process", "no end")):
                lane["process"].kill()
                lane["process"] = None
        lane["task"] = None
    if tasks:
        if not lane.get("process"):
            lane["pipe"], there = context.Pipe()
            lane["process"] = context.Process(target=worker, args=(there, stock), daemon=True)
            lane["process"].start()
            there.close()
        lane["task"], lane["since"] = tasks.pop(), time.monotonic()
        lane["pipe"].send(lane["task"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("families", nargs="*", choices=[[], *FAMILIES], default=[])
    parser.add_argument("--tries", type=int, default=20_000)
    parser.add_argument("--seconds", type=float, default=1200.0)
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--again", metavar="FAMILY:SEED:NUMBER")
    asked = parser.parse_args()
    (ROOT / "results/fuzz").mkdir(parents=True, exist_ok=True)
    if asked.again:
        family, seed, number = asked.again.split(":")
        stock = Path(tempfile.mkdtemp(prefix="fuzz-stock-"))
        make_stock(stock / "stock")
        one(family, int(seed), int(number), stock / "stock", keep=True)
        print("fine")
        return 0
    counted, findings = run(list(asked.families) or list(FAMILIES), asked.tries, asked.seconds, asked.seed, asked.processes)
    print(f"seed {asked.seed}: {sum(counted.values())} tries ({dict(counted)}), {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
