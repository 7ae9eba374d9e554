"""Joints of a scene as the mechanics take them: one set, or several with a rule for edges of two sets that meet."""

from __future__ import annotations

import numpy as np

from graben.mechanics.blocks.contact.joints import Joint
from graben.schemas.scenes.blocks import Joints


def joint(j: Joints) -> Joint:
    """Properties of one set of joints."""
    return Joint(
        j.normal_stiffness,
        j.shear_stiffness,
        float(np.tan(j.friction)),
        j.cohesion,
        j.tension,
        float(np.tan(j.dilation)),
        np.inf if j.dilation_limit is None else j.dilation_limit,
        # Negative: as for intact joints.
        -1.0 if j.residual_friction is None else float(np.tan(j.residual_friction)),
        -1.0 if j.residual_cohesion is None else j.residual_cohesion,
        j.closure or 0.0,
    )


def joints_of_sets(joints: Joints, edge_set: np.ndarray | None) -> tuple[list[Joint], np.ndarray | None]:
    """Joints of sets 0, 1, ... and the set (sets, sets) that holds between edges of two of them.

    edge_set : (edges,) set of each edge; None: all are of [joints]
    """
    if edge_set is None:
        return [joint(joints)], None
    count = max([int(edge_set.max()), *(s.set for s in joints.sets)]) + 1
    found = [joint(joints.of_set(k)) for k in range(count)]
    # Of two surfaces that were not cut together the weaker one decides.
    order = sorted(range(count), key=lambda k: (found[k].friction, found[k].cohesion, k))
    rank = np.argsort(order)
    return found, np.array(order)[np.minimum.outer(rank, rank)]
