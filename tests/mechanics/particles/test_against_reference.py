"""The compiled kernels give what the slow reference gives, list rebuilds included."""

import numpy as np
import pytest

from graben.mechanics.particles.assembly import Assembly
from graben.mechanics.particles.insertion import insert
from graben.mechanics.particles.law import LinearLaw


class SlowAssembly:
    """All pairs, no lists. Periodic sides or hard walls, floor at z = 0."""

    def __init__(self, law: LinearLaw, x, kind, width, periodic, gravity, dt):
        self.law, self.kind, self.width, self.periodic = law, kind, np.array([*width, 1e30]), periodic
        self.gravity, self.dt = gravity, dt
        self.x, self.v, self.spin = x.copy(), np.zeros_like(x), np.zeros_like(x)
        self.history = {}

    def contact(self, key, n, opening, overlap, mass, kn, slide, friction):
        """Force on the first body; n points from it to the second; slide: velocity of the second at the contact."""
        law = self.law
        cn = 2 * law.damping * np.sqrt(mass * kn)
        push = max(0.0, kn * overlap - cn * opening)
        force = -push * n
        if law.rubs:
            kt = law.shear_ratio * kn
            s = self.history.get(key, np.zeros(3))
            size = np.linalg.norm(s)
            s = s - (s @ n) * n
            if np.linalg.norm(s) > 0:
                s *= size / np.linalg.norm(s)
            slide = slide - (slide @ n) * n
            s = s + kt * slide * self.dt
            t = s + 2 * law.shear_damping * np.sqrt(mass * kt) * slide
            if np.linalg.norm(s) > friction * push:
                s = t = s * friction * push / np.linalg.norm(s)
            elif np.linalg.norm(t) > friction * push:
                t = t * friction * push / np.linalg.norm(t)
            self.history[key] = s
            force = force + t
        return force

    def step(self):
        law, n = self.law, len(self.x)
        mass, radius = law.mass[self.kind], law.radius[self.kind]
        force, torque = np.zeros((n, 3)), np.zeros((n, 3))
        touching = set()
        for i in range(n):
            for j in range(i + 1, n):
                d = self.x[j] - self.x[i]
                if self.periodic:
                    d[:2] -= self.width[:2] * np.rint(d[:2] / self.width[:2])
                distance = np.linalg.norm(d)
                overlap = radius[i] + radius[j] - distance
                if overlap <= 0:
                    continue
                touching.add((i, j))
                normal = d / distance
                a, b = radius[i] - overlap / 2, radius[j] - overlap / 2
                relative = self.v[j] - self.v[i]
                slide = relative - np.cross(a * self.spin[i] + b * self.spin[j], normal)
                ki, kj = law.normal_stiffness[self.kind[i]], law.normal_stiffness[self.kind[j]]
                f = self.contact(
                    (i, j), normal, relative @ normal, overlap, mass[i] * mass[j] / (mass[i] + mass[j]),
                    ki * kj / (ki + kj), slide, law.friction,
                )  # fmt: skip
                force[i] += f
                force[j] -= f
                torque[i] += a * np.cross(normal, f)
                torque[j] += b * np.cross(normal, f)
            walls = [(2, 1.0, 0.0)]
            if not self.periodic:
                walls += [(a, s, p) for a in (0, 1) for s, p in ((1.0, 0.0), (-1.0, self.width[a]))]
            for axis, sign, place in walls:
                overlap = radius[i] - sign * (self.x[i, axis] - place)
                if overlap <= 0:
                    continue
                key = (i, "wall", axis, sign)
                touching.add(key)
                normal = np.zeros(3)
                normal[axis] = -sign
                arm = radius[i] - overlap
                slide = -self.v[i] - np.cross(arm * self.spin[i], normal)
                k = law.normal_stiffness[self.kind[i]]
                kw = k * law.wall_stiffness / (k + law.wall_stiffness)
                f = self.contact(key, normal, -self.v[i] @ normal, overlap, mass[i], kw, slide, law.wall_friction)
                force[i] += f
                torque[i] += arm * np.cross(normal, f)
        self.history = {k: s for k, s in self.history.items() if k in touching}
        force[:, 2] -= mass * self.gravity
        self.v += force / mass[:, None] * self.dt
        self.spin += torque / (0.4 * mass * radius**2)[:, None] * self.dt
        self.x += self.v * self.dt


def crowd(friction: float) -> tuple[LinearLaw, np.ndarray, np.ndarray, tuple[float, float]]:
    law = LinearLaw(
        radius=np.array([1.0e-3, 0.6e-3]),
        density=np.array([2500.0, 3000.0]),
        normal_stiffness=np.array([3e3, 2e3]),
        wall_stiffness=5e3,
        friction=friction,
        wall_friction=0.5 * friction,
        damping=0.2,
        shear_damping=0.1,
    )
    kind = np.array([0] * 25 + [1] * 35)
    width = (7.5e-3, 7.8e-3)
    x = insert(law.radius[kind], width, 9e-3, np.random.Generator(np.random.PCG64(3)))
    return law, x, kind, width


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("periodic", [True, False])
def test_trajectories(friction, periodic):
    law, x, kind, width = crowd(friction)
    fast = Assembly(law, x, kind, width, periodic=periodic, gravity=9.81, safety=0.3, skin=0.05)
    slow = SlowAssembly(law, x, kind, width, periodic, 9.81, fast.dt)
    rng = np.random.Generator(np.random.PCG64(5))
    slow.v[:] = rng.normal(size=x.shape) * 0.5
    slow.spin[:] = rng.normal(size=x.shape) * (200.0 if friction else 0.0)
    fast.bodies.velocity[:], fast.bodies.spin[:] = slow.v[fast.bodies.identity], slow.spin[fast.bodies.identity]
    for _ in range(150):
        slow.step()
    fast.advance(150)
    assert fast.rebuilds > 2
    assert slow.history or not friction
    ours = fast.by_identity(fast.bodies.position)
    difference = ours - slow.x
    if periodic:
        difference[:, :2] -= np.array(width) * np.rint(difference[:, :2] / width)
    assert np.abs(slow.x - x).max() > 1e-4  # something happened
    np.testing.assert_allclose(difference, 0.0, atol=1e-12)
    np.testing.assert_allclose(fast.by_identity(fast.bodies.velocity), slow.v, atol=1e-9)
    np.testing.assert_allclose(fast.by_identity(fast.bodies.spin), slow.spin, atol=1e-6)


def test_half_list_holds_each_close_pair_once():
    law, x, kind, width = crowd(0.0)
    box = Assembly(law, x, kind, width, skin=0.3)
    d = box.bodies.position[:, None] - box.bodies.position[None]
    d[..., :2] -= np.array(width) * np.rint(d[..., :2] / width)
    near = np.linalg.norm(d, axis=-1) < box.bodies.radius[:, None] + box.bodies.radius[None] + 0.3 * 0.6e-3
    expected = {(i, j) for i, j in zip(*np.nonzero(near)) if i < j}
    found = [
        (min(i, int(j)), max(i, int(j)))
        for i in range(len(x))
        for j in box.contacts.partner[box.contacts.first[i] : box.contacts.first[i + 1]]
    ]
    assert len(found) == len(set(found))
    assert set(found) == expected
