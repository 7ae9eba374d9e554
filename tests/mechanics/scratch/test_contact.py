"""Sphere contact: friction limits, history, and its energy ledger; the tip's path."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.scratch.contact import sphere_contact
from graben.mechanics.scratch.motion import Phase, phase_rows, tip_position
from graben.mechanics.scratch.one_point import LEDGER_SIZE, NORMAL_STORED, TANGENT_STORED, TANGENTIAL

K, R, MU = 1e4, 1.0, 0.2


def drag(moves: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """One fixed node under a sphere that starts just above it and follows `moves`; forces and ledger after each."""
    x, tangent = np.zeros((1, 3)), np.zeros((1, 3))
    tip, ledger, total = np.array([0.0, 0.0, R]), np.zeros(LEDGER_SIZE), np.zeros(3)
    out = []
    for move in moves:
        tip += move
        force = np.zeros((1, 3))
        sphere_contact(
            x, np.zeros((1, 3)), np.array([0]), np.array([K]), 1.0, tangent, tip, move, R, MU, force, total, ledger
        )
        np.testing.assert_array_equal(force[0], total)
        out.append((total.copy(), ledger.copy()))
    return out


def test_sticks_and_then_slips_at_the_coulomb_limit() -> None:
    press = np.tile([0.0, 0.0, -1e-5], (100, 1))  # 1e-3 deep: 10 N
    slide = np.tile([1e-6, 0.0, 0.0], (600, 1))
    out = drag(np.concatenate([press, slide]))
    normal = -out[99][0][2]
    assert normal == pytest.approx(K * 1e-3, rel=1e-9)
    stick = out[100 + 100][0]
    assert stick[0] == pytest.approx(K * 1.01e-4, rel=2e-2)  # spring, before the limit 2 N at 2e-4
    slip = out[-1][0]
    assert slip[0] == pytest.approx(MU * normal, rel=5e-3)  # along the motion: the tip drags the specimen


def test_work_of_the_tip_is_stored_or_lost_in_friction() -> None:
    steps = 4000
    t = np.linspace(0, 1, steps + 1)
    way = np.c_[
        3e-4 * np.sin(9 * t), 2e-4 * (np.cos(7 * t) - 1), -1e-3 * np.sin(np.pi * t / 2) + 2e-4 * np.sin(40 * t) * t
    ]
    moves = np.diff(way, axis=0)
    out = drag(moves)
    force = np.array([f for f, _ in out])
    before = np.vstack([np.zeros(3), force[:-1]])
    work = 0.5 * ((force + before) * moves).sum()
    e = out[-1][1]
    assert e[TANGENTIAL] - e[TANGENT_STORED] > 0.0
    assert work == pytest.approx(e[NORMAL_STORED] + e[TANGENTIAL], rel=2e-3)


def test_a_node_outside_forgets_its_friction() -> None:
    out = drag(np.array([[0, 0, -1e-4], [1e-5, 0, 0], [0, 0, 1e-3], [0, 0, -1e-3]]))
    assert out[1][0][0] > 0.05 and not out[2][0].any() and abs(out[3][0][0]) < 1e-3  # a fresh spring


def test_path_has_smooth_ends_and_the_right_length() -> None:
    phases = [Phase("indent", 2e-6, 20.0, (0, 0, -1)), Phase("slide", 60e-6, 100.0, (1, 0, 0), ramp=0.1)]
    rows, origin, p = phase_rows(phases), np.array([50e-6, 0.0, 50e-6]), np.zeros(3)
    total = sum(phase.duration for phase in phases)
    where = []
    for t in np.linspace(0.0, total, 4001):
        tip_position(t, rows, origin, p)
        where.append(p.copy())
    np.testing.assert_allclose(where[-1], [110e-6, 0.0, 48e-6], rtol=1e-12)
    v = np.diff(np.array(where), axis=0) / (total / 4000)
    assert np.abs(v[[0, -1]]).max() < 0.5
    assert v[:, 0].max() == pytest.approx(100.0, rel=1e-6) and -v[:, 2].min() == pytest.approx(20.0, rel=1e-3)
    assert np.abs(np.diff(v, axis=0)).max() < 2.0
