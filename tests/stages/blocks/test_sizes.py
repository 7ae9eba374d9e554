"""Steps of loading: a fidelity's own, and more where inertia asks for them."""

import pytest

from graben.declared.knobs import values_at
from graben.schemas.scene import load_scene
from graben.stages.blocks.extent import extent_of
from graben.stages.blocks.sizes import steps_of
from tests.conftest import PIPELINES, command, settings

GRANITE = PIPELINES / "upscaling/voronoi-granite.toml"
DRAFT = ["fidelity=draft"]
LEAST = values_at("blocks", "draft")["numerics.steps"].steps


def steps(*overrides, blocks=420.0, scene=GRANITE):
    loaded = load_scene(scene, "blocks", [*DRAFT, *overrides])
    return steps_of(loaded, extent_of(loaded, None), blocks)


def pressure(mpa):
    return f'loading.confining_pressure="{mpa} MPa"'


def test_steps_go_as_one_over_the_root_of_the_confinement():
    low, high = steps(pressure(0.1)), steps(pressure(0.4))
    assert low == pytest.approx(2 * high, rel=1e-3) and high > LEAST
    assert steps(pressure(100)) == LEAST
    course = 'loading.confining_course=[["0 s", "4 MPa"], ["50 s", "0.1 MPa"]]'
    assert steps(pressure(4), course) == low


def test_steps_go_with_strain_and_with_blocks_along_the_height():
    one = steps(pressure(0.1))
    assert steps(pressure(0.1), 'loading.speed="10 mm/s"') == pytest.approx(2 * one, rel=1e-3)
    assert steps(pressure(0.1), blocks=4 * 420.0) == pytest.approx(2 * one, rel=1e-3)
    assert steps(pressure(0.1), 'loading.duration="1 s"') == LEAST


def test_a_scene_that_gives_its_steps_gets_them_and_a_programme_those_of_its_fidelity():
    assert steps(pressure(0.1), "numerics.steps=500") == 500
    assert steps(scene=PIPELINES / "upscaling/slope-blocks.toml") == LEAST


def test_without_any_confinement_to_speak_of_the_steps_stay_bounded():
    assert steps('loading.confining_pressure="1 Pa"') == 20 * LEAST


@pytest.mark.verify
@pytest.mark.parametrize("mpa", [0.1, 0.5, 1, 4])
def test_a_draft_is_quasi_static_at_every_confinement(mpa, tmp_path):
    import json

    overrides = settings([*DRAFT, pressure(mpa), "output.vtk=false"])
    result = command("dem-run", GRANITE, *overrides, "-o", tmp_path / "o.nc", "--json", "-q")
    headline = json.loads(result.stdout.splitlines()[-1])
    assert headline["warnings"] == []
    assert headline["kinetic_over_stored_energy"] < 0.05
    assert headline["lateral_over_applied_stress"] < 1.3
