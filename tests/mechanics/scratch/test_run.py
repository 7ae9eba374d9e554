"""Whole runs on small meshes: Hertz, energy, volumes, damage, determinism, failure."""

from __future__ import annotations

import numpy as np
import pytest

from graben.mechanics.materials.laws import LAWS, pack
from graben.mechanics.scratch.mesh import specimen
from graben.mechanics.scratch.run import ScratchFailed, simulate
from graben.mechanics.scratch.setup import Damage, Numerics, Tip
from graben.mechanics.wear.groove import volume_ledger

E, NU = 210e9, 0.33
TABLE = [[0.0, 380e6], [0.05, 483e6], [0.2, 589e6], [1.0, 762e6]]
QUICK = {"indent_speed": 0.01, "slide_speed": 0.05, "lift_speed": 0.02, "rest_steps": 150}


def steel(law: str = "j2", **more):  # type: ignore[no-untyped-def]
    values = {"young_modulus": E, "poisson_ratio": NU, **more}
    if law != "elastic":
        values["hardening"] = TABLE
    par = pack(law, values)
    return LAWS[law].id, par, LAWS[law].initial_state(par)


def small(path: float = 10e-6, size: float = 4e-6):  # type: ignore[no-untyped-def]
    return specimen(90e-6, 40e-6, 15e-6, 35e-6, path, np.sqrt(2 * 50e-6 * 2e-6), size)


@pytest.fixture(scope="module")
def scratched():  # type: ignore[no-untyped-def]
    mesh = small()
    tip = Tip(50e-6, 0.1, 35e-6, 2e-6, 10e-6)
    return mesh, simulate(mesh, *steel(), 7800.0, tip, Numerics(**QUICK), frames=2)


def test_first_contact_is_hertz() -> None:
    """F = 4/3 E/(1 - nu^2) sqrt(R) d^1.5 in a thick elastic block; a stiff penalty keeps penetration small."""
    radius, depth = 50e-6, 0.5e-6
    a = np.sqrt(radius * depth)
    mesh = specimen(160e-6, 80e-6, 80e-6, 80e-6, 0.0, a, 0.8e-6, growth=1.4, growth_depth=1.3)
    tip = Tip(radius, 0.0, 80e-6, depth, 0.0)
    numerics = Numerics(indent_speed=0.004, penalty=5.0, safety=0.5, lift_speed=0.05, rest_steps=0, volume_limit=0.2)
    run = simulate(mesh, *steel("elastic"), 7800.0, tip, numerics)
    sunk = radius - run.tip[:, 2]
    exact = 4.0 / 3.0 * E / (1 - NU**2) * np.sqrt(radius) * sunk**1.5
    at = np.flatnonzero(run.phase == 0)[-1]
    assert -run.force[at, 2] == pytest.approx(exact[at], rel=0.04)


def test_energy_closes(scratched) -> None:  # type: ignore[no-untyped-def]
    _, run = scratched
    late = run.energy["external"] > 0.1 * run.energy["external"].max()
    assert run.error[late].max() < 5e-3
    e = {k: v[-1] for k, v in run.energy.items()}
    assert e["friction"] > 0 and e["internal"] > 0 and abs(e["contact"]) < 1e-12
    assert e["kinetic"] < 1e-3 * e["internal"]
    assert e["hourglass"] < 0.06 * e["internal"]


def test_volumes_close_and_nothing_is_lost_without_damage(scratched) -> None:  # type: ignore[no-untyped-def]
    _, run = scratched
    for state in (run.loaded, run.unloaded):
        v = volume_ledger(
            state.points, state.faces, float(state.tip[0]), run.first_volumes.sum(), state.volumes.sum(), 0.0
        )
        assert v.groove > 0 and abs(v.closure) < 1e-9
        assert abs(v.compressed) < 0.12 * v.groove
    assert 0.98 < run.cost["volume_ratio_min"] <= run.cost["volume_ratio_max"] < 1.02


def test_forces_and_phases_are_those_of_a_scratch(scratched) -> None:  # type: ignore[no-untyped-def]
    _, run = scratched
    assert run.phases == ("indent", "slide", "lift", "rest")
    slide = run.phase == 1
    normal, along = -run.force[slide, 2], run.force[slide, 0]
    assert (normal > 0).all() and (along > 0).all()
    late = normal.size // 2
    assert 0.12 < (along[late:] / normal[late:]).mean() < 0.4  # friction 0.1 and ploughing
    assert run.touching[-1] == 0 and not run.force[-1].any()
    assert [f.name for f in run.frames] == ["indent", "slide-1", "slide-2", "slide", "rest"]


def test_same_run_twice_is_bitwise_the_same(scratched) -> None:  # type: ignore[no-untyped-def]
    mesh, first = scratched
    tip = Tip(50e-6, 0.1, 35e-6, 2e-6, 10e-6)
    again = simulate(mesh, *steel(), 7800.0, tip, Numerics(**QUICK), frames=2)
    np.testing.assert_array_equal(first.force, again.force)
    np.testing.assert_array_equal(first.unloaded.points, again.unloaded.points)
    np.testing.assert_array_equal(first.unloaded.stress, again.unloaded.stress)


def test_eight_points_agree_with_one() -> None:
    mesh = small(path=0.0)
    tip = Tip(50e-6, 0.1, 35e-6, 1.5e-6, 0.0)
    one = simulate(mesh, *steel(), 7800.0, tip, Numerics(**QUICK))
    eight = simulate(mesh, *steel(), 7800.0, tip, Numerics(points=8, **QUICK))
    peak = [-r.force[r.phase == 0, 2].min() for r in (one, eight)]
    assert peak[0] == pytest.approx(peak[1], rel=0.06)  # 4 um elements; 1 to 2 % on finer ones


def test_damage_removes_material_and_sections_follow_what_remains() -> None:
    mesh = small(path=4e-6)
    law, par, state = steel("erve", damage_threshold=2e6, split="none")
    slot = LAWS["erve"].index("max_damage_step")
    tip = Tip(50e-6, 0.1, 35e-6, 2e-6, 4e-6)
    run = simulate(
        mesh, law, par, state, 7800.0, tip, Numerics(energy_limit=0.2, **QUICK), Damage(3e6, 0.95, slot), names=(0, 1)
    )
    gone = run.unloaded.alive == 0
    assert run.cost["removed_elements"] == gone.sum() > 0
    assert not np.isin(run.unloaded.faces, np.setdiff1d(mesh.cells[gone], mesh.cells[~gone])).any()
    living = ~gone
    state = run.unloaded
    v = volume_ledger(
        state.points,
        np.concatenate([state.faces, state.supports]),
        float(state.tip[0]),
        run.first_volumes[living].sum(),
        state.volumes[living].sum(),
        run.first_volumes[gone].sum(),
    )
    assert v.removed > 0 and abs(v.closure) < 1e-6


def test_an_energy_error_beyond_the_limit_stops_the_run_and_keeps_a_state() -> None:
    tip = Tip(50e-6, 0.1, 35e-6, 2e-6, 10e-6)
    with pytest.raises(ScratchFailed, match="energy error") as caught:
        simulate(small(), *steel(), 7800.0, tip, Numerics(energy_limit=1e-9, **QUICK))
    assert np.isfinite(caught.value.last_good.points).all()
    assert "numerics" in str(caught.value)
