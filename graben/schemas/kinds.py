"""The register of scene kinds and artifact kinds; each is imported only when asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any

SCENES = {
    "blocks": "graben.schemas.scenes.blocks:BlocksScene",
    "particles": "graben.schemas.scenes.particles:ParticlesScene",
    "rev-study": "graben.schemas.scenes.rev_study:RevStudyScene",
    "calibrate": "graben.schemas.scenes.calibrate:CalibrateScene",
    "fem": "graben.schemas.scenes.fem:FemScene",
    "scratch": "graben.schemas.scenes.scratch:ScratchScene",
    "wear": "graben.schemas.scenes.wear:WearScene",
}
"""Scene kind -> its pydantic model."""

LAYOUTS = {
    "blocks": "graben.schemas.layouts.blocks:LAYOUT",
    "particles": "graben.schemas.layouts.particles:LAYOUT",
    "curves": "graben.schemas.layouts.curves:LAYOUT",
    "rev-study": "graben.schemas.layouts.rev_study:LAYOUT",
    "calibration": "graben.schemas.layouts.calibration:LAYOUT",
    "fem": "graben.schemas.layouts.fem:LAYOUT",
    "scratch": "graben.schemas.layouts.scratch:LAYOUT",
    "wear": "graben.schemas.layouts.wear:LAYOUT",
    "tradeoff": "graben.schemas.layouts.tradeoff:LAYOUT",
}
"""Artifact kind -> its layout."""


def _load(address: str) -> Any:
    module, name = address.split(":")
    return getattr(import_module(module), name)


def scene_model(kind: str) -> Any:
    """The pydantic model of a scene kind."""
    return _load(SCENES[kind])


def layout(kind: str) -> Any:
    """The layout of an artifact kind."""
    return _load(LAYOUTS[kind])
