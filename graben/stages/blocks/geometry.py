"""The blocks of a scene: outline, map or joints read, checked, and laid out in coordinates counted from beside them.

Nothing here needs a model, so a scene's geometry can be checked without one.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.shape import coverage
from graben.mechanics.blocks.shape.joint_sets import JointSet, cut_by_sets
from graben.mechanics.blocks.shape.mending import mend
from graben.mechanics.blocks.shape.rectangle import rectangle_sides
from graben.mechanics.blocks.shape.tessellation import Tessellation, voronoi_blocks, without
from graben.mechanics.plane.local_frame import local_origin
from graben.mechanics.plane.polygons import signed_area
from graben.mechanics.plane.rings import refuse_crossing, turning_corners
from graben.schemas.polygon_file import Polygons
from graben.schemas.scenes.blocks import BlocksScene
from graben.stages.blocks.extent import extent_of, map_of
from graben.stages.blocks.holes import taken_by_holes

_log = logging.getLogger(__name__)

# Slivers of given or cut blocks are mended below this share of tessellation.edge.
_MENDED = 0.1
# A joint of a map that turns by more is worth a warning [rad].
_WARN_TURN = np.radians(1.0)
# So does a larger share of the area in blocks that joined their neighbours.
_WARN_AREA = 0.05
_MOST_FAULTS = 10

# Arrays of the artifact that are places; all others are differences of places, or no lengths.
_PLACES = ("vertex_position", "contact_position", "outline")


@dataclass(frozen=True)
class Ground:
    """Blocks laid out, the scene with all places in the same coordinates, and what those count from.

    origin : (2,) [m]; mended : headline numbers on what was moved to make the blocks
    """

    scene: BlocksScene
    blocks: Tessellation
    origin: np.ndarray
    mended: dict[str, Any] = field(default_factory=dict)

    def placed(self, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Arrays of the artifact in the user's coordinates."""
        return arrays | {name: arrays[name] + self.origin for name in _PLACES} if self.origin.any() else arrays


def lay_out(scene: BlocksScene, given: Polygons | None = None) -> Ground:
    """Read, check and cut the blocks of a scene. given : its map, where that is read already

    Raises
    ------
    BadInput : an outline, hole or polygon that crosses itself, a map that is no coverage of the domain, a domain that
    the loading cannot take
    """
    t, d = scene.tessellation, scene.domain
    given = map_of(scene) if given is None else given
    extent_of(scene, given)
    by_map = given is not None and d.outline is None
    body = np.vstack(given.rings) if given is not None and by_map else np.array(d.corners)
    origin = local_origin(body) if len(body) else np.zeros(2)
    local = _counted_from(scene, origin)
    _refuse_crossings(local, origin)
    outline = turning_corners(np.array(local.domain.corners))
    shortest, thinnest = (_MENDED * t.edge if limit is None else limit for limit in (t.shortest_edge, t.thinnest))
    holes = [np.array(hole) for hole in local.domain.holes]
    fit = {"shortest": shortest, "thinnest": thinnest, "holes": holes, "origin": origin}
    mended: dict[str, Any] = {}
    try:
        if given is not None:
            shapes, marks, mended = _of_map(local, given, origin, outline)
            blocks = mend(shapes, marks, **fit)
        elif t.method == "joint-sets":
            sets = [JointSet(s.dip, s.spacing, s.persistence, s.dip_scatter, s.spacing_scatter) for s in t.sets]
            shapes, marks = (list(part) for part in zip(*cut_by_sets(outline, sets, scene.seed)))
            blocks = mend(shapes, marks if scene.joints.sets else None, **fit)
        else:
            whole = voronoi_blocks(outline, t.edge, scene.seed, t.lloyd_passes, t.shortest_edge)
            shapes = [whole.points[ring] for ring in whole.rings]
            blocks = without(whole, holes)
    except Refused as error:
        raise BadInput(Fault(str(scene.source.path), "tessellation", t.method, str(error))) from error
    mended |= taken_by_holes(local, shapes, blocks.outline, origin)
    if scene.programme is None:
        _refuse_other_shapes(scene, blocks)
    _warn_of_mending(scene, blocks)
    return Ground(local, blocks, origin, mended | _moved(blocks))


def _counted_from(scene: BlocksScene, origin: np.ndarray) -> BlocksScene:
    """The scene with all its places counted from `origin`."""
    if not origin.any():
        return scene
    x, y = origin.tolist()

    def shift(points: Any) -> Any:
        return None if points is None else [(p[0] - x, p[1] - y) for p in points]

    def segment(part: Any) -> Any:
        start, end = shift([part.start, part.end])
        return part.model_copy(update={"start": start, "end": end})

    d, p, s = scene.domain, scene.programme, scene.in_situ
    holes = [shift(hole) for hole in d.holes]
    update: dict[str, Any] = {"domain": d.model_copy(update={"outline": shift(d.outline), "holes": holes})}
    if scene.loading.supports:
        held = [segment(support) for support in scene.loading.supports]
        update["loading"] = scene.loading.model_copy(update={"supports": held})
    if p is not None:
        digs = [dig.model_copy(update={"polygon": shift(dig.polygon)}) for dig in p.excavations]
        parts = {"supports": [segment(v) for v in p.supports], "loads": [segment(v) for v in p.loads]}
        update["programme"] = p.model_copy(update={**parts, "excavations": digs})
    if s is not None and s.level is not None:
        update["in_situ"] = s.model_copy(update={"level": s.level - y})
    return scene.model_copy(update=update)


