"""Start-up: time from the command to its first step, warm and cold, per stage; JSON lines on stdout.

Each run is a process of its own, on a small scene. Warm: all kernels are in the cache. Cold: the cache is empty.
The first step is the first return of the function that the table below names, so compilation and loading of kernels
count. `overhead` is the share of a run's CPU outside its compiled loop; `imports_s` is what -X importtime adds up to.

Options: --stages NAME ... (all), --rounds N (5, warm runs; the median is told), --cold (one cold run of each stage
that has kernels, some two minutes of CPU), --overhead (a whole REV run at draft fidelity).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple


class Stage(NamedTuple):
    """A command, its arguments (KIND.toml is a template), its settings, and where its first step is."""

    command: str
    arguments: tuple[str, ...]
    settings: tuple[str, ...]
    step: str
    kernels: bool = True


SMALL = ("fidelity=draft", 'domain.width="6 m"', 'domain.height="6 m"', "numerics.steps=2000", "loading.states=11")
BED = ("fidelity=draft", 'box.width="0.6 mm"', 'box.depth="0.3 mm"')
FIT = (
    "fidelity=draft", "swarm.particles=4", "swarm.generations=1", "swarm.starts=1", "refine.best=1",
    "refine.iterations=1",
)  # fmt: skip
SAMPLES = ('samples.radii=["1 m", "2 m"]', "samples.grid=1", "processes=1")
STAGES = {
    "blocks": Stage("dem_run", ("blocks.toml",), SMALL, "mechanics.blocks.engine.model:BlockModel.advance"),
    "particles": Stage("dem_run", ("particles.toml",), BED, "mechanics.particles.assembly:Assembly.advance"),
    "homogenize": Stage(
        "homogenize", ("run.nc", "--radius", "2 m"), (), "stages.homogenize.stage:average", kernels=False
    ),
    "rev-study": Stage("rev_study", ("run.nc",), SAMPLES, "stages.rev_study.stage:average", kernels=False),
    "calibrate": Stage(
        "calibrate", ("calibrate.toml", "curves.nc"), FIT, "mechanics.fitting.curves:CurveFit.predict"
    ),
    "fem": Stage("fem_run", ("fem.toml",), ("fidelity=draft", 'stepping.end="1 s"'), "mechanics.fem.body:assemble"),
    "scratch": Stage("scratch", ("scratch.toml",), ("fidelity=draft", 'tip.path="5 um"'),
                     "mechanics.scratch.body:Body.advance"),
    "wear": Stage("wear_estimate", ("wear.toml",), (), "stages.wear_estimate.stage:prepare", kernels=False),
}  # fmt: skip
LIBRARIES = (
    "numpy", "numba", "scipy", "pydantic", "shapely", "netCDF4", "xarray", "pandas", "pint", "pyvista", "graben",
)  # fmt: skip


def probe(name: str, arguments: list[str]) -> None:
    """In a process of its own: run the command, and tell when its first step was over, and what steps took in all."""
    stage, told = STAGES[name], dict[str, float]()
    module, path = stage.step.split(":")
    holder: Any = import_module(f"graben.{module}")
    *owners, attribute = path.split(".")
    for owner in owners:
        holder = getattr(holder, owner)
    work: Callable[..., Any] = getattr(holder, attribute)

    def watched(*given: Any, **named: Any) -> Any:
        begun = time.process_time()
        try:
            return work(*given, **named)
        finally:
            told.setdefault("first_step_cpu_s", time.process_time())
            told.setdefault("first_step_s", time.time() - float(os.environ["BEGUN"]))
            told["steps_cpu_s"] = told.get("steps_cpu_s", 0.0) + time.process_time() - begun

    setattr(holder, attribute, watched)
    sys.argv = [stage.command, *arguments]
    try:
        import_module(f"graben.cli.{stage.command}").main()
    except SystemExit as ended:
        if ended.code:
            raise
    told |= {"cpu_s": time.process_time(), "wall_s": time.time() - float(os.environ["BEGUN"])}
    print(json.dumps(told))


def arguments_of(name: str) -> list[str]:
    stage = STAGES[name]
    settings = [part for setting in stage.settings for part in ("--set", setting)]
    return [*stage.arguments, *settings, "-o", f"{name}.out.nc", "--overwrite", "-q"]


def measure(
    name: str, folder: Path, cache: Path | None = None, arguments: list[str] | None = None
) -> dict[str, float]:
    """One run; cache : where kernels are looked for instead of the user's own folder."""
    call = [sys.executable, __file__, "--probe", name, *(arguments or arguments_of(name))]
    variables = {**os.environ, "BEGUN": repr(time.time()), **({"XDG_CACHE_HOME": str(cache)} if cache else {})}
    ended = subprocess.run(call, cwd=folder, env=variables, capture_output=True, text=True)
    if ended.returncode:
        raise RuntimeError(f"{name}: {ended.stderr}")
    return json.loads(ended.stdout.splitlines()[-1])


