"""Newton with the consistent tangent: quadratic, exact in one round where linear, honest when it fails."""

import numpy as np
import pytest

from graben.mechanics.fem.loads import body_force, edge_traction
from graben.mechanics.fem.march import StepOptions, advance, at_rest, march
from graben.mechanics.fem.newton import NewtonOptions, equilibrate
from graben.mechanics.fem.stability import softest_stiffness
from graben.mechanics.materials.point import follow

ROLLERS = lambda x, y: (x == 0, y == 0)  # noqa: E731
GRANITE = {
    "young_modulus": 2e9,
    "poisson_ratio": 0.2,
    "friction_angle": np.radians(50),
    "dilation_angle": np.radians(20),
    "initial_yield": 0.5e6,
    "hardening_gain": 2e6,
    "hardening_rate": 200.0,
}


@pytest.fixture(scope="module")
def block(grid, body, material):
    """A bent 4 x 4 m grid of Drucker-Prager rock, pressed on a part of its top."""
    mesh = grid(4.0, 4.0, 8, 8, bend=0.2)
    b = body(mesh, material("drucker-prager", **GRANITE), ROLLERS)
    unit, _ = edge_traction(mesh, np.array([0.0, 4.0]), np.array([2.0, 4.0]))
    return b, unit


def test_elastic_equilibrium_takes_one_round_and_obeys_gravity(grid, body, material):
    """Column under its weight between rollers: sigma_yy = -rho g (H - y), sigma_xx = nu / (1 - nu) sigma_yy."""
    mesh = grid(1.0, 10.0, 2, 40)
    sides = lambda x, y: ((x == 0) | (x == 1), y == 0)  # noqa: E731
    b = body(mesh, material("elastic", young_modulus=5e9, poisson_ratio=0.25), sides)
    weight = body_force(mesh, 2500.0, np.array([0.0, -9.81]))
    step = equilibrate(b, b.untouched(), weight, np.zeros(len(b.fixed)), NewtonOptions(1e-12))
    assert step.converged and step.iterations == 1
    depth = 10.0 - mesh.points[mesh.quads].mean(axis=1)[:, 1]
    stress = step.state.stress.mean(axis=1)
    np.testing.assert_allclose(stress[:, 1], -2500 * 9.81 * depth, rtol=1e-9)
    np.testing.assert_allclose(stress[:, 0], stress[:, 1] / 3, rtol=1e-9)
    np.testing.assert_allclose(stress[:, 2], stress[:, 1] / 3, rtol=1e-9)
    modulus = 5e9 * 0.75 / (1.25 * 0.5)
    top = step.state.displacement[1::2][mesh.points[:, 1] == 10.0]
    np.testing.assert_allclose(top, -2500 * 9.81 * 100 / 2 / modulus, rtol=1e-9)


def test_plastic_steps_converge_quadratically(block):
    b, unit = block
    step = equilibrate(b, b.untouched(), 3e6 * unit, np.zeros(len(b.fixed)), NewtonOptions(1e-12))
    assert step.converged
    assert step.state.internal[..., 0].max() > 1e-4  # it did yield
    r = np.array(step.residuals)
    tail = r[(r > 1e-12) & (r < 0.05)][-3:]
    # e_{k+1} ~ C e_k^2: the order between the last residuals above round-off
    order = np.log(tail[2] / tail[1]) / np.log(tail[1] / tail[0])
    assert order > 1.7, r


