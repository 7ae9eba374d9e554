"""Swarm, Levenberg-Marquardt and their combination: known optima, bounds never left, same seed same answer."""

import numpy as np
import pytest

from graben.mechanics.optimise.levenberg_marquardt import jacobian, levenberg_marquardt
from graben.mechanics.optimise.multistart import Plan, search
from graben.mechanics.optimise.space import Box
from graben.mechanics.optimise.swarm import stratified, swarm

BOX = Box.of(["x", "y"], [-2.0, -2.0], [2.0, 3.0])


def rosenbrock(unit):
    """Residuals; the optimum is (1, 1)."""
    x = BOX.to_values(unit)
    return np.stack([10.0 * (x[:, 1] - x[:, 0] ** 2), 1.0 - x[:, 0]], axis=1)


def squares(residuals):
    return lambda u: np.sum(residuals(u) ** 2, axis=1)


class Watch:
    """Wraps a function and remembers whether it was ever asked outside the unit box."""

    def __init__(self, function):
        self.function, self.inside, self.calls = function, True, 0

    def __call__(self, u):
        self.inside &= bool((u >= 0.0).all() and (u <= 1.0).all())
        self.calls += len(u)
        return self.function(u)


def test_swarm_finds_rosenbrock_and_stays_inside():
    f = Watch(squares(rosenbrock))
    r = swarm(f, 2, particles=30, generations=200, seed=1)
    np.testing.assert_allclose(BOX.to_values(r.best), [1.0, 1.0], atol=1e-3)
    assert f.inside and f.calls == r.evaluations == 30 * 201
    assert (np.diff(r.history) <= 0).all()


def test_swarm_with_the_settings_of_yetisir_finds_a_bowl():
    f = Watch(lambda u: np.sum((u - 0.3) ** 2, axis=1))
    r = swarm(f, 5, inertia=1.2, inertia_reduction=0.1, cognitive=2.0, social=2.0, seed=2)
    assert r.value < 1e-6 and f.inside


def test_swarm_finds_the_deepest_of_many_valleys():
    """Rastrigin in three dimensions: one global optimum among 1,000 local ones."""

    def rastrigin(u):
        x = 10.24 * (u - 0.4)
        return 30.0 + np.sum(x**2 - 10.0 * np.cos(2 * np.pi * x), axis=1)

    best = min(swarm(rastrigin, 3, particles=40, generations=150, seed=s).value for s in range(3))
    assert best < 1e-6


def test_swarm_is_reproducible_and_takes_guesses():
    f = squares(rosenbrock)
    a, b = (swarm(f, 2, particles=10, generations=5, seed=7) for _ in range(2))
    np.testing.assert_array_equal(a.positions, b.positions)
    assert not np.array_equal(a.positions, swarm(f, 2, particles=10, generations=5, seed=8).positions)
    exact = BOX.to_unit(np.array([[1.0, 1.0]]))
    assert swarm(f, 2, particles=10, generations=0, starts=exact).value < 1e-20


def test_stratified_puts_one_point_in_each_slice():
    x = stratified(np.random.Generator(np.random.PCG64(0)), 16, 3)
    for k in range(3):
        assert sorted((x[:, k] * 16).astype(int)) == list(range(16))


def test_swarm_refuses_values_that_are_not_finite():
    with pytest.raises(ValueError, match="finite"):
        swarm(lambda u: np.full(len(u), np.nan), 2)


def test_levenberg_marquardt_solves_rosenbrock_and_stays_inside():
    f = Watch(rosenbrock)
    r = levenberg_marquardt(f, BOX.to_unit(np.array([-1.2, 1.0])), max_iterations=100)
    np.testing.assert_allclose(BOX.to_values(r.x), [1.0, 1.0], atol=1e-6)
    assert f.inside and r.value < 1e-12


def test_levenberg_marquardt_holds_a_parameter_at_its_bound_and_finds_the_best_there():
    """The free optimum is outside: y <= 0.25 forces x^2 = y nearly; compare with a fine scan of that face."""
    box = Box.of(["x", "y"], [-2.0, -2.0], [2.0, 0.25])

    def residuals(u):
        x = box.to_values(u)
        return np.stack([10.0 * (x[:, 1] - x[:, 0] ** 2), 1.0 - x[:, 0]], axis=1)

    f = Watch(residuals)
    r = levenberg_marquardt(f, np.array([0.3, 0.4]), max_iterations=200)
    scan = np.linspace(0, 1, 200_001)
    best = squares(residuals)(np.stack([scan, np.ones_like(scan)], axis=1)).min()
    assert f.inside and r.x[1] == 1.0 and r.value == pytest.approx(best, rel=1e-6)


def test_levenberg_marquardt_matches_linear_least_squares():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(20, 4)), rng.normal(size=20)
    exact = np.linalg.lstsq(a, b, rcond=None)[0]
    low, high = exact - rng.uniform(0.5, 2, 4), exact + rng.uniform(0.5, 2, 4)
    box = Box.of(list("abcd"), low, high)
    r = levenberg_marquardt(lambda u: box.to_values(u) @ a.T - b, np.full(4, 0.9), max_iterations=100)
    np.testing.assert_allclose(box.to_values(r.x), exact, atol=1e-5)
    np.testing.assert_allclose(jacobian(lambda u: box.to_values(u) @ a.T - b, r.x, 1e-4), a * (high - low), rtol=1e-6)


def test_search_is_reproducible_and_orders_its_members():
    plan = Plan(starts=2, particles=12, generations=20, refine_best=3)
    a, b = (search(rosenbrock, 2, plan, seed=3) for _ in range(2))
    np.testing.assert_array_equal(a.members, b.members)
    assert (np.diff(a.member_values) >= 0).all() and a.best.value == a.member_values[0] < 1e-10


def test_box_maps_both_ways_and_never_leaves_its_bounds():
    box = Box.of(["a", "b"], [1e3, 0.1], [1e9, 0.4], [True, False])
    u = np.random.default_rng(0).random((1000, 2))
    np.testing.assert_allclose(box.to_unit(box.to_values(u)), u, atol=1e-12)
    ends = box.to_values(np.array([[0.0, 0.0], [1.0, 1.0], [-3.0, 5.0]]))
    assert (ends >= box.lower).all() and (ends <= box.upper).all()
    np.testing.assert_allclose(ends[1], [1e9, 0.4])
    h = 1e-7
    numeric = (box.to_values(u[0] + h) - box.to_values(u[0] - h)) / (2 * h)
    np.testing.assert_allclose(box.slope(u[0]), numeric, rtol=1e-6)


@pytest.mark.parametrize(
    ("low", "high", "log", "text"),
    [(2.0, 1.0, False, "a: expected lower < upper"), (0.0, 1.0, True, "a: a log scale"), (np.nan, 1.0, False, "a:")],
)
def test_box_names_bad_bounds(low, high, log, text):
    with pytest.raises(ValueError, match=text):
        Box.of(["a"], [low], [high], [log])
