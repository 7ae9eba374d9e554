"""What a model is made of before it moves: zones, masses that its time step carries, sets of joints of edges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import RIM_SHARE, Joint
from graben.mechanics.blocks.contact.nodes import COLUMNS, RIM
from graben.mechanics.blocks.contact.search import no_pairs
from graben.mechanics.blocks.contact.sleeping import fresh_sleep
from graben.mechanics.blocks.engine import masses
from graben.mechanics.blocks.engine.records import DRIVE_SLOTS, LEDGER_SLOTS, Motion, Skeleton
from graben.mechanics.blocks.shape.bodies import Bodies, Skin
from graben.mechanics.blocks.shape.partition import Parts, runs
from graben.mechanics.blocks.zones.elastic import ElasticZones, lame, shape_gradients, stiffness_matrices
from graben.mechanics.blocks.zones.plastic import PlasticZones, Strength, plastic_zones
from graben.mechanics.blocks.zones.rigid import RigidBlocks, rigid_blocks, stiffest_motion
from graben.mechanics.cache_lines import aligned


class Rock(NamedTuple):
    """Rock of all blocks: young [Pa], poisson, density [kg/m3]; strength at which zones yield, None: elastic;
    rigid : blocks do not deform, the moduli and the strength then count for nothing.
    platens : young [Pa] and poisson of platens; None: as the others
    """

    young: float
    poisson: float
    density: float
    strength: Strength | None = None
    rigid: bool = False
    platens: tuple[float, float] | None = None


class Made(NamedTuple):
    """zones : their law; area : (zones,) [m2]; mass : of blocks; true_mass : (vertices,) [kg/m]; dt [s]"""

    zones: ElasticZones | PlasticZones | RigidBlocks
    area: np.ndarray
    mass: masses.Masses
    true_mass: np.ndarray
    dt: float


def refuse_unsound(rock: Rock, joints: Sequence[Joint]) -> None:
    """Refused where moduli, density or a stiffness of joints are out of range."""
    kn = min(j.normal_stiffness for j in joints)
    for name, value in (("young", rock.young), ("density", rock.density), ("kn", kn)):
        if not value > 0.0:
            raise Refused(f"{name} must be positive, found {value}")
    if not -1.0 < rock.poisson < 0.5:
        raise Refused(f"poisson must lie between -1 and 0.5, found {rock.poisson}")


def zones_and_masses(
    bodies: Bodies, rock: Rock, joints: Sequence[Joint], dt: float | None, local: float = 0.0
) -> Made:
    """Zones, and masses that make the time step stable; dt None: true masses, and dt from the estimate.

    local : share of local damping, which makes the estimate shorter
    """
    gradient, area = shape_gradients(bodies.position, bodies.zone_vertex)
    lam, mu = (np.full(len(area), c) for c in lame(rock.young, rock.poisson))
    if rock.platens is not None:
        of_platens = bodies.zone_block >= bodies.rock
        lam[of_platens], mu[of_platens] = lame(*rock.platens)
    thirds = np.repeat(rock.density * area / 3.0, 3)
    true_mass = np.bincount(bodies.zone_vertex.ravel(), weights=thirds, minlength=len(bodies.position))
    stiffest = max(max(j.stiffest, j.shear_stiffness) for j in joints)
    if rock.rigid:
        return _rigid(bodies, rock.density, area, true_mass, stiffest, dt)
    elastic = ElasticZones(bodies.zone_vertex.astype(np.uint32), gradient, area, lam, mu)
    law: ElasticZones | PlasticZones = elastic
    if rock.strength is not None:
        law = plastic_zones(elastic, rock.young, rock.poisson, rock.strength)
    zone = stiffness_matrices(gradient, area, lam, mu)
    if dt is None:
        mass, dt = masses.true_masses(bodies, zone, stiffest, rock.density)
        return Made(law, area, mass, true_mass, float(dt / np.sqrt(1.0 + local)))
    return Made(law, area, masses.scaled_masses(bodies, zone, stiffest, dt), true_mass, float(dt))


def _rigid(
    bodies: Bodies, density: float, area: np.ndarray, true_mass: np.ndarray, stiffest: float, dt: float | None
) -> Made:
    law = rigid_blocks(bodies, density, area, runs(bodies.vertex_block)[1])
    owner = np.repeat(np.arange(len(law.place)), np.diff(law.first))
    stiffness = stiffest_motion(bodies, law, stiffest)
    if dt is None:
        dt = float(masses.SAFETY * np.sqrt(4.0 * law.inertia[:, 0] / stiffness).min())
    else:
        law.inertia[:, 0] = stiffness * dt**2 / (4.0 * masses.SAFETY**2)
    mass = masses.of_rigid(law.inertia[:, 0], law.share * law.inertia[owner, 0], law.first)
    return Made(law, area, mass, true_mass, float(dt))


def sets_of_edges(
    bodies: Bodies, joints: Sequence[Joint], edge_set: np.ndarray | None, set_between: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Set of each outline edge, and the set that holds between edges of two sets; as given, checked."""
    sets = np.arange(len(joints))
    given = np.zeros(len(bodies.edge_from)) if edge_set is None else np.asarray(edge_set)
    between = np.minimum.outer(sets, sets) if set_between is None else np.asarray(set_between)
    if given.shape != bodies.edge_from.shape or not np.isin(given, sets).all():
        raise Refused(f"edge_set: expected {len(bodies.edge_from)} numbers of joint sets (0 to {sets[-1]})")
    # A contact with a face has a set for each order of its edges.
    faced = np.array([j.face > 0 for j in joints])
    if between.shape != (len(sets),) * 2 or not np.isin(between, sets).all():
        raise ValueError(f"set_between: expected a table {len(sets)} x {len(sets)} of joint sets")
    if np.any((between != between.T) & ~faced[between]):
        raise ValueError("set_between: expected a symmetric table, but for contacts with a face")
    return given.astype(np.int64), np.ascontiguousarray(between, dtype=np.int64)


def unloaded(skin: Skin, parts: Parts, made: Made, weight: np.ndarray) -> Skeleton:
    """Skeleton that nothing holds and nothing but its weight (vertices, 2) [N/m] loads."""
    return Skeleton(
        made.zones,
        skin.first.astype(np.uint32),
        skin.second.astype(np.uint32),
        skin.weight,
        skin.follow.astype(np.uint32),
        made.mass,
        masses.gains(made.mass, made.dt),
        np.empty((0, 2), dtype=np.int64),
        np.zeros(len(parts.node), dtype=np.int64),
        np.zeros(weight.shape),
        weight.copy(),
        np.zeros(weight.shape),
    )


def at_rest(bodies: Bodies, skin: Skin, parts: Parts) -> Motion:
    """Motion of bodies that have not moved, with no candidates yet."""
    nv, nn = len(bodies.position), len(skin.first)
    none: dict[str, Any] = fresh_sleep(no_pairs(), parts, np.zeros((nn, COLUMNS)))
    motion = Motion(
        bodies.position.copy(),
        np.zeros((nv, 2)),
        np.zeros((nv, 2)),
        np.zeros((nv, 2)),
        np.zeros((nv, 2)),
        aligned(nn, COLUMNS),
        aligned(nn, 2),
        np.zeros(LEDGER_SLOTS),
        np.zeros(DRIVE_SLOTS),
        **none,
    )
    x = bodies.position
    point = x[skin.first] + skin.weight[:, None] * (x[skin.second] - x[skin.first])
    length = np.linalg.norm(point[skin.follow] - point, axis=1)
    motion.node[:, RIM] = np.where(skin.is_chamfer, RIM_SHARE * length, 0.0)
    return motion
