"""Forces of hexahedra against slow, obvious references: patch test, rotation, hourglass forces, work."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from graben.mechanics.elements.hex8 import CORNERS, HOURGLASS, shape_gradient
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.scratch.body import elastic_moduli, reference_gradients
from graben.mechanics.scratch.eight_points import forces_eight_points
from graben.mechanics.scratch.frame import stress_in_space
from graben.mechanics.scratch.mesh import brick
from graben.mechanics.scratch.one_point import HOURGLASS_WORK, INTERNAL, LEDGER_SIZE, forces_one_point

YOUNG, NU = 210e9, 0.33
ROOT = 1.0 / np.sqrt(3.0)
GAUSS = [(a, b, c) for c in (-ROOT, ROOT) for b in (-ROOT, ROOT) for a in (-ROOT, ROOT)]
STEEL = [[0.0, 380e6], [0.05, 480e6], [0.5, 680e6]]


def distorted(seed: int, amount: float = 0.2) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return CORNERS.astype(float) + amount * rng.uniform(-1, 1, (8, 3))


def pieces(points: np.ndarray, cells: np.ndarray, count: int, law: str = "elastic", chi: float = 0.02):
    """Arrays of a small body with `count` points per element, and a function that takes one displacement step."""
    values = {"young_modulus": YOUNG, "poisson_ratio": NU}
    if law == "j2":
        values["hardening"] = STEEL
    par = pack(law, values)
    e = len(cells)
    b = SimpleNamespace(par=par, x=points.copy(), vol=np.empty(e), g0=np.empty((e, count, 8, 3)))
    reference_gradients(points, cells, b.g0, b.vol)
    b.rot = np.tile(np.eye(3), (e, count, 1, 1))
    b.sig = np.zeros((e, count, 6))
    b.state = np.tile(LAWS[law].initial_state(par), (e, count, 1))
    b.hour = np.zeros((e, 4, 3))
    b.ledger = np.zeros(LEDGER_SIZE)
    shear = elastic_moduli(par)[1]

    def move(step: np.ndarray) -> np.ndarray:
        b.x += step
        force = np.zeros_like(b.x)
        alive, mass = np.ones(e, dtype=np.int64), 7800.0 * b.vol
        law_id = LAWS[law].id
        if count == 1:
            code, _ = forces_one_point(
                b.x, step, cells, b.g0, alive, b.vol, mass, b.rot, b.sig, b.state, b.hour, law_id, par, shear, chi,
                0.0, 6000.0, 1.0, force, b.ledger,
            )  # fmt: skip
        else:
            code, _ = forces_eight_points(
                b.x, step, cells, b.g0, alive, b.vol, mass, b.rot, b.sig, b.state, law_id, par, 0.0, 6000.0, 1.0,
                force, b.ledger,
            )  # fmt: skip
        assert code == 0
        return force

    b.move = move
    return b


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    k = axis / np.linalg.norm(axis)
    w = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * w + (1 - np.cos(angle)) * w @ w


@pytest.mark.parametrize("count", [1, 8])
def test_large_rotation_gives_no_stress_and_turns_the_stress_that_is_there(count: int) -> None:
    points = distorted(7)
    b = pieces(points, np.arange(8)[None], count)
    rng = np.random.default_rng(1)
    b.move(1e-3 * rng.uniform(-1, 1, (8, 3)))
    first, frame, hourglass = stress_in_space(b.rot, b.sig)[0], b.sig.copy(), b.hour.copy()
    energy = b.ledger.copy()
    start, axis = b.x.copy(), np.array([1.0, 2.0, -0.5])
    for k in range(1, 76):  # to 150 degrees
        b.move(start @ turn(axis, np.deg2rad(2.0 * k)).T - b.x)
    np.testing.assert_allclose(b.sig, frame, rtol=1e-9, atol=1e-9 * np.abs(frame).max())
    np.testing.assert_allclose(b.hour, hourglass, rtol=1e-9, atol=1e-9 * np.abs(hourglass).max())
    assert abs(b.ledger[INTERNAL] - energy[INTERNAL]) < 1e-9 * energy[INTERNAL]
    q = turn(axis, np.deg2rad(150.0))
    full = lambda s: np.array([[s[0], s[3], s[5]], [s[3], s[1], s[4]], [s[5], s[4], s[2]]])  # noqa: E731
    now = full(stress_in_space(b.rot, b.sig)[0])
    np.testing.assert_allclose(now, q @ full(first) @ q.T, atol=2e-4 * np.abs(first).max())
    defect = b.rot.reshape(-1, 3, 3).transpose(0, 2, 1) @ b.rot.reshape(-1, 3, 3) - np.eye(3)
    assert np.abs(defect).max() < 1e-13


@pytest.mark.parametrize("count", [1, 8])
def test_patch_of_distorted_elements_under_uniform_strain(count: int) -> None:
    mesh = brick(np.linspace(0, 2, 3), np.linspace(0, 2, 3), np.linspace(0, 2, 3))
    points = mesh.points.copy()
    inner = np.all((points > 0) & (points < 2), axis=1)
    points[inner] += [0.21, -0.17, 0.13]
    b = pieces(points, mesh.cells, count)
    eps = np.array([[3e-6, 1e-6, -2e-6], [1e-6, -2e-6, 4e-6], [-2e-6, 4e-6, 1e-6]])
    force = b.move(points @ eps)
    bulk, shear = elastic_moduli(b.par)
    exact = 2 * shear * eps + (bulk - 2 * shear / 3) * np.trace(eps) * np.eye(3)
    exact = np.array([exact[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))])
    stress = stress_in_space(b.rot, b.sig)
    np.testing.assert_allclose(stress, np.tile(exact, (8, 1)), rtol=2e-5, atol=2e-5 * np.abs(exact).max())
    assert np.abs(force[inner]).max() < 2e-5 * np.abs(force).max()
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12 * np.abs(force).max())


def test_one_point_forces_are_those_of_the_textbook() -> None:
    """Forces by explicit hourglass vectors gamma and Gauss integration of the constant stress."""
    chi, points = 0.3, distorted(3)
    b = pieces(points, np.arange(8)[None], 1, chi=chi)
    step = 1e-6 * np.random.default_rng(5).uniform(-1, 1, (8, 3))
    force = b.move(step)
    x, g = b.x, np.empty((8, 3))
    mean, volume = np.zeros((8, 3)), 0.0
    for point in GAUSS:
        w = shape_gradient(x, *point, g)
        mean, volume = mean + w * g, volume + w
    mean /= volume
    grad = step.T @ mean
    eps = 0.5 * (grad + grad.T)
    bulk, shear = elastic_moduli(b.par)
    stress = 2 * shear * eps + (bulk - 2 * shear / 3) * np.trace(eps) * np.eye(3)
    exact = -volume * mean @ stress
    stiffness = chi * shear * volume * (mean**2).sum() / 24.0
    for h in HOURGLASS:
        gamma = h - mean @ (h @ x)
        np.testing.assert_allclose(gamma @ np.c_[np.ones(8), x], 0.0, atol=1e-13)
        exact -= np.outer(gamma, stiffness * (gamma @ step))
    np.testing.assert_allclose(force, exact, atol=1e-4 * np.abs(exact).max())
    assert b.ledger[HOURGLASS_WORK] > 0.0


@pytest.mark.parametrize("count", [1, 8])
def test_work_of_the_forces_is_the_energy_of_the_ledger(count: int) -> None:
    """Power balance along a large, twisting path through plastic flow: forces times steps against the ledger."""
    b = pieces(distorted(11, 0.1), np.arange(8)[None], count, law="j2")
    rng = np.random.default_rng(2)
    path = 0.25 * rng.uniform(-1, 1, (8, 3))
    work, before = 0.0, np.zeros((8, 3))
    steps = 4000
    for k in range(steps):
        s = np.pi / steps * np.sin(np.pi * (k + 0.5) / steps) / 2 * path
        force = b.move(s)
        work -= 0.5 * ((before + force) * s).sum()
        before = force
    stored = b.ledger[INTERNAL] + b.ledger[HOURGLASS_WORK]
    assert b.state[..., 0].max() > 0.1
    assert work == pytest.approx(stored, rel=2e-3)


def test_an_inverted_element_is_named() -> None:
    from graben.mechanics.scratch.mesh import brick as make

    mesh = make(np.linspace(0, 2, 3), np.linspace(0, 1, 2), np.linspace(0, 1, 2))
    b = pieces(mesh.points, mesh.cells, 1)
    step = np.zeros_like(b.x)
    step[mesh.cells[1, [1, 2, 5, 6]], 0] = -1.5
    with pytest.raises(AssertionError):
        b.move(step)
