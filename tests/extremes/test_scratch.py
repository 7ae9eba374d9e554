"""Scratch at the edges of what a scene may ask: it finishes with its books closed, or says why it cannot."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

from graben.errors import NumericsFailed
from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.scratch.mesh import specimen
from graben.mechanics.scratch.run import ScratchFailed, simulate
from graben.mechanics.scratch.setup import Numerics, Tip
from tests.conftest import command, settings

QUICK = {"indent_speed": 0.01, "slide_speed": 0.05, "lift_speed": 0.02, "rest_steps": 100}


def scratch(  # type: ignore[no-untyped-def]
    friction: float = 0.1, depth: float = 2e-6, nu: float = 0.33, unit: float = 1.0, table=None, **more
):
    """A 6 um slide on 4 um bricks; `unit` scales every length."""
    table = table or [[0.0, 380e6], [0.2, 589e6], [1.0, 762e6]]
    par = pack("j2", {"young_modulus": 210e9, "poisson_ratio": nu, "hardening": table})
    radius, path = 50e-6 * unit, 6e-6 * unit
    mesh = specimen(80e-6 * unit, 36e-6 * unit, 15e-6 * unit, 35e-6 * unit, path, 14e-6 * unit, 4e-6 * unit)
    tip = Tip(radius, friction, 35e-6 * unit, depth * unit, path)
    return simulate(mesh, LAWS["j2"].id, par, np.zeros(1), 7800.0, tip, Numerics(**{**QUICK, **more}))


@cache
def usual():  # type: ignore[no-untyped-def]
    return scratch()


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
    small, large = usual(), scratch(unit=1000.0)
    assert len(small.time) == len(large.time)
    np.testing.assert_allclose(large.force, 1e6 * small.force, rtol=1e-4, atol=1e-4 * np.abs(large.force).max())


def test_a_step_beyond_the_stable_one_is_noticed() -> None:
    with pytest.raises(NumericsFailed):
        scratch(safety=6.0)


def test_mass_beyond_its_cap_is_refused() -> None:
    with pytest.raises(ScratchFailed, match="mass scaling"):
        scratch(floor=1.0, mass_cap=1e-6)


@pytest.mark.parametrize("unit", [0.1e-6 / 50e-6, 1e-3 / 50e-6], ids=["R-0.1um", "R-1mm"])
def test_grains_of_0_1_um_and_1_mm_scratch_alike(unit: float) -> None:
    """The force goes with the square of the radius, whatever the radius."""
    one, other = usual(), scratch(unit=unit)
    np.testing.assert_allclose(other.force, unit**2 * one.force, rtol=1e-4, atol=1e-4 * np.abs(other.force).max())


@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5, 1.0, 2.0])
def test_apparent_friction_lies_between_ploughing_and_the_steepest_contact(friction: float) -> None:
    """Each node bears a normal force within the contact's angle, and friction times it: tan(mu + angle) at most."""
    run = scratch(friction=friction, volume_limit=0.3)
    sliding = run.phase == 1
    last = np.flatnonzero(sliding)[-3:]
    ratio = float((run.force[last, 0] / -run.force[last, 2]).mean())
    angle = np.arcsin(np.sqrt(2 * 50e-6 * 2e-6) / 50e-6) * 1.3  # shoulders touch a little beyond the half-width
    steepest = np.arctan(friction) + angle
    assert 0.0 < ratio < (np.tan(steepest) if steepest < 0.5 * np.pi else np.inf)


@pytest.mark.parametrize("penalty", [1e-6, 1e-3, 1e-2])
def test_contacts_too_soft_to_dent_the_specimen_stop_with_the_reason(penalty: float) -> None:
    """The tip would sink through the surface, and leave a groove of nothing."""
    with pytest.raises(ScratchFailed, match="overlaps the surface"):
        scratch(penalty=penalty)


def test_the_stiffest_contact_stops_or_dents() -> None:
    """A penalty of 5 is beyond what the step of the bricks takes: the ledger says so."""
    with pytest.raises(ScratchFailed, match="energy error"):
        scratch(penalty=5.0)


@pytest.mark.parametrize("penalty", [0.2, 0.5, 1.0, 2.0])
def test_the_groove_hardly_depends_on_the_penalty(penalty: float) -> None:
    """Overlap falls as the inverse of the penalty: 15 % of the depth over 2, on coarse bricks."""
    run = scratch(penalty=penalty)
    assert run.cost["tip_overlap_share"] < 0.02 / penalty
    assert run.unloaded.points[np.unique(run.unloaded.faces), 2].min() == pytest.approx(-1.93e-6, rel=0.03)


@pytest.mark.verify
def test_a_dent_of_a_nanometre_is_hertz_on_its_own_contact() -> None:
    """Never yields, R 50 um, a/h = 2: 4/3 E* sqrt(R) d^1.5 of the depth less the overlap, within coarse bricks."""
    par = pack("elastic", {"young_modulus": 210e9, "poisson_ratio": 0.33})
    radius, depth = 50e-6, 1e-9
    mesh = specimen(4e-6, 2e-6, 2e-6, 2e-6, 0.0, np.sqrt(2 * radius * depth), 0.16e-6)
    numerics = Numerics(indent_speed=2e-5, lift_speed=1e-3, rest_steps=20, penalty=2.0)
    run = simulate(mesh, LAWS["elastic"].id, par, np.zeros(1), 7800.0, Tip(radius, 0.0, 2e-6, depth, 0.0), numerics)
    push = -run.force[run.phase == 0][-1, 2]
    hertz = 4 / 3 * 210e9 / (1 - 0.33**2) * np.sqrt(radius) * (depth * (1 - run.cost["tip_overlap_share"])) ** 1.5
    assert push == pytest.approx(hertz, rel=0.25)


@pytest.mark.verify
def test_an_elastic_specimen_springs_back_and_gets_no_degree_of_wear(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """What vibration leaves of a groove is no groove."""
    (tmp_path / "s.toml").write_text('kind = "scratch"\nfidelity = "draft"\n')
    values = {
        "specimen.length": '"90 um"', "specimen.width": '"80 um"', "mesh.size": '"2.5 um"', "mesh.draft_factor": 1.0,
        "tip.depth": '"0.2 um"', "tip.start": '"35 um"', "tip.path": '"3 um"', "numerics.indent_speed": 0.002,
        "numerics.slide_speed": 0.05, "numerics.lift_speed": 0.02, "numerics.penalty": 2.0, "output.frames": 0,
        "output.sections": 11, "output.points": 41,
        "material": '{law = "elastic", parameters = {young_modulus = "210 GPa", poisson_ratio = 0.33}}',
    }  # fmt: skip
    changes = settings(f"{key}={value}" for key, value in values.items())
    result = command("scratch", tmp_path / "s.toml", *changes, "-o", tmp_path / "s.nc", "--json", "-q")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["degree_of_wear"] is None
    assert any("sprang back" in w for w in found["warnings"])
