"""The rule of docs/architecture.md: cli and api -> stages -> mechanics, stages -> schemas; all -> declared."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "graben"
ALLOWED = {
    "cli": {"cli", "stages", "schemas", "declared"},  # schemas only for faults and templates, never for physics
    "api": {"api", "stages", "schemas", "mechanics", "declared"},
    "stages": {"stages", "schemas", "mechanics", "declared"},
    "schemas": {"schemas", "declared"},
    "mechanics": {"mechanics", "declared"},
    "declared": {"declared"},
}
# What mechanics may use beside itself and the standard library (cmaes is optional, imported where it is used).
MECHANICS_LIBRARIES = {"numpy", "scipy", "numba", "llvmlite", "cmaes", "shapely"}
STRANGERS = {"blocks", "particles", "averaging", "wear"}
# Folders of the block model; each imports only those before it.
BLOCKS = ("shape", "contact", "zones", "engine", "record", "loading")


def imported(path: Path) -> set[str]:
    """Dotted names that a file imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def files(room: str) -> list[Path]:
    found = sorted((PACKAGE / room).rglob("*.py"))
    assert found, room
    return found


@pytest.mark.parametrize("room", ALLOWED)
def test_imports_run_one_way(room):
    for path in files(room):
        for name in imported(path):
            parts = name.split(".")
            if parts[0] == "graben" and len(parts) > 1 and parts[1] in ALLOWED:
                assert parts[1] in ALLOWED[room], f"{path} imports {name}"


def test_mechanics_knows_no_file_no_click_no_xarray_no_scene():
    for path in files("mechanics"):
        for name in imported(path):
            top = name.split(".")[0]
            if top and top != "graben" and top not in sys.stdlib_module_names:
                assert top in MECHANICS_LIBRARIES, f"{path} imports {name}"


def test_what_is_declared_needs_no_library():
    for path in files("declared"):
        for name in imported(path):
            assert name.split(".")[0] in {"graben", "", *sys.stdlib_module_names}, f"{path} imports {name}"


@pytest.mark.parametrize("room", sorted(STRANGERS))
def test_rooms_of_mechanics_do_not_import_one_another(room):
    for path in files(f"mechanics/{room}"):
        for name in imported(path):
            parts = name.split(".")
            if parts[:2] == ["graben", "mechanics"] and len(parts) > 2:
                assert parts[2] not in STRANGERS - {room}, f"{path} imports {name}"


def test_the_block_model_is_built_from_the_ground_up():
    for k, room in enumerate(BLOCKS):
        for path in files(f"mechanics/blocks/{room}"):
            for name in imported(path):
                parts = name.split(".")
                if parts[:3] == ["graben", "mechanics", "blocks"] and len(parts) > 3:
                    assert parts[3] in BLOCKS[: k + 1], f"{path} imports {name}"


def test_commands_import_nothing_heavy_until_they_run():
    commands = [f"graben.cli.{p.stem}" for p in files("cli") if p.stem != "__init__"]
    script = (
        "import sys, importlib\n"
        f"for name in {commands!r}: importlib.import_module(name)\n"
        "heavy = {'numpy','scipy','numba','xarray','pyvista','matplotlib','pydantic','pint','rich','meshio'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
