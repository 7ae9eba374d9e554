"""What the compiled loop works on: records of arrays, and the names of numbered slots in two of them.

Only the engine reads and writes slots; others ask the model.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from graben.mechanics.blocks.contact.forces import Rows
from graben.mechanics.blocks.engine.masses import Gains, Masses

# Slots of Motion.drive: the coefficient of global damping [1/s]; what the rising load and the prescribed speeds are
# multiplied by, and how much that grows a step (speeds: up to 1); by how much the load falls per unit of its way.
DAMPING, LOAD, LOAD_STEP, SPEED, SPEED_STEP, BRAKE, DRIVE_SLOTS = 0, 1, 2, 3, 4, 5, 6
# Slots of Motion.ledger: kinetic energy, energy taken by damping, by friction and by yielding, work of loads and of
# walls [J/m]; largest overlap [m]; rates of kinetic energy and of damping as adaptive damping saw them;
# way of the rising load, its work per unit of it [J/m].
KINETIC, DAMPED, FRICTION, PLASTIC, LOAD_WORK, WALL_WORK, LARGEST_OVERLAP = 0, 1, 2, 3, 4, 5, 6
RATE_SEEN, DAMPED_SEEN, WAY, LEDGER_SLOTS = 7, 8, 9, 10


class Skeleton(NamedTuple):
    """What does not change while stepping: zones, contact nodes, masses, constraints and loads.

    zones : ElasticZones, or another law of zones/; first, second, weight, follow : contact nodes
    mass, gains : see masses.py; still : (k, 2) vertex and axis of prescribed velocities, wall : (vertices, 2) [m/s];
    still_start : (parts + 1,) where those of each part begin
    steady, rising : (vertices, 2) forces [N/m]; the load is steady + drive[LOAD] * rising, the velocity of
    still vertices drive[SPEED] * wall
    """

    zones: Any
    first: np.ndarray
    second: np.ndarray
    weight: np.ndarray
    follow: np.ndarray
    mass: Masses
    gains: Gains
    still: np.ndarray
    still_start: np.ndarray
    wall: np.ndarray
    steady: np.ndarray
    rising: np.ndarray


class Motion(NamedTuple):
    """What changes: positions and velocities of vertices and of contact nodes, forces, running sums, and who sleeps.

    x, v, zone_force, joint_force, reaction : (vertices, 2); node : node table (nodes, 8); fn : (nodes, 2)
    ledger, drive : numbers in the slots above
    From start on (sleeping.py): which candidates are awake, part by part, and when to look at each of them again.
    start : (parts + 1,) first candidate of each part, that of its first edge; awake ones have rows (valid while
    stepping, between `begin` and `end`), those of part p and set of joints s from turn[p, s] to turn[p, s + 1]
    kind : (n,) what a candidate was when last looked at; wake : (n,) path [m] of its blocks at which to look again
    far_start : (parts + 1,), far_of : (n,) row of `far` (rows, 4) through which a pair hands forces on to another
    part, -1 within a part; post_start : (parts + 1,), post : (rows, 2) row and node of the forces handed to each part
    path, gone : (blocks,) bounds on the path of a block's nodes up to the reference and up to now; reference,
    built : (nodes, 2) positions then and at the search; farthest : (parts, 2) squares of distance since, and speed
    due : (1,) steps until the next look at how far nodes went
    """

    x: np.ndarray
    v: np.ndarray
    zone_force: np.ndarray
    joint_force: np.ndarray
    reaction: np.ndarray
    node: np.ndarray
    fn: np.ndarray
    ledger: np.ndarray
    drive: np.ndarray
    start: np.ndarray
    rows: Rows
    turn: np.ndarray
    kind: np.ndarray
    wake: np.ndarray
    far_start: np.ndarray
    far_of: np.ndarray
    far: np.ndarray
    post_start: np.ndarray
    post: np.ndarray
    path: np.ndarray
    gone: np.ndarray
    reference: np.ndarray
    built: np.ndarray
    farthest: np.ndarray
    due: np.ndarray


class Rules(NamedTuple):
    """Numbers that hold for all steps of one call.

    dt [s]; reach, near : of the candidates and of the awake ones [m]; dilation : largest tangent of all joints;
    deepest : overlap limit [m]; most_energy : kinetic energy that stops the run [J/m]
    damping_ratio : adaptive global damping holds its power at this ratio to the rate of kinetic energy; below 0 its
    coefficient stays as it is; damping_limit : upper bound of that [1/s]
    local : share of the unbalanced force taken off against the velocity
    """

    dt: float
    reach: float
    near: float
    dilation: float
    deepest: float
    most_energy: float
    damping_ratio: float
    damping_limit: float
    local: float


def private(m: Motion) -> Motion:
    """The same motion for another thread: it decides for itself, from numbers of its own."""
    return m._replace(ledger=m.ledger.copy(), drive=m.drive.copy(), due=m.due.copy())
