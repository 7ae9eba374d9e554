"""How large a fem run will be: elements and saved states, from the scene alone."""

from __future__ import annotations

import math

import numpy as np

from graben.mechanics.meshes.sizing import SizeField
from graben.schemas.scenes.fem import FemScene
from graben.stages.fem_run.mesh import size_field
from graben.stages.shared.estimate import Estimate, tiles, work

# The factorisation of a plane body fills in with its size: some 4 kB an element at this many.
_MOST_ELEMENTS = 400_000
_ELEMENT_BYTES = 4000.0
_STATE_BYTES = 800.0


def sizes_of(scene: FemScene, elements: int | None = None) -> list[Estimate]:
    """Estimates of a scene.

    elements : of a mesh that was read; unknown before, and then counted as one
    """
    mesh, stepping = scene.mesh, scene.stepping
    key, value, count = "mesh.file", str(mesh.file), float(elements or 1)
    if mesh.method != "file":
        size = size_field(scene)
        counts = {("mesh.size", f"{mesh.size:g} m"): tiles(_area(scene), size.size)}
        for k, refine in enumerate(mesh.refine):
            counts[f"mesh.refine.{k}.size", f"{refine.size:g} m"] = _near(size, k, math.sqrt(_area(scene)))
        key, value = max(counts, key=lambda name: counts[name])
        count = sum(counts.values())
    states = stepping.end / stepping.save_every
    steps = max(stepping.end / stepping.largest, states)
    return [
        Estimate("elements", count, count * _ELEMENT_BYTES, key, value, _MOST_ELEMENTS),
        Estimate(
            "saved states", states, states * count * _STATE_BYTES, "stepping.save_every", f"{stepping.save_every:g} s"
        ),
        work("element-steps", count, steps, "stepping.end", f"{stepping.end:g} s"),
    ]


def _area(scene: FemScene) -> float:
    """Area of the outline, or of the patches, m2."""
    mesh = scene.mesh
    points = np.array(mesh.outline if mesh.method == "paved" else mesh.corners, dtype=float)
    if mesh.method == "paved":
        return _enclosed(points)
    inside = [patch for patch in mesh.patches if min(patch) >= 0 and max(patch) < len(points)]
    return sum(_enclosed(points[list(patch)]) for patch in inside)


def _enclosed(corners: np.ndarray) -> float:
    x, y = corners.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def _near(size: SizeField, k: int, reach: float) -> float:
    """Elements of a half disc and a strip on one side of a refined segment, as far as it makes elements smaller."""
    near, growth = float(size.near_size[k]), float(size.growth[k])
    if near >= size.size:
        return 0.0
    far = min((size.size - near) / growth, reach) if growth > 0.0 else reach
    length = min(float(np.linalg.norm(size.segments[k, 1] - size.segments[k, 0])), 2.0 * reach)
    last = near + growth * far
    strip = length / near * far / last
    if growth * far < 1e-3 * near:
        return strip + 0.5 * math.pi * tiles(far * far, near)
    return strip + math.pi * (math.log(last / near) + near / last - 1.0) / growth / growth
