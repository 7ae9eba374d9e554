"""A round hole dug in stressed rock, against Kirsch and against the tube of Lame."""

from itertools import pairwise

import numpy as np
import pytest

from graben.mechanics.blocks.contact.joints import Joint
from graben.mechanics.blocks.engine.model import BlockModel
from graben.mechanics.blocks.loading.in_situ import InSitu, put_in
from graben.mechanics.blocks.shape.bodies import build_bodies
from graben.mechanics.blocks.shape.tessellation import from_polygons

E, NU, RADIUS, FAR, KN = 20e9, 0.25, 1.0, 8.0, 1e12


def dug(sxx, syy):
    """Wedges in 16 rings of 32 around a core, bonded; the outer ring is held, and the core taken out."""
    angle = 2 * np.pi * np.arange(32) / 32
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    r = RADIUS * (FAR / RADIUS) ** (np.arange(17) / 16)
    shapes = [RADIUS * ray]
    for near, far in pairwise(r):
        shapes += [np.array([near * a, far * a, far * b, near * b]) for a, b in zip(ray, np.roll(ray, -1, axis=0))]
    bodies = build_bodies(from_polygons(shapes, FAR * ray))
    bonded = Joint(KN, KN, 0.0, 1e12, 1e12, 0.0, np.inf)
    model = BlockModel(bodies, young=E, poisson=NU, density=2500.0, joint=bonded, rounding=1e-4, dt=1e-2)
    put_in(model, InSitu((sxx, syy, 0.0)))
    for axis in (0, 1):
        model.hold(bodies.vertex_side.any(axis=1), axis)
    model.advance(1)
    assert model.unbalanced_ratio() < 1e-9
    model.remove(np.arange(len(shapes)) == 0)
    model.advance(3000)
    return model


@pytest.mark.verify
def test_stress_around_a_hole_is_that_of_kirsch():
    model = dug(-4e6, -2e6)
    b, s = model.bodies, model.zone_stress()
    x = b.position[model.skeleton.zones.triangles].mean(axis=1)
    r, angle = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    cos, sin = np.cos(angle), np.sin(angle)
    hoop = s[:, 0] * sin**2 + s[:, 1] * cos**2 - 2.0 * s[:, 3] * cos * sin
    radial = s[:, 0] * cos**2 + s[:, 1] * sin**2 + 2.0 * s[:, 3] * cos * sin
    q = (RADIUS / r) ** 2
    kirsch = -3e6 * (1 + q) + 1e6 * (1 + 3 * q**2) * np.cos(2 * angle)
    kirsch_radial = -3e6 * (1 - q) - 1e6 * (1 - 4 * q + 3 * q**2) * np.cos(2 * angle)
    rock = b.zone_block > 0
    crown = rock & (r < 1.15) & (np.abs(np.abs(angle) - np.pi / 2) < 0.2)
    wall = rock & (r < 1.15) & (np.abs(np.abs(angle) - np.pi / 2) > np.pi / 2 - 0.2)
    assert hoop[crown].mean() == pytest.approx(kirsch[crown].mean(), rel=0.08)
    assert hoop[wall].mean() == pytest.approx(kirsch[wall].mean(), rel=0.08)
    beside = rock & (r > 1.5) & (r < 3.0)
    assert np.abs(hoop - kirsch)[beside].mean() < 0.04 * 4e6
    assert np.abs(radial - kirsch_radial)[beside].mean() < 0.04 * 4e6


@pytest.mark.verify
def test_a_hole_under_equal_stress_closes_as_lames_tube():
    model = dug(-3e6, -3e6)
    b = model.bodies
    rim = (np.hypot(*b.position.T) < 1.001 * RADIUS) & (b.vertex_block > 0)
    inwards = -((model.motion.x - b.position)[rim] * b.position[rim]).sum(axis=1).mean()
    shear = 0.5 * E / (1 + NU)
    tube = 3e6 / (2 * shear) / (1 / (1 - 2 * NU) + (FAR / RADIUS) ** 2) * (FAR**2 / RADIUS - RADIUS)
    # Joints of 1e12 Pa/m give a little more way.
    assert inwards == pytest.approx(tube, rel=0.06)
