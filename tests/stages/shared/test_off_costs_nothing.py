"""Arrays of features that are off are not allocated: they are absent, or have no rows."""

import numpy as np
import pytest

from graben.stages.shared.default_scene import default_scene

SMALL = ["fidelity=draft", 'domain.width="4 m"', 'domain.height="4 m"', "numerics.steps=300", "loading.states=4"]


def blocks(*overrides):
    from graben.stages.blocks.stage import prepare

    return prepare(default_scene("blocks", [*SMALL, *overrides])).model


def test_blocks_keep_no_seats_without_stress_in_situ_and_no_plastic_strain_without_strength():
    model = blocks()
    assert model.pairs.seat.size == 0 and model.motion.rows.seat.size == 0
    assert type(model.skeleton.zones).__name__ == "ElasticZones"
    assert not any("plastic" in name or "flag" in name for name in model.skeleton.zones._fields)
    assert len(blocks('rock.zones="mohr-coulomb"').skeleton.zones.flag) == len(model.zone_area)


def test_rigid_blocks_keep_no_zone_stiffness():
    zones = blocks('rock.zones="rigid"').skeleton.zones
    assert not {"gradient", "lam", "mu", "triangles"} & set(zones._fields)


def test_blocks_on_one_thread_send_nothing_to_other_parts_where_there_are_none():
    model = blocks()
    assert len(model.parts.node) > 2 or model.motion.far.size == 0


@pytest.mark.parametrize("asked", [False, True])
def test_the_history_keeps_forces_of_the_balance_only_where_asked(asked, tmp_path):
    from graben.mechanics.blocks.record.history import History

    history = History(blocks(), asked)
    history.save()
    arrays = history.arrays()
    assert ("body_force" in arrays) == asked and ("overlap_moment" in arrays) == asked
    assert not {"zone_plastic_strain", "zone_state", "block_stress", "block_removed"} & set(arrays)


def grains(friction, periodic):
    from graben.mechanics.particles.assembly import Assembly
    from graben.mechanics.particles.law import LinearLaw

    one = np.array([1.0])
    law = LinearLaw(
        radius=one * 1e-3, density=one * 2500.0, normal_stiffness=one * 1e3, wall_stiffness=1e4, shear_ratio=0.8,
        friction=friction, wall_friction=friction, damping=0.3, shear_damping=0.3,
    )  # fmt: skip
    return Assembly(law, np.array([[5e-3, 5e-3, 2e-3]]), np.zeros(1, np.int64), (1e-2, 1e-2), periodic=periodic)


def test_smooth_grains_have_no_slip_and_no_moments():
    smooth, rough = grains(0.0, True), grains(0.5, True)
    assert smooth.contacts.slip is None and smooth.loads[1] is None and smooth.period is not None
    assert rough.contacts.slip is not None and rough.loads[1].shape == (1, 3)
    assert grains(0.0, False).period is None


@pytest.mark.parametrize(("points", "hour"), [(1, True), (8, False)])
def test_only_a_scratch_with_one_point_has_hourglass_forces(points, hour):
    from graben.mechanics.scratch.body import Body
    from graben.mechanics.scratch.setup import Tip
    from graben.stages.scratch.stage import mesh_of, numerics_of, prepare

    scene = default_scene("scratch", ["fidelity=draft", f"numerics.points={points}", 'tip.path="0 um"'])
    law, par, _, _ = prepare(scene)
    tip, mesh = Tip(5e-5, 0.1, 5e-5, 2e-6, 0.0), mesh_of(scene)
    body = Body(mesh, law.id, par, law.initial_state(par), 7800.0, numerics_of(scene), tip, np.zeros((1, 6)), 6e3,
                None, (-1, -1))  # fmt: skip
    assert len(body.hour) == (len(mesh.cells) if hour else 0)
    assert body.sig.shape[1] == points
