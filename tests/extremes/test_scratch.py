"""Scratch at the edges of what a scene may ask: it finishes with its books closed, or says why it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.scratch.mesh import specimen
from graben.mechanics.scratch.run import ScratchFailed, simulate
from graben.mechanics.scratch.setup import Numerics, Tip

QUICK = {"indent_speed": 0.01, "slide_speed": 0.05, "lift_speed": 0.02, "rest_steps": 100}


def scratch(friction: float = 0.1, depth: float = 2e-6, nu: float = 0.33, unit: float = 1.0, table=None, **more):  # type: ignore[no-untyped-def]
    """A 6 um slide on 4 um bricks; `unit` scales every length."""
    table = table or [[0.0, 380e6], [0.2, 589e6], [1.0, 762e6]]
    par = pack("j2", {"young_modulus": 210e9, "poisson_ratio": nu, "hardening": table})
    radius, path = 50e-6 * unit, 6e-6 * unit
    mesh = specimen(80e-6 * unit, 36e-6 * unit, 15e-6 * unit, 35e-6 * unit, path, 14e-6 * unit, 4e-6 * unit)
    tip = Tip(radius, friction, 35e-6 * unit, depth * unit, path)
    return simulate(mesh, LAWS["j2"].id, par, np.zeros(1), 7800.0, tip, Numerics(**{**QUICK, **more}))


@pytest.mark.parametrize(
    "case",
    [
        {"friction": 0.0},
        {"friction": 1.0},
        {"depth": 0.02e-6, "indent_speed": 2e-4, "lift_speed": 2e-4, "slide_speed": 0.01},
        {"nu": 0.0},
        {"nu": 0.49},
        {"table": [[0.0, 380e6]]},
        {"table": [[0.0, 1e12]]},
        {"table": [[0.0, 1e6], [1.0, 2e6]]},
    ],
    ids=["frictionless", "rough", "shallow", "nu-0", "nu-0.49", "perfectly-plastic", "never-yields", "butter"],
)
def test_energy_closes_at_the_edges(case: dict) -> None:
    limits = {"volume_limit": 0.3}
    run = scratch(**case, **limits)
    late = run.energy["external"] > 0.1 * run.energy["external"].max()
    assert run.error[late].max() < 0.02
    assert np.isfinite(run.unloaded.points).all() and np.isfinite(run.unloaded.stress).all()
    assert not run.force[-1].any()


def test_scale_of_lengths_changes_nothing_but_units() -> None:
    """No length in the model: a scratch a thousand times larger has the same stresses and 1e6 the force."""
    small, large = scratch(), scratch(unit=1000.0)
    assert len(small.time) == len(large.time)
    np.testing.assert_allclose(large.force, 1e6 * small.force, rtol=1e-4, atol=1e-4 * np.abs(large.force).max())


def test_a_step_beyond_the_stable_one_is_noticed() -> None:
    with pytest.raises(NumericsFailed):
        scratch(safety=6.0)


def test_mass_beyond_its_cap_is_refused() -> None:
    with pytest.raises(ScratchFailed, match="mass scaling"):
        scratch(floor=1.0, mass_cap=1e-6)
