"""Compile every kernel once: the smallest run of each stage and option that has kernels of its own."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from graben.errors import BadInput, Fault
from graben.mechanics import kernel_cache
from graben.stages.shared.record import Progress, silent
from graben.stages.shared.workers import worker_processes


@dataclass(frozen=True)
class Task:
    """Some kernels: run : uses them, in the empty folder that it is given; about : what for; after : the task that
    makes what it shares with others, so that no two processes compile the same."""

    run: Callable[[Path], Any]
    about: str
    after: str = ""


def _blocks(**keys: Any) -> Callable[[Path], Any]:
    def run(folder: Path) -> None:
        from graben.stages.dem_run.stage import run as dem_run

        small = {
            "domain.width": "4 m", "domain.height": "4 m", "fidelity": "draft", "numerics.steps": 300,
            "loading.states": 4, "loading.speed": "0.5 mm/s", "output.vtk": False,
        }  # fmt: skip
        dem_run({"kind": "blocks"}, folder / "blocks.nc", overrides=small | keys)

    return run


def _particles(sides: str = "periodic", friction: float = 0.0) -> Callable[[Path], Any]:
    def run(folder: Path) -> None:
        from graben.stages.dem_run.stage import run as dem_run

        grains = [{"name": "grains", "diameter": "100 um", "share": 1.0, "density": "2200 kg/m^3"}]
        scene = {
            "kind": "particles", "fidelity": "draft", "grains": grains, "output": {"vtk": False},
            "box": {"width": "0.4 mm", "depth": "0.15 mm", "sides": sides},
            "contact": {"friction": friction, "wall_friction": friction},
        }  # fmt: skip
        dem_run(scene, folder / "bed.nc")

    return run


def _fem(folder: Path) -> None:
    from graben.stages.fem_run.stage import run

    run({"kind": "fem"}, folder / "fem.nc", overrides={"fidelity": "draft", "stepping.end": "1 s"})


def _scratch(points: int) -> Callable[[Path], Any]:
    def run(folder: Path) -> None:
        from graben.stages.scratch.stage import run as scratch

        small = {
            "fidelity": "draft", "numerics.points": points, "tip.path": "0 um", "tip.depth": "0.5 um",
            "specimen.length": "40 um", "specimen.width": "20 um", "tip.start": "20 um", "mesh.draft_factor": 2.0,
        }  # fmt: skip
        scratch({"kind": "scratch"}, folder / "scratch.nc", overrides=small)

    return run


def _calibrate(folder: Path) -> None:
    from graben.stages.calibrate.stage import run

    curve = folder / "curve.csv"
    rows = ["5e5,0,-5e5,-2.5e5,0,0", "5e5,1,-5e5,-2e6,6e-4,-1e-3", "5e5,2,-5e5,-3e6,1.6e-3,-2e-3"]
    head = "confining_stress_pa,time_s,stress_xx_pa,stress_yy_pa,strain_xx,strain_yy"
    curve.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    small = {
        "fidelity": "draft", "swarm.starts": 1, "swarm.particles": 2, "swarm.generations": 1, "refine.best": 1,
        "refine.iterations": 1,
    }  # fmt: skip
    run({"kind": "calibrate"}, folder / "calibration.nc", curves=[curve], overrides=small)


def _points(folder: Path) -> None:
    """A law at a point, as Python and its pictures drive it."""
    import numpy as np

    from graben.mechanics.materials.laws import pack
    from graben.mechanics.materials.point import follow

    par = pack("elastic", {"young_modulus": 1e9, "poisson_ratio": 0.2})
    for control in ("esse", "eeeeee"):
        follow("elastic", par, control, np.zeros((2, len(control))))


TASKS: Mapping[str, Task] = {
    "blocks": Task(_blocks(), "dem-run, elastic blocks"),
    "fem": Task(_fem, "laws, and fem-run"),
    "blocks-yielding": Task(_blocks(**{"rock.zones": "mohr-coulomb"}), "dem-run, blocks whose zones yield", "blocks"),
    "blocks-rigid": Task(_blocks(**{"rock.zones": "rigid"}), "dem-run, rigid blocks", "blocks"),
    "particles": Task(_particles(), "dem-run, smooth grains between sides that repeat"),
    "particles-rubbing": Task(_particles("periodic", 0.5), "dem-run, grains with friction", "particles"),
    "particles-walls": Task(_particles("walls"), "dem-run, smooth grains between walls", "particles"),
    "particles-rubbing-walls": Task(_particles("walls", 0.5), "dem-run, friction and walls", "particles-rubbing"),
    "points": Task(_points, "laws at a point", "fem"),
    "calibrate": Task(_calibrate, "calibrate, and the fits of rev-study", "points"),
    "scratch": Task(_scratch(1), "scratch", "fem"),
    "scratch-eight": Task(_scratch(8), "scratch, eight points an element", "scratch"),
}


def run(processes: int = 0, *, progress: Progress = silent) -> dict[str, Any]:
    """Compile every kernel that the user's cache lacks.

    processes : worker processes; 0 for one a core

    Returns
    -------
    headline numbers: the folder, and for each task how many kernels were compiled, how many were there, and seconds

    Raises
    ------
    BadInput : there is no folder that could keep kernels
    """
    folder = kernel_cache.folder()
    if folder is None:
        expected = "a folder that is yours to write and closed to others, such as ~/.cache"
        raise BadInput(Fault("", "XDG_CACHE_HOME", repr(os.environ.get("XDG_CACHE_HOME", "")), expected))
    begun = time.monotonic()
    done: dict[str, dict[str, Any]] = {}
    waiting, running = dict(TASKS), dict[Future[Any], str]()
    with worker_processes(min(processes or os.cpu_count() or 1, len(TASKS)), "spawn") as pool:
        while len(done) < len(TASKS):
            for name in [n for n, task in waiting.items() if not task.after or task.after in done]:
                running[pool.submit(compile_for, name)] = name
                del waiting[name]
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                name = running.pop(future)
                done[name] = future.result()
                progress(len(done) / len(TASKS), TASKS[name].about)
    return {
        "folder": str(folder),
        "tasks": [{"task": name, **done[name]} for name in TASKS],
        "compiled": sum(row["compiled"] for row in done.values()),
        "wall_s": round(time.monotonic() - begun, 1),
        "cpu_s": round(sum(row["cpu_s"] for row in done.values()), 1),
    }


def compile_for(name: str) -> dict[str, Any]:
    """One task in this process: kernels compiled and found, and seconds."""
    before, wall, cpu = set(kernel_cache.used), time.monotonic(), time.process_time()
    with TemporaryDirectory(prefix="graben-warm-") as folder:
        TASKS[name].run(Path(folder))
    fresh = [compiled for file, compiled in kernel_cache.used.items() if file not in before]
    return {
        "compiled": sum(fresh),
        "found": len(fresh) - sum(fresh),
        "wall_s": round(time.monotonic() - wall, 1),
        "cpu_s": round(time.process_time() - cpu, 1),
    }


def listed() -> dict[str, Any]:
    """What the cache holds, kernels of all versions and installations of this user, and what the tasks are for."""
    folder = kernel_cache.folder()
    files = [] if folder is None else [file.stat().st_size for file in folder.glob("*.nbc")]
    return {
        "folder": str(folder),
        "kernels": len(files),
        "megabytes": round(sum(files) / 1e6, 1),
        "tasks": {name: task.about for name, task in TASKS.items()},
    }


def forget() -> dict[str, Any]:
    """Remove all kernels of this user, those of other versions too."""
    folder = kernel_cache.folder()
    files = [] if folder is None else list(folder.glob("*.nbc"))
    for file in files:
        file.unlink(missing_ok=True)
    return {"folder": str(folder), "removed": len(files)}
