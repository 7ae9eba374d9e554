"""What of a rising pressure a law carries, when a march with stabilisation is over, and how soft a body became."""

import numpy as np
import pytest

from graben.mechanics.fem.collapse import LoadCurve, Overload, RisingPressure
from graben.mechanics.fem.loads import edge_traction
from graben.mechanics.fem.march import StepOptions, advance, at_rest
from graben.mechanics.fem.newton import NewtonOptions

# A segment of 2 m whose settlement is that of one node: 1 MPa at time 0, 0.5 MPa/s.
PRESSURE = RisingPressure(np.array([0.0, -1.0]), 2.0, 1e6, 0.5e6)
DOWN = np.array([0.0, -0.01])


def test_viscous_pressure_is_power_over_that_of_a_unit_pressure():
    drag = np.array([0.0, -6e5])  # as a pressure of 0.3 MPa on 2 m
    assert PRESSURE.viscous(drag, DOWN) == pytest.approx(3e5)
    assert PRESSURE.viscous(None, DOWN) == 0.0
    assert PRESSURE.viscous(drag, -DOWN) == 0.0  # it heaves: nothing is carried
    assert PRESSURE.at(4.0) == 3e6


def test_an_overload_is_a_share_of_the_pressure_that_is_not_elastic():
    drag = np.array([0.0, -6e5])
    assert Overload(PRESSURE, 0.05, 0.1).reason(4.0, drag, DOWN) == "viscous stress carries 0.3 MPa of the pressure"
    assert Overload(PRESSURE, 0.2, 0.1).reason(4.0, drag, DOWN) == ""
    assert Overload(PRESSURE, 0.05, 0.2).reason(4.0, drag, DOWN) == ""  # hidden: 5 * 0.5 MPa/s * 0.2 s


def test_the_curve_takes_viscous_forces_off_and_its_compliance_is_of_its_ends():
    curve = LoadCurve(PRESSURE, np.zeros(2))
    assert curve.compliance_ratio() == 1.0
    curve.add(1.0, DOWN, None, 3)
    curve.add(2.0, 4 * DOWN, np.array([0.0, -6e5]), 5)
    assert curve.pressure == [1e6, 1.5e6, 2e6] and curve.iterations == [0, 3, 5]
    np.testing.assert_allclose(curve.carried, [1e6, 1.5e6, 1.7e6])
    np.testing.assert_allclose(curve.settlement, [0.0, 0.01, 0.04])
    assert curve.compliance_ratio() == pytest.approx(3.0)


def test_an_overload_ends_a_march_that_would_go_on_for_ever(grid, body, material):
    """A column of von Mises rock carries sigma_y * 2 / sqrt(3); its viscous stress would carry any load."""
    law = material(
        "drucker-prager", young_modulus=1e9, poisson_ratio=0.3, friction_angle=0.0, hardening="linear",
        initial_yield=1e6,
    )  # fmt: skip
    b = body(grid(1.0, 2.0, 2, 4), law, lambda x, y: (x == 0, y == 0))
    unit, length = edge_traction(b.mesh, np.array([0.0, 2.0]), np.array([1.0, 2.0]))
    pressure = RisingPressure(unit / length, length, 0.0, 1e6)
    run, curve = at_rest(b, b.untouched(), 0.0), LoadCurve(pressure, np.zeros(b.pattern.size))
    steps = advance(
        run, b, lambda t: 1e6 * t * unit, 2.0, StepOptions(0.02, 0.02, 1e-4), NewtonOptions(1e-8), relaxation=1e-3,
        overload=Overload(pressure, 0.01, 1e-3),
    )  # fmt: skip
    before = run.state
    for step in steps:
        assert run.state is step.state and run.before is before
        before = run.state
        curve.add(run.time, run.state.displacement, step.drag, step.iterations)
    assert not run.complete and "viscous stress carries" in run.reason
    strength = 2e6 / np.sqrt(3.0)
    assert 0.98 * strength < max(curve.carried) < strength < curve.pressure[-1]
