"""graben: from a scene of discrete rock or sand to numbers an engineer can use.

Public names are imported when they are first used, so that ``import graben`` costs nothing. See docs/python.md.
"""

from __future__ import annotations

__version__ = "0.1.0"

_HOME = {
    "run": "graben.api.stages",
    "homogenize": "graben.api.stages",
    "Result": "graben.api.stages",
    "scene": "graben.api.scenes",
    "check": "graben.api.scenes",
    "open": "graben.api.artifacts",
    "provenance": "graben.api.artifacts",
    "Provenance": "graben.api.artifacts",
    "material": "graben.api.materials",
    "Material": "graben.api.materials",
    "follow": "graben.api.materials",
    "Followed": "graben.api.materials",
    "law": "graben.api.materials",
    "laws": "graben.api.materials",
    "Parameter": "graben.api.materials",
    "fit": "graben.api.fits",
    "Fit": "graben.api.fits",
    "curve": "graben.api.fits",
    "average": "graben.api.averages",
    "Average": "graben.api.averages",
    "voronoi_blocks": "graben.api.bodies",
    "block_model": "graben.api.bodies",
    "Blocks": "graben.api.bodies",
    "bed": "graben.api.bodies",
    "mesh": "graben.api",
    "plane_analysis": "graben.api.plane",
    "PlaneAnalysis": "graben.api.plane",
    "GrabenError": "graben.errors",
    "BadInput": "graben.errors",
    "Fault": "graben.errors",
    "MachineFailed": "graben.errors",
    "NumericsFailed": "graben.errors",
}

TYPE_CHECKING = False  # checkers know it by its name; `typing` costs more to import than all else here
if TYPE_CHECKING:
    from typing import Any

    from graben.api import mesh as mesh
    from graben.api.artifacts import Provenance as Provenance
    from graben.api.artifacts import open as open
    from graben.api.artifacts import provenance as provenance
    from graben.api.averages import Average as Average
    from graben.api.averages import average as average
    from graben.api.bodies import Blocks as Blocks
    from graben.api.bodies import bed as bed
    from graben.api.bodies import block_model as block_model
    from graben.api.bodies import voronoi_blocks as voronoi_blocks
    from graben.api.fits import Fit as Fit
    from graben.api.fits import curve as curve
    from graben.api.fits import fit as fit
    from graben.api.materials import Followed as Followed
    from graben.api.materials import Material as Material
    from graben.api.materials import Parameter as Parameter
    from graben.api.materials import follow as follow
    from graben.api.materials import law as law
    from graben.api.materials import laws as laws
    from graben.api.materials import material as material
    from graben.api.plane import PlaneAnalysis as PlaneAnalysis
    from graben.api.plane import plane_analysis as plane_analysis
    from graben.api.scenes import check as check
    from graben.api.scenes import scene as scene
    from graben.api.stages import Result as Result
    from graben.api.stages import homogenize as homogenize
    from graben.api.stages import run as run
    from graben.errors import BadInput as BadInput
    from graben.errors import Fault as Fault
    from graben.errors import GrabenError as GrabenError
    from graben.errors import MachineFailed as MachineFailed
    from graben.errors import NumericsFailed as NumericsFailed

__all__ = sorted([*_HOME, "__version__"])


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'graben' has no attribute {name!r}")
    from importlib import import_module

    home = import_module(_HOME[name])
    value = import_module("graben.api.mesh") if name == "mesh" else getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
