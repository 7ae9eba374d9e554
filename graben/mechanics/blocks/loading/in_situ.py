"""Stress that is there before anything is built or dug: put into zones and joints so that both balance at once.

Zones: each gets its own unstressed shape, which the present one is a stretch U of, such that Hooke's law gives the
Cauchy stress wanted. Nothing is left to do while stepping. Joints: each contact carries the force and the moment that
the stress has on the whole interval on which two blocks face each other, though its ends are cut off at corners; the
closure that goes with it counts from the first state on. A stress that is linear over the plane, and whose gradient
balances the weight, so meets its vertices in balance to round-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from graben.errors import Refused
from graben.mechanics.blocks.contact.joints import _BEND, STICK, STIFFENING, Pairs
from graben.mechanics.blocks.contact.nodes import LENGTH, TX, TY, X, Y
from graben.mechanics.blocks.engine.model import BlockModel


@dataclass(frozen=True)
class InSitu:
    """Cauchy stress xx, yy, xy [Pa, tension positive] at the height `level` [m], and its rise per metre upwards."""

    stress: tuple[float, float, float]
    rise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    level: float = 0.0

    def at(self, y: np.ndarray) -> np.ndarray:
        """Stress (n, 2, 2) at heights y (n,)."""
        xx, yy, xy = (s + r * (y - self.level) for s, r in zip(self.stress, self.rise, strict=True))
        return np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)


def put_in(model: BlockModel, field: InSitu) -> None:
    """Put a stress into zones and joints of a model that has not moved yet.

    Raises Refused where the rock is too soft for it.
    """
    model.put_stress(*_unstressed_zones(model, field), _stressed_pairs(model, field))


def _unstressed_zones(model: BlockModel, field: InSitu) -> tuple[np.ndarray, np.ndarray]:
    """Gradients and areas of zones which the present ones are strained copies of."""
    z = model.skeleton.zones
    x = model.motion.x[z.triangles]
    sigma = field.at(x[..., 1].mean(axis=1))
    lam, mu = z.lam[:, None, None], z.mu[:, None, None]
    one = np.broadcast_to(np.eye(2), sigma.shape)
    u = one
    # Second Piola-Kirchhoff and Cauchy stress differ by strains of a thousandth: three digits a turn.
    for _ in range(12):
        inverse = np.linalg.inv(u)
        s = np.linalg.det(u)[:, None, None] * (inverse @ sigma @ inverse)
        trace = np.trace(s, axis1=1, axis2=2)[:, None, None]
        strain = (s - 0.5 * lam / (lam + mu) * trace * one) / (2.0 * mu)
        if not np.abs(strain).max() < 0.05:
            raise Refused(f"in-situ stress {np.abs(sigma).max():.3g} Pa strains the rock by more than 5 %")
        c = one + 2.0 * strain
        root = np.sqrt(np.linalg.det(c))[:, None, None]
        u = (c + root * one) / np.sqrt(np.trace(c, axis1=1, axis2=2)[:, None, None] + 2.0 * root)
    gradient = np.ascontiguousarray(z.gradient @ u)
    area = z.area / np.linalg.det(u)
    return gradient, area


def _stressed_pairs(model: BlockModel, field: InSitu) -> Pairs:
    """Candidates with shear stress and seat of all pairs of block edges that face each other without a gap."""
    p, b, skin = model.pairs, model.bodies, model.skin
    node = model.motion.node
    e, f = skin.edge[p.first], skin.edge[p.second]
    t = node[p.first][:, [TX, TY]]
    n = np.column_stack([t[:, 1], -t[:, 0]])
    facing = -(t * node[p.second][:, [TX, TY]]).sum(axis=1)
    start = node[p.first][:, [X, Y]]
    other = node[skin.follow[p.second]][:, [X, Y]]
    gap = np.abs(((other - start) * n).sum(axis=1))
    plain = ~(skin.is_chamfer[p.first] | skin.is_chamfer[p.second])
    # Both the interval that bears and the whole one, from edge to edge, along the first edge from its start.
    low = np.maximum(0.0, ((other - start) * t).sum(axis=1))
    high = np.minimum(node[p.first, LENGTH], ((node[p.second][:, [X, Y]] - start) * t).sum(axis=1))

    def along(vertex: np.ndarray) -> np.ndarray:
        return ((b.position[vertex] - start) * t).sum(axis=1)

    first = np.maximum(along(b.edge_from[e]), along(b.edge_to[f]))
    last = np.minimum(along(b.edge_to[e]), along(b.edge_from[f]))
    size = model.block_size
    on = plain & (facing > 0.9999) & (gap < 1e-6 * size) & (high - low > 1e-6 * size) & (last > first)
    t, n, start, low, high, first, last = (a[on] for a in (t, n, start, low, high, first, last))
    seat, shear = np.zeros((len(p.key), 2)), p.shear
    # Traction on the first edge at both ends of the whole interval, and linear between.
    ends = [np.einsum("nab,nb->na", field.at((start + s[:, None] * t)[:, 1]), n) for s in (first, last)]
    length, middle = last - first, 0.5 * (low + high)
    force = 0.5 * length[:, None] * (ends[0] + ends[1])
    lever = [((2 * first + last) / 3.0 - middle)[:, None], ((first + 2 * last) / 3.0 - middle)[:, None]]
    moment = 0.5 * length[:, None] * (ends[0] * lever[0] + ends[1] * lever[1])
    half = 0.5 * (high - low)[:, None]
    table = model.joint_table[p.joint[on]]
    for k, sign in ((0, -1.0), (1, 1.0)):
        traction = 0.5 * (force + sign * moment / half) / half
        seat[on, k] = _closure(-(traction * n).sum(axis=1), table[:, 0], table[:, 9])
        shear[on, k] = (traction * t).sum(axis=1)
    p.live[on] = 1
    p.flag[on] = STICK
    return p._replace(seat=seat)


def _closure(pressure: np.ndarray, kn: np.ndarray, closure: np.ndarray) -> np.ndarray:
    """Closure [m] at a pressure [Pa]: `closure_stress` turned round."""
    most = np.where(closure > 0.0, closure, 1.0)
    bend = _BEND * most
    at_bend = kn * bend / (1.0 - bend / most)
    below = np.minimum(pressure, at_bend)
    curved = below / (kn + np.maximum(below, 0.0) / most) + (pressure - below) / (STIFFENING * kn)
    return np.where((closure > 0.0) & (pressure > 0.0), curved, pressure / kn)
