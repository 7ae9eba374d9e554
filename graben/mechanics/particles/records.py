"""The records that kernels of spheres take: NamedTuples of arrays, each array written by one owner.

| array | owner |
|---|---|
| position, velocity, spin of Bodies | `motion.advance`, from start values that are set before a run |
| order of all that runs over bodies, first and partner of Contacts | `neighbours`, through Assembly._rebuild |
| dash and slip of Contacts | `contacts.pair_forces`; `contacts.close_ledger` takes what dash still owes |
| point and velocity of Walls | `walls.steer`, `walls.push_piston`, `walls.drift`; else who builds the table |
| push, rub and slip of Walls | `motion.move` |
| Loads | `contacts.pair_forces` begins them, `motion.move` ends them |

What is off is None, and numba leaves out a branch on `argument is None` when it compiles. It sees arguments only, not
fields of a record; so slip and width travel as arguments of their own beside the records.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Bodies(NamedTuple):
    """n spheres, sorted by cell."""

    position: Floats  # (n, 3) m
    velocity: Floats  # (n, 3) m/s, at half steps
    spin: Floats  # (n, 3) rad/s; 0 where nothing rubs
    radius: Floats  # (n,) m
    mass: Floats  # (n,) kg
    kind: Ints  # (n,) class, first index into tables of contact laws
    identity: Ints  # (n,) place in the order in which the spheres were given

    def sorted(self, order: Ints) -> Bodies:
        """The same bodies in another order (n,)."""
        return self._replace(**{name: a[order] for name, a in self._asdict().items()})


class Contacts(NamedTuple):
    """Half list of m pairs closer than contact plus skin; row i holds partner[first[i] : first[i + 1]]."""

    first: Ints  # (n + 1,)
    partner: NDArray[np.uint32]  # (m or more,)
    dash: Floats  # (m or more,) N, what the normal dashpot added to the spring in the last step
    slip: Floats | None  # (m or more, 3) N, tangential spring on the first body; None where nothing rubs
    start: Floats  # (n, 3) m, positions for which the list was made
    skin: float  # m; the list holds until a body has moved half of it


class Walls(NamedTuple):
    """w planes at any place and angle. Bodies are on the side to which the normal points."""

    point: Floats  # (w, 3) m, on the plane
    normal: Floats  # (w, 3) unit vectors
    velocity: Floats  # (w, 3) m/s
    kind: Ints  # (w,) law class, second index into the table of wall laws
    push: Floats  # (w,) N along minus the normal, on the wall, in the last step
    rub: Floats  # (w, 3) N, friction on the wall in the last step
    slip: Floats | None  # (n, w, 3) N, tangential spring on each body; None where nothing rubs


class Loads(NamedTuple):
    """Sums over all contacts of a body, gravity and drag in the force."""

    force: Floats  # (n, 3) N
    torque: Floats | None  # (n, 3) N m; None where nothing rubs


class Drive(NamedTuple):
    """The numbers that steer a run; none changes during `motion.advance`."""

    gravity: Floats  # (3,) m/s2
    floor: int  # row of Walls that may shake; rows before it are the sides
    piston: int = -1  # row of Walls, -1 for none
    drag: float = 0.0  # 1/s, force over mass and velocity
    shake_amplitude: float = 0.0  # m, along the floor's normal
    shake_omega: float = 0.0  # rad/s
    shake_start: float = 0.0  # s
    shake_home: float = 0.0  # m, of the floor along its normal at rest
    piston_mass: float = 0.0  # kg
    piston_damping: float = 0.0  # N s/m
    piston_force: float = 0.0  # N, that the push ends at
    piston_rate: float = 0.0  # N/s, at which it grows


# entries of the clock
TIME, PISTON_PUSH, HANDS = 0, 1, 2
# entries of the ledger, J; losses count positive, works are those done on the particles and the piston
DASHPOTS, FRICTION, DRAG, WALL_WORK, PISTON_WORK, PISTON_DASHPOT, ENTRIES = 0, 1, 2, 3, 4, 5, 6