def _refuse_crossings(scene: BlocksScene, origin: np.ndarray) -> None:
    """All polygons that a scene itself holds."""
    held = [("domain.outline", scene.domain.outline)] if scene.domain.outline is not None else []
    held += [(f"domain.holes[{k}]", hole) for k, hole in enumerate(scene.domain.holes)]
    if scene.programme is not None:
        held += [
            (f"programme.excavations[{k}].polygon", e.polygon) for k, e in enumerate(scene.programme.excavations)
        ]
    faults = []
    for key, polygon in held:
        try:
            refuse_crossing(np.array(polygon).reshape(-1, 2), origin)
        except Refused as error:
            faults.append(Fault(str(scene.source.path), key, "", str(error)))
    if faults:
        raise BadInput(faults)


def _of_map(
    scene: BlocksScene, found: Polygons, origin: np.ndarray, outline: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray] | None, dict[str, Any]]:
    """Rings and sets of joints of a map, once it is a coverage of the domain, and headline numbers on it."""
    t, d = scene.tessellation, scene.domain
    rings = [ring - origin for ring in found.rings]
    points = np.vstack(rings)
    low, high = points.min(axis=0), points.max(axis=0)
    domain = outline if d.outline is not None else None
    sized = {"width", "height"} & d.model_fields_set
    if domain is None and (sized or scene.programme is None):
        # An upright rectangle, wherever the map lies.
        domain = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
        _refuse_other_size(scene, found, high - low, sized, coverage.SNAP * coverage.median_edge(rings))
    holes = [np.array(hole) for hole in d.holes]
    sound = coverage.sound(coverage.Given(rings, found.sets, found.names, origin, domain, holes))
    if sound.faults:
        more = len(sound.faults) - _MOST_FAULTS
        faults = [Fault(str(t.file), f.found, "", f.expected) for f in sound.faults[:_MOST_FAULTS]]
        faults += [Fault(str(t.file), f"{more} more faults", "", "a map that is a coverage")] if more > 0 else []
        raise BadInput(faults)
    mended: dict[str, Any] = {}
    if found.without_geometry:
        mended["features_without_geometry"] = len(found.without_geometry)
        _log.warning("%s: no geometry in %s", t.file, ", ".join(found.without_geometry[:5]))
    if sound.corners:
        mended |= {"snapped_corners": sound.corners, "largest_snap_m": sound.largest_move}
        _log.warning("%s: %d corners snapped, by up to %.3g m", t.file, sound.corners, sound.largest_move)
    return sound.rings, sound.sets if scene.joints.sets else None, mended


def _warn_of_mending(scene: BlocksScene, blocks: Tessellation) -> None:
    """Of a map whatever was mended; between joint sets slivers are usual, and only much area is worth a word."""
    m, t = blocks.mending, scene.tessellation
    if m is None:
        return
    share = m.area / signed_area(blocks.outline)
    if share > _WARN_AREA or (t.method == "file" and (m.largest_turn > _WARN_TURN or m.blocks)):
        _log.warning(
            "%s: to mend short edges and slivers (tessellation.shortest_edge, tessellation.thinnest), %d corners "
            "moved by up to %.3g m, %d joints turned by up to %.3g deg, and %d blocks with %.2g of the area joined "
            "their neighbours",
            t.file or scene.source.path, m.corners, m.largest_move, m.joints, np.degrees(m.largest_turn), m.blocks,
            share,
        )  # fmt: skip
    if m.slivers:
        _log.warning(
            "%s: %d slivers stay, since no neighbour makes one block with them (tessellation.thinnest)",
            t.file or scene.source.path, m.slivers,
        )  # fmt: skip


def _refuse_other_size(scene: BlocksScene, found: Polygons, size: np.ndarray, sized: set[str], snap: float) -> None:
    d = scene.domain
    faults = []
    for name, wanted, has in (("width", d.width, size[0]), ("height", d.height, size[1])):
        if name in sized and abs(wanted - has) > snap:
            expected = (
                f"{has:.6g} m, the {name} of the map in {scene.tessellation.file} ({len(found.rings)} polygons)"
            )
            faults.append(Fault(str(scene.source.path), f"domain.{name}", f"{wanted:.6g} m", expected))
    if faults:
        raise BadInput(faults)


def _refuse_other_shapes(scene: BlocksScene, blocks: Tessellation) -> None:
    """Biaxial compression takes upright rectangles."""
    try:
        rectangle_sides(blocks.outline)
    except Refused as error:
        key = "tessellation.file" if scene.tessellation.method == "file" else "domain"
        raise BadInput(Fault(str(scene.source.path), key, "", str(error))) from error


def _moved(blocks: Tessellation) -> dict[str, Any]:
    m = blocks.mending
    if m is None:
        return {}
    return {
        "mended_corners": m.corners,
        "largest_move_m": m.largest_move,
        "turned_joints": m.joints,
        "largest_turn_deg": float(np.degrees(m.largest_turn)),
        "merged_blocks": m.blocks,
        "merged_area_m2": m.area,
        "left_slivers": m.slivers,
        "largest_opening_change_m2": m.opening,
    }
