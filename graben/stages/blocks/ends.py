"""What grips the rock of a compression, as a scene's [loading] describes it: walls, supports, platens as bodies."""

from __future__ import annotations

import numpy as np

from graben.errors import BadInput, Fault, Refused
from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.loading.ends import Ends, Walls
from graben.mechanics.blocks.loading.ends import Platens as PlatenEnds
from graben.mechanics.blocks.loading.loads import on_segment
from graben.mechanics.blocks.shape.bodies import Bodies
from graben.mechanics.blocks.shape.platens import BOTTOM, LEFT, PlatenShape, with_platens
from graben.mechanics.blocks.shape.tessellation import Tessellation
from graben.schemas.scenes.blocks import BlocksScene
from graben.schemas.scenes.blocks_loading import Platens

_POISSON = 0.3  # steel
_THICKNESS, _OVERHANG = 0.1, 0.25  # over the smaller side of the domain


def platens_of(scene: BlocksScene) -> Platens | None:
    """Platens of a compression; None where it has none, and of a programme."""
    return None if scene.programme is not None else scene.loading.platens


def beside(rock: Tessellation, platens: Platens) -> Tessellation:
    """The blocks of the rock, and the platens."""
    size = float(np.ptp(rock.outline, axis=0).min())
    thickness = _THICKNESS * size if platens.thickness is None else platens.thickness
    overhang = _OVERHANG * size if platens.overhang is None else platens.overhang
    return with_platens(rock, PlatenShape(thickness, overhang, platens.sides, platens.young is not None))


def platen_rock(platens: Platens | None) -> tuple[float, float] | None:
    """Young's modulus and Poisson's ratio of platens that deform; None: rigid, or of the rock."""
    if platens is None or platens.young is None:
        return None
    return platens.young, _POISSON if platens.poisson is None else platens.poisson


def with_contacts(
    platens: Platens, bodies: Bodies, rock: list[Joint], between: np.ndarray | None
) -> tuple[list[Joint], np.ndarray, np.ndarray]:
    """Joints with those of the platens, the set of each outline edge, and the set that holds between two sets."""
    end = Joint(
        rock[0].normal_stiffness if platens.normal_stiffness is None else platens.normal_stiffness,
        rock[0].shear_stiffness if platens.shear_stiffness is None else platens.shear_stiffness,
        0.0,
        0.0,
        0.0,
        0.0,
        np.inf,
    )
    angles = [platens.friction]
    if platens.sides:
        angles.append(platens.friction if platens.side_friction is None else platens.side_friction)
    block = bodies.vertex_block[bodies.edge_from]
    sets = np.zeros(len(block), dtype=np.int64) if bodies.edge_set is None else bodies.edge_set.astype(np.int64)
    count, own = len(rock) + 2 * len(angles), np.arange(len(rock))
    joints, table = list(rock), np.zeros((count, count), dtype=np.int64)
    table[: len(rock), : len(rock)] = np.minimum.outer(own, own) if between is None else between
    for k, angle in enumerate(angles):
        first = len(rock) + 2 * k
        joints += [end._replace(friction=float(np.tan(angle)), face=face) for face in (1, 2)]
        sets[block >= bodies.rock + (BOTTOM, LEFT)[k]] = first
        # The set of a contact is looked up by that of its first edge, then that of its second.
        table[first, : len(rock)], table[: len(rock), first] = first, first + 1
    return joints, sets, table


def ends_of(scene: BlocksScene, bodies: Bodies) -> Ends:
    """What grips the rock.

    Raises
    ------
    BadInput : a support that is not on the outline, or that contradicts the compression; Refused : no rectangle
    """
    if scene.loading.platens is not None:
        return PlatenEnds(bodies, elastic=scene.loading.platens.young is not None)
    supports, file = scene.loading.supports, str(scene.source.path)
    if not supports:
        return Walls(bodies)
    faults, held = [], np.zeros((len(bodies.position), 2), dtype=bool)
    for k, support in enumerate(supports):
        at = on_segment(bodies, np.array(support.start), np.array(support.end))
        if not at.any():
            expected = "a segment that holds a part of the outline"
            faults.append(Fault(file, f"loading.supports.{k}", support.name, expected))
        for axis, name in enumerate("xy"):
            held[at, axis] |= support.fix in (name, "both")
    if faults:
        raise BadInput(faults)
    try:
        return Walls(bodies, held)
    except Refused as error:
        raise BadInput(Fault(file, "loading.supports", "", str(error))) from error
