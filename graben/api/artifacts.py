"""Artifacts in Python: datasets of xarray, and where they came from."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graben.schemas.artifact import PARTIAL, read_artifact
from graben.schemas.kinds import LAYOUTS
from graben.schemas.scene import effective_tables

if TYPE_CHECKING:
    import xarray


def open(path: str | Path, *, partial: bool = False) -> xarray.Dataset:
    """An artifact in memory, after every check of the file against its layout.

    Parameters
    ----------
    path : the NetCDF file of a stage
    partial : take also what a failed run kept, with nan where numbers were not finite

    Returns
    -------
    a dataset whose variables bear ``units`` (SI) and ``long_name``

    Raises
    ------
    BadInput : no artifact, damaged, newer than this software, or with faults
    """
    return read_artifact(path, tuple(LAYOUTS), partial=partial)


@dataclass(frozen=True)
class Provenance:
    """Where an artifact came from.

    Attributes
    ----------
    kind : of the artifact; version : of graben that made it; machine : where
    scene : the tables of the scene as run, empty where the stage takes none; scene_text : its TOML
    seed : of everything random, None where nothing is
    inputs : SHA-256 of each input, by its path
    cost : wall_s, cpu_s, peak_memory_bytes and the stage's own figures and error measures
    warnings : what a person should know before trusting the result
    partial : why the run stopped, "" where it did not
    """

    kind: str
    version: str
    machine: str
    scene: dict[str, Any]
    scene_text: str
    seed: int | None
    inputs: dict[str, str]
    cost: dict[str, Any]
    warnings: list[str]
    partial: str = ""


def provenance(artifact: xarray.Dataset | str | Path) -> Provenance:
    """Where an artifact came from and what it cost.

    Parameters
    ----------
    artifact : a dataset of `open`, or the path of its file

    Raises
    ------
    BadInput : as in `open`
    """
    about = (open(artifact, partial=True) if isinstance(artifact, str | Path) else artifact).attrs
    seed = int(about["seed"])
    return Provenance(
        kind=str(about["schema_kind"]),
        version=str(about["software_version"]),
        machine=str(about["machine"]),
        scene=effective_tables(about["scene"]),
        scene_text=str(about["scene"]),
        seed=None if seed < 0 else seed,
        inputs=json.loads(about["inputs"]),
        cost=json.loads(about["cost"]),
        warnings=str(about["warnings"]).splitlines(),
        partial=str(about.get(PARTIAL, "")),
    )