def imports(name: str, folder: Path) -> dict[str, float]:
    """Seconds of imports of one warm run, in all and in the modules of some libraries."""
    script = f"import sys; from graben.cli.{STAGES[name].command} import main; main(sys.argv[1:])"
    call = [sys.executable, "-X", "importtime", "-c", script, *arguments_of(name)]
    lines = subprocess.run(call, cwd=folder, capture_output=True, text=True).stderr.splitlines()
    rows = [line.removeprefix("import time:").split("|") for line in lines if line.startswith("import time:")]
    parsed = [(int(own), int(total), name.strip()) for own, total, name in rows if own.strip().isdigit()]
    found = {"imports_s": round(sum(own for own, _, _ in parsed) / 1e6, 3)}
    for library in LIBRARIES:
        own = sum(t for t, _, n in parsed if n == library or n.startswith(library + "."))
        if own:
            found[f"{library}_s"] = round(own / 1e6, 3)
    return found


def tell(**line: Any) -> None:
    shown = {k: round(v, 3) if isinstance(v, float) else v for k, v in line.items()}
    about = {"load": round(os.getloadavg()[0], 1), "machine": platform.machine(), "python": platform.python_version()}
    print(json.dumps(shown | about), flush=True)


def main() -> None:
    if sys.argv[1:2] == ["--probe"]:
        probe(sys.argv[2], sys.argv[3:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=list(STAGES))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--overhead", action="store_true")
    options = parser.parse_args()
    from graben.schemas.template import template

    with TemporaryDirectory(prefix="graben-startup-") as name:
        folder = Path(name)
        for kind in ("blocks", "particles", "calibrate", "fem", "scratch", "wear"):
            (folder / f"{kind}.toml").write_text(template(kind))
        measure("blocks", folder)
        (folder / "blocks.out.nc").rename(folder / "run.nc")
        measure("homogenize", folder)
        (folder / "homogenize.out.nc").rename(folder / "curves.nc")
        for stage in options.stages:
            measure(stage, folder)
            runs = [measure(stage, folder) for _ in range(options.rounds)]
            found = {k: median(run[k] for run in runs) for k in runs[0]}
            tell(
                benchmark="startup",
                stage=stage,
                cache="warm",
                rounds=options.rounds,
                **found,
                **imports(stage, folder),
            )
            if options.cold and STAGES[stage].kernels:
                with TemporaryDirectory(prefix="graben-cold-") as cache:
                    tell(benchmark="startup", stage=stage, cache="cold", **measure(stage, folder, Path(cache)))
        if options.overhead:
            for steps in ("fidelity=draft", "fidelity=standard"):
                run = measure(
                    "blocks", folder, None, ["blocks.toml", "--set", steps, "-o", "rev.nc", "--overwrite", "-q"]
                )
                share = 1.0 - run["steps_cpu_s"] / run["cpu_s"]
                tell(benchmark="startup overhead", scene=f"blocks, {steps}", overhead=share, **run)


if __name__ == "__main__":
    main()