def test_one_plane_strain_element_does_what_the_point_driver_does(grid, body, material):
    """Compression between smooth platens at constant lateral stress: a uniform state, so mesh and point agree."""
    confining, squeeze = 1e6, -0.02
    mesh = grid(1.0, 1.0, 2, 2, bend=0.2)
    law = material("drucker-prager", **GRANITE)
    b = body(mesh, law, lambda x, y: (x == 0, (y == 0) | (y == 1)))
    side, _ = edge_traction(mesh, np.array([1.0, 0.0]), np.array([1.0, 1.0]))
    top = mesh.points[b.fixed // 2, 1] == 1.0
    top &= b.fixed % 2 == 1
    run = at_rest(b, b.untouched(), 0.0)
    ends = [
        (run.time, run.state)
        for _ in advance(
            run,
            b,
            lambda t: min(1.0, t) * confining * side,
            2.0,
            StepOptions(0.02, 0.02, 0.001),
            NewtonOptions(1e-9),
            prescribed=lambda t: np.where(top, squeeze * max(0.0, t - 1.0), 0.0),
            save_times=np.array([1.0]),
        )
    ]
    assert run.complete
    stress = run.state.stress.reshape(-1, 4)
    np.testing.assert_allclose(stress, np.broadcast_to(stress[0], stress.shape), rtol=1e-5, atol=10.0)
    first = next(s for t, s in ends if t == 1.0)
    np.testing.assert_allclose(first.stress[0, 0, 0], -confining, rtol=1e-5)
    # the point: the same two legs (lateral stress first at no vertical strain, then the squeeze)
    targets = np.zeros((101, 4))
    targets[:51, 0] = -confining * np.linspace(0, 1, 51)
    targets[51:, 0] = -confining
    targets[51:, 1] = squeeze * np.linspace(0, 1, 51)[1:]
    point = follow("drucker-prager", law.parameters, "seee", targets)
    np.testing.assert_allclose(stress[0], point.stress[0, -1], rtol=2e-4, atol=2e3)


def test_work_balances_to_round_off_and_reactions_balance_loads(block):
    b, unit = block
    weight = body_force(b.mesh, 2700.0, np.array([0.0, -9.81]))
    load = lambda t: weight + 4e6 * t * unit  # noqa: E731
    start = equilibrate(b, b.untouched(), weight, np.zeros(len(b.fixed)), NewtonOptions(1e-12)).state
    run = march(b, start, load, 0.0, 1.0, StepOptions(0.1, 0.2, 0.01), NewtonOptions(1e-11))
    assert run.complete and run.state.internal[..., 0].max() > 1e-4
    assert run.energy_error() < 1e-9
    reaction = (run.force - load(1.0)).reshape(-1, 2)
    fixed = np.zeros(b.pattern.size, dtype=bool)
    fixed[b.fixed] = True
    reaction = np.where(fixed.reshape(-1, 2), reaction, 0.0)
    applied = load(1.0).reshape(-1, 2)
    np.testing.assert_allclose(reaction.sum(axis=0), -applied.sum(axis=0), atol=1e-8 * np.abs(applied).sum())
    moment = lambda f: (b.mesh.points[:, 0] * f[:, 1] - b.mesh.points[:, 1] * f[:, 0]).sum()  # noqa: E731
    np.testing.assert_allclose(moment(reaction), -moment(applied), rtol=1e-8)


def test_the_march_is_bitwise_repeatable_and_independent_of_saving(block):
    b, unit = block
    ends = [
        march(
            b,
            b.untouched(),
            lambda t: 3e6 * t * unit,
            0.0,
            1.0,
            StepOptions(0.25, 0.25, 0.01),
            NewtonOptions(),
            save_times=s,
        ).state
        for s in (None, None, np.array([0.25, 0.5]))
    ]
    for end in ends[1:]:
        assert np.array_equal(ends[0].displacement, end.displacement)
        assert np.array_equal(ends[0].stress, end.stress)


def test_a_load_beyond_strength_ends_the_march_with_the_last_equilibrium(grid, body, material):
    """A column of von Mises rock in plane strain carries sigma_y * 2 / sqrt(3)."""
    mesh = grid(1.0, 2.0, 2, 4)
    law = material(
        "drucker-prager",
        young_modulus=1e9,
        poisson_ratio=0.3,
        friction_angle=0.0,
        hardening="linear",
        initial_yield=1e6,
    )
    b = body(mesh, law, ROLLERS)
    unit, _ = edge_traction(mesh, np.array([0.0, 2.0]), np.array([1.0, 2.0]))
    run = march(
        b, b.untouched(), lambda t: 1e6 * t * unit, 0.0, 2.0, StepOptions(0.2, 0.2, 1e-4), NewtonOptions(1e-8)
    )
    assert not run.complete and run.reason and run.rejected > 0
    strength = 2 / np.sqrt(3)
    assert strength * 0.999 < run.time <= strength * (1 + 1e-6)
    np.testing.assert_allclose(run.state.stress[..., 1], -run.time * 1e6, rtol=1e-5)


def test_viscous_stabilisation_is_off_by_default_and_its_work_is_booked(block):
    b, unit = block
    arguments = (
        b,
        b.untouched(),
        lambda t: 3e6 * t * unit,
        0.0,
        1.0,
        StepOptions(0.1, 0.1, 0.01),
        NewtonOptions(1e-11),
    )
    plain, slow = march(*arguments), march(*arguments, relaxation=0.05)
    assert plain.drag_work == 0.0 and slow.drag_work > 0.0
    assert slow.energy_error() < 1e-9
    assert abs(slow.state.displacement[1::2].min()) < abs(plain.state.displacement[1::2].min())


def test_softest_stiffness_equals_the_smallest_eigenvalue(block):
    b, _ = block
    state = b.untouched()
    values = b.respond(state, np.zeros(b.pattern.size), True).values
    exact = np.linalg.eigvalsh(b.free_block.matrix(values).toarray())[0]
    np.testing.assert_allclose(softest_stiffness(b, state), exact, rtol=5e-3)


def test_bad_steps_are_refused():
    with pytest.raises(ValueError, match="smallest <= first"):
        StepOptions(first=1.0, largest=0.5, smallest=0.1)


@pytest.mark.parametrize(("length", "stress"), [(1e-6, 1.0), (1e4, 1.0), (1.0, 1e-6), (1e-3, 1e3)])
def test_units_do_not_matter(length, stress, grid, body, material):
    """The same body measured in other units of length and stress gives the same strains and the same rounds."""

    def run(a, b):
        mesh = grid(4.0 * a, 4.0 * a, 6, 6, bend=0.2)
        values = {
            k: v * b if k in ("young_modulus", "initial_yield", "hardening_gain") else v for k, v in GRANITE.items()
        }
        made = body(mesh, material("drucker-prager", **values), lambda x, y: (x == 0, y == 0))
        unit, _ = edge_traction(mesh, np.array([0.0, 4.0 * a]), np.array([2.0 * a, 4.0 * a]))
        return march(
            made,
            made.untouched(),
            lambda t: 3e6 * b * t * unit,
            0.0,
            1.0,
            StepOptions(0.25, 0.5, 0.01),
            NewtonOptions(1e-8),
        )

    plain, scaled = run(1.0, 1.0), run(length, stress)
    assert scaled.complete and scaled.iterations == plain.iterations
    reference = plain.state.displacement
    np.testing.assert_allclose(scaled.state.displacement / length, reference, atol=1e-6 * np.abs(reference).max())
    np.testing.assert_allclose(scaled.state.internal[..., 0], plain.state.internal[..., 0], atol=1e-8)
