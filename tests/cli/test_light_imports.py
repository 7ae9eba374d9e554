"""No command imports a library that takes long to import and that it has no use for."""

import json
import subprocess
import sys

import pytest

from tests.conftest import SMALL_BED, SMALL_BLOCKS, command, settings

# Each took 0.1 to 0.6 s of the start of a run.
HEAVY = {
    "dask", "distributed", "matplotlib", "meshio", "pandas", "pint", "pyvista", "scipy.optimize", "scipy.signal",
    "scipy.stats", "vtkmodules", "xarray",
}  # fmt: skip
# Where numpy and netCDF4 are enough.
KERNELS = {"llvmlite", "numba", "scipy.sparse", "scipy.spatial", "shapely"}

SCRIPT = """
import json, sys
from importlib import import_module
name, *sys.argv[1:] = sys.argv[1:]
try:
    import_module(f"graben.cli.{name}").main()
except SystemExit as ended:
    assert not ended.code, ended.code
print(json.dumps(sorted(sys.modules)))
"""


def imported(name, *arguments):
    """Modules that a whole run of a command imports, the writing of its files included."""
    call = [sys.executable, "-c", SCRIPT, name, *map(str, arguments)]
    ended = subprocess.run(call, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return set(json.loads(ended.stdout.splitlines()[-1]))


def scene(kind, folder):
    path = folder / f"{kind}.toml"
    path.write_text(command("scene", kind).output)
    return path


@pytest.mark.parametrize(
    ("name", "kind", "small"),
    [
        ("dem_run", "blocks", SMALL_BLOCKS),
        ("dem_run", "particles", SMALL_BED),
        ("fem_run", "fem", ["fidelity=draft", 'stepping.end="1 s"']),
        ("scratch", "scratch", ["fidelity=draft", 'tip.path="0 um"', 'tip.depth="1 um"']),
    ],
)
def test_a_run_imports_no_library_for_pictures_tables_or_units(name, kind, small, tmp_path):
    found = imported(name, scene(kind, tmp_path), *settings(small), "-o", tmp_path / "out.nc", "-q")
    assert found & HEAVY == set()


def test_a_wear_rate_needs_no_kernels(tmp_path):
    found = imported("wear_estimate", scene("wear", tmp_path), "-o", tmp_path / "out.nc", "-q")
    assert found & (HEAVY | KERNELS) == set()


def test_averages_need_no_kernels(small_blocks, tmp_path):
    found = imported("homogenize", small_blocks, "--radius", "1 m", "-o", tmp_path / "out.nc", "-q")
    assert found & (HEAVY | {"numba", "llvmlite", "shapely"}) == set()


def test_samples_of_averages_are_as_light(small_blocks, tmp_path):
    few = settings(['samples.radii=["0.8 m", "1 m"]', "samples.grid=1"])
    found = imported("rev_study", small_blocks, *few, "-o", tmp_path / "out.nc", "-q")
    assert found & HEAVY == set()


def test_a_fit_needs_filters_at_its_end_and_nothing_else(small_curves, tmp_path):
    few = ["fidelity=draft", "swarm.particles=4", "swarm.generations=1", "swarm.starts=1", "refine.iterations=1"]
    arguments = [scene("calibrate", tmp_path), small_curves, *settings(few), "-o", tmp_path / "out.nc", "-q"]
    found = imported("calibrate", *arguments)
    assert found & (HEAVY - {"scipy.optimize", "scipy.signal", "scipy.stats"}) == set()


@pytest.mark.parametrize("name", ["main", "dem_run", "fem_run", "calibrate", "scratch"])
def test_help_imports_nothing_but_the_command_line(name):
    script = f"import sys, graben.cli.{name}; print(*sys.modules)"
    found = set(subprocess.run([sys.executable, "-c", script], capture_output=True, text=True).stdout.split())
    assert found & (HEAVY | KERNELS | {"numpy", "pydantic"}) == set()
