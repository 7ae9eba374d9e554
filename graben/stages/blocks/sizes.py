"""How large a run of blocks will be: blocks, zones, saved states and steps, from the scene alone."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from graben.schemas.scenes.blocks import BlocksScene, Tessellation
from graben.stages.shared.estimate import Estimate, tiles, work
from graben.stages.shared.fidelity import setting

_VORONOI_AREA = 0.955  # mean area of a Voronoi block over its edge squared
_ZONES = 4  # of a block that has its corners only
_BLOCK_BYTES = 4000.0  # model, contacts and candidates
_STATE_BYTES = 600.0  # of a block with four zones in one saved state


def steps_of(scene: BlocksScene, blocks: float, outline: np.ndarray | None = None) -> int:
    """Steps of loading: those of the scene, or those of its fidelity and no fewer than inertia allows.

    Scaled masses make the wave cross a block in about a step, so the inertial number of a compression by the strain
    e of n blocks along its height is e n sqrt(E / confinement) / steps: a number of steps that is quasi-static at
    1 MPa is not at 0.1 MPa.

    Parameters
    ----------
    blocks : their number, estimated or counted
    outline : (n, 2) m, of the blocks where they are known: a map brings its own
    """
    rule = setting(scene, "numerics.steps")
    if isinstance(rule, int):
        return rule
    if scene.programme is not None:
        return int(rule.steps)
    loading, corners = scene.loading, np.array(scene.domain.corners) if outline is None else outline
    width, height = np.ptp(corners, axis=0)
    fastest = max(abs(v) for _, v in loading.speed_course or ((0.0, loading.speed),))
    strain = fastest * loading.duration / height
    along = math.sqrt(blocks * height / width)
    lowest = min(pressure for _, pressure in loading.confining_course or ((0.0, loading.confining_pressure),))
    stretch = strain * along * math.sqrt(scene.rock.young / lowest)
    return max(rule.steps, min(math.ceil(stretch / rule.inertia), rule.most * rule.steps))


def sizes_of(scene: BlocksScene) -> list[Estimate]:
    """Estimates of a scene; the blocks of a file are not known before it is read, and count as one."""
    t, corners = scene.tessellation, np.array(scene.domain.corners)
    edges = corners * np.roll(corners, -1, axis=0)[:, ::-1]
    area = 0.5 * abs(float((edges[:, 0] - edges[:, 1]).sum()))
    blocks, key, value = 1.0, "tessellation.file", str(t.file)
    if t.method == "voronoi":
        blocks, key, value = tiles(area / _VORONOI_AREA, t.edge), "tessellation.edge", f"{t.edge:g} m"
    elif t.method == "joint-sets":
        blocks, key = _between_joints(t, corners, area), "tessellation.sets"
        value = "spacing " + ", ".join(f"{s.spacing:g} m" for s in t.sets)
    steps = steps_of(scene, blocks)
    zones = _ZONES * blocks
    if t.zone_edge is not None and tiles(area, t.zone_edge) > zones:
        zones, key, value = tiles(area, t.zone_edge), "tessellation.zone_edge", f"{t.zone_edge:g} m"
    if scene.programme is None:
        states, states_key = float(scene.loading.states), "loading.states"
        states_value = str(scene.loading.states)
    else:
        states, states_key = scene.programme.end / scene.programme.save_every, "programme.save_every"
        states_value = f"{scene.programme.save_every:g} s"
    stored = min(states, float(steps)) * zones / _ZONES * _STATE_BYTES
    return [
        Estimate("blocks", blocks, 0.0, key, value),
        Estimate("zones", zones, zones / _ZONES * _BLOCK_BYTES, key, value),
        Estimate("saved states", states, stored, states_key, states_value),
        work("zone-steps", zones, steps, "numerics.steps", str(steps)),
    ]


def _between_joints(t: Tessellation, corners: np.ndarray, area: float) -> float:
    """Blocks between straight joints: one, and one more for every joint and for every crossing of two."""
    blocks = 1.0
    for s in t.sets:
        across = np.ptp(corners @ np.array([-math.sin(s.dip), math.cos(s.dip)]))
        blocks += s.persistence * float(across) / s.spacing
    for a, b in combinations(t.sets, 2):
        crossings = abs(math.sin(a.dip - b.dip)) * area / a.spacing / b.spacing
        blocks += a.persistence * b.persistence * crossings
    return blocks
