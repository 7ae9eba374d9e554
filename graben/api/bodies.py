"""Blocks and beds of spheres in arrays: tessellations, models that can be advanced, beds at rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from graben.api.scenes import scene as checked
from graben.api.units import si
from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.shape.tessellation import Tessellation
from graben.mechanics.blocks.shape.tessellation import voronoi_blocks as tessellate
from graben.mechanics.particles.bed import Bed
from graben.schemas.scene import Given


def voronoi_blocks(
    outline: ArrayLike, edge: float | str, seed: int = 0, *, passes: int = 4, shortest_edge: float | str | None = None
) -> Tessellation:
    """Random blocks of one size that fill a polygon.

    Parameters
    ----------
    outline : (c, 2) corners in order, m
    edge : nominal edge, m; a block has 0.955 times its square as mean area
    seed : the same seed gives the same blocks
    passes : of Lloyd's algorithm, which even out the blocks
    shortest_edge : m; shorter edges are collapsed. 0.48 of the edge unless given

    Returns
    -------
    a tessellation with ``points`` (n, 2) m, the corners of each block (``rings()``, counter-clockwise numbers of
    points) and ``statistics()``

    Raises
    ------
    BadInput : an outline that crosses itself, or is too small for the edge
    """
    shortest = None if shortest_edge is None else si(shortest_edge, "m", "shortest_edge")
    try:
        return tessellate(np.array(outline, dtype=float), si(edge, "m", "edge"), seed, passes, shortest)
    except Refused as error:
        raise BadInput(Fault("", "outline", "", str(error), True)) from None


@dataclass(frozen=True)
class Blocks:
    """Blocks of a scene before anything has moved.

    Attributes
    ----------
    tessellation : the blocks; places count from `origin`
    model : mechanics that can be advanced: ``hold`` vertices, ``press`` edges, ``advance`` steps, then
        ``zone_stress()``, ``contacts()``, ``energies()``
    origin : (2,) m
    """

    tessellation: Tessellation
    model: BlockModel
    origin: NDArray[np.float64]


def block_model(scene: Given, set: Mapping[str, Any] | None = None, **keys: Any) -> Blocks:
    """Tessellation and model of a scene of kind "blocks"; arguments as in `graben.scene`.

    Raises
    ------
    BadInput : every fault of the scene
    """
    from graben.stages.blocks.stage import prepare

    prepared = prepare(_of_kind("blocks", scene, set, keys))
    return Blocks(prepared.ground.blocks, prepared.model, prepared.ground.origin)


def bed(
    scene: Given,
    set: Mapping[str, Any] | None = None,
    *,
    progress: Callable[[float, str], None] | None = None,
    **keys: Any,
) -> Bed:
    """A bed of spheres, poured, settled, shaken if asked, pressed and quenched, from a scene of kind "particles".

    Arguments as in `graben.scene`; of several beds the first.

    Returns
    -------
    a bed with ``position`` (n, 3) m, ``radius`` (n,), ``kind`` (n,) class, ``floor_force`` (n,) N, contacts ``pair``
    (c, 2), ``normal`` (c, 3), ``push`` (c,) N, ``solid_fraction``, ``states`` by phase, and error measures

    Raises
    ------
    BadInput : every fault of the scene
    NumericsFailed : the bed blew up or did not come to rest
    """
    from graben.mechanics.particles.bed import make_bed
    from graben.stages.particles.stage import prepare
    from graben.stages.shared.record import silent

    model = _of_kind("particles", scene, set, keys)
    law, recipe, _ = prepare(model)
    return make_bed(law, recipe, model.seed, progress or silent)


def _of_kind(kind: str, scene: Given, set: Mapping[str, Any] | None, keys: Mapping[str, Any]) -> Any:
    model = checked(scene, set, **keys)
    if model.kind != kind:
        raise BadInput(Fault(str(model.source.path), "kind", repr(model.kind), repr(kind)))
    return model
